#include "apps/bus/bus.h"

#include "io/can/open_port.h"
#include "io/input_error.h"

namespace shiftrig::bus {

namespace {

io::can::LinkOptions can_options(const Options& options) {
    io::can::LinkOptions can;
    can.role = options.role == Role::rig ? io::can::Role::rig : io::can::Role::controller;
    can.tick_ns = options.tick_ns;
    return can;
}

io::lcm::LinkOptions lcm_options(const Options& options) {
    io::lcm::LinkOptions lcm;
    lcm.role = options.role == Role::rig ? io::lcm::Role::rig : io::lcm::Role::controller;
    lcm.model_name = options.model_name;
    lcm.tick_ns = options.tick_ns;
    lcm.lockstep = options.lockstep;
    lcm.command_timeout_ns = static_cast<std::int64_t>(options.command_timeout * 1e9);
    return lcm;
}

}  // namespace

Bus::Bus(const std::string& name, const io::can::Mapping* mapping, io::SignalTable& signals,
         const Options& options)
    : name_(name) {
    if (name.starts_with("lcm:")) {
        lcm_.emplace(name.substr(4), signals, lcm_options(options));
        return;
    }
    if (!name.starts_with("can:") && !name.starts_with("udpcan:"))
        throw io::InputError("bus " + name +
                             ": unknown kind; it is inprocess, can:INTERFACE, udpcan:GROUP:PORT or lcm:URL");
    owned_.push_back(io::can::open_port(name, io::can::filters_of(*mapping, can_options(options).role)));
    wire_ = owned_.back().get();
    join_can(*wire_, *mapping, signals, options, io::can::AddressClaim::claim);
    can_->claim_addresses();
}

Bus::Bus(const std::string& name, io::can::CanPort& port, const io::can::Mapping& mapping,
         io::SignalTable& signals, const Options& options)
    : name_(name) {
    join_can(port, mapping, signals, options, io::can::AddressClaim::settled);
}

void Bus::join_can(io::can::CanPort& wire, const io::can::Mapping& mapping, io::SignalTable& signals,
                   const Options& options, io::can::AddressClaim claim) {
    auto can = can_options(options);
    can.address_claim = claim;
    port_ = &wire;
    if (options.can_faults) {
        auto faulty = std::make_unique<io::can::FaultyPort>(*port_, *options.can_faults, mapping);
        port_ = faulty_ = faulty.get();
        owned_.push_back(std::move(faulty));
    }
    if (!options.can_replay.empty()) {
        const auto heard = io::can::message_filters(mapping, can.role);
        owned_.push_back(std::make_unique<io::can::CandumpReplay>(options.can_replay, heard, port_));
        port_ = owned_.back().get();
    }
    if (!options.can_log.empty()) {
        const std::string interface = name_.starts_with("can:") ? name_.substr(4) : "can0";
        auto log = std::make_unique<io::can::CandumpLogger>(*port_, options.can_log, interface);
        port_ = log_ = log.get();
        owned_.push_back(std::move(log));
    }
    can_.emplace(mapping, *port_, signals, can);
}

bool Bus::end_log() {
    if (!log_) return true;
    log_->finish();
    return log_->error().empty() && log_->lost() == 0;
}

std::uint64_t Bus::messages_lost() const SHIFTRIG_REALTIME {
    if (lcm_) return lcm_->messages_lost();
    const auto counters = port_->counters();
    return counters.send_dropped + counters.receive_dropped + counters.malformed;
}

std::vector<std::string> Bus::warnings() const {
    return can_ ? can_->warnings() : lcm_->warnings();
}

std::vector<std::string> Bus::summary() const {
    std::vector<std::string> lines;
    const auto add = [&](const std::string& message,
                         const std::vector<std::pair<const char*, std::uint64_t>>& counts) {
        std::string text;
        for (const auto& [what, count] : counts)
            if (count > 0) text += (text.empty() ? "" : ", ") + std::to_string(count) + " " + what;
        if (!text.empty()) lines.push_back(name_ + " " + message + ": " + text);
    };
    if (lcm_) {
        for (const auto& r : lcm_->report())
            add(r.channel, {{"lost", r.lost},
                            {"stale", r.stale},
                            {"implausible", r.implausible},
                            {"restarts of the sender", r.restarts}});
        const auto c = lcm_->counters();
        add("as a whole", {{"not sent", c.send_failed + c.send_dropped},
                           {"of another type refused", c.refused},
                           {"received but not read", c.receive_dropped}});
        return lines;
    }
    for (const auto& r : can_->report())
        add(r.name, {{"of wrong length", r.wrong_length},
                     {"with wrong checksum", r.wrong_checksum},
                     {"with wrong counter", r.wrong_counter},
                     {"implausible", r.implausible},
                     {"missed", r.missed},
                     {"time-outs", r.timeouts},
                     {"values limited", r.limited},
                     {"not sent", r.send_dropped}});
    for (const auto& t : can_->troubles())
        add("trouble code SPN " + std::to_string(t.spn) + " FMI " + std::to_string(t.fmi) + " of " + t.node,
            {{t.active ? "times active, the last to the end" : "times active", t.occurrences}});
    const auto c = port_->counters();
    if (name_ != "inprocess") add("as a whole", {{"frames sent", c.sent}, {"received", c.received}});
    add("as a whole", {{"frames not sent", c.send_dropped},
                       {"frames lost in reception", c.receive_dropped},
                       {"malformed", c.malformed},
                       {"error frames", c.error_frames},
                       {"times bus-off", c.bus_off_events},
                       {"reconnects", c.reconnects},
                       {"frames missing in the log, whose writer did not keep up", log_ ? log_->lost() : 0}});
    if (log_ && !log_->error().empty()) lines.push_back(log_->error());
    return lines;
}

}  // namespace shiftrig::bus
