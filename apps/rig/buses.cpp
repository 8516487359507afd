#include "apps/rig/buses.h"

#include <algorithm>
#include <stdexcept>

#include "io/yaml_document.h"
#include "rt/clock.h"

namespace shiftrig::rig {

namespace {

// Faults that no bus carries would be read by nobody: who wrote them waits for them in vain.
void require_a_carrier(const BusSetup& setup, const io::ModelFile& model) {
    const auto is_can = [](const std::string& name) { return !name.starts_with("lcm:"); };
    if (!model.can.IsDefined())
        io::fail(setup.faults_file, setup.faults.Mark(),
                 "bus_faults: " + model.path + " has no stanza `can:`, and so no bus that they could act on");
    if (std::none_of(setup.names.begin(), setup.names.end(), is_can))
        io::fail(
            setup.faults_file, setup.faults.Mark(),
            "bus_faults: there is no CAN bus that they could act on; one of the buses must be inprocess, "
            "can:INTERFACE or udpcan:GROUP:PORT");
}

}  // namespace

Buses::Buses(const BusSetup& setup, const io::ModelFile& model, std::int64_t tick_ns,
             io::SignalTable& signals)
    : silences_(setup.silences) {
    if (model.can.IsDefined()) mapping_ = io::can::parse_mapping(model.can, model.path);
    bus::Options options;
    options.tick_ns = tick_ns;
    options.lockstep = setup.lockstep;
    options.model_name = model.description.name;
    options.command_timeout = model.controller.command_timeout;

    if (!setup.faults.IsNull()) {
        require_a_carrier(setup, model);
        faults_ = io::can::parse_faults(setup.faults, setup.faults_file, *mapping_, setup.seed);
        options.can_faults = &*faults_;
        for (std::size_t i = 0; i < faults_->faults.size(); ++i) {
            plant::Signal status;
            status.name = "bus.fault." + std::to_string(i + 1) + ".status";
            status.description = describe(faults_->faults[i]);
            fault_signals_.push_back(signals.add(status));
        }
    }
    options.can_log = setup.can_log;
    options.can_replay = setup.can_replay;

    for (const auto& name : setup.names) {
        const bool frames = !name.starts_with("lcm:");
        if (frames && !mapping_)
            throw io::InputError(model.path, 0, 0,
                                 "bus " + name + " needs the stanza `can:`, which says what the frames mean");
        if (name != "inprocess") {
            buses_.emplace_back(name, mapping_ ? &*mapping_ : nullptr, signals, options);
        } else {
            if (wire_) throw std::invalid_argument("bus inprocess can be given only once");
            io::can::InProcessOptions timing;
            if (faults_) timing.bit_rate = faults_->bit_rate;
            wire_ = std::make_unique<io::can::InProcessBus>(2, timing);
            buses_.emplace_back(name, wire_->end(0), *mapping_, signals, options);
            if (setup.built_in)
                node_ = std::make_unique<tcu::Node>(*setup.built_in, "inprocess", wire_->end(1), *mapping_);
        }
        if (frames) options.can_log = options.can_replay = "";  // of the first CAN bus only
    }
    if (!options.can_log.empty() || !options.can_replay.empty())
        throw std::invalid_argument("a CAN log needs a CAN bus");
}

void Buses::receive(std::int64_t now_ns, io::SignalTable& signals) SHIFTRIG_REALTIME {
    for (auto& each : buses_) {
        each.receive(now_ns, signals);
        for (io::can::FaultEvent event; each.next_fault(event);)
            signals.value[static_cast<std::size_t>(fault_signals_[static_cast<std::size_t>(event.fault)])] =
                event.begins ? 1 : 0;
    }
}

void Buses::send(std::int64_t now_ns, const io::SignalTable& signals) SHIFTRIG_REALTIME {
    for (auto& each : buses_) each.send(now_ns, signals);
    if (!node_) return;
    const bool silent = silent_at(now_ns);
    if (silent_ && !silent) node_->restart();
    silent_ = silent;
    if (!silent) node_->tick(now_ns);
}

bool Buses::silent_at(std::int64_t now_ns) const SHIFTRIG_REALTIME {
    for (const auto& silence : silences_)
        if (silence.from_ns <= now_ns && now_ns < silence.until_ns) return true;
    return false;
}

bool Buses::command_valid() const noexcept {
    if (buses_.empty()) return true;
    for (const auto& each : buses_)
        if (each.command_valid()) return true;
    return false;
}

bool Buses::wait_for_answer(std::int64_t now_ns, io::SignalTable& signals, std::int64_t timeout_ns) {
    const rt::SteadyClock clock;
    const std::int64_t until = clock.now() + timeout_ns;
    for (auto& each : buses_) {
        while (each.awaiting_answer()) {
            each.receive(now_ns, signals);
            if (!each.awaiting_answer()) break;
            const std::int64_t left = until - clock.now();
            if (left <= 0 || !each.wait(left)) return false;
        }
    }
    return true;
}

bool Buses::next_command_latency(std::int64_t& latency_ns) SHIFTRIG_REALTIME {
    for (auto& each : buses_)
        if (each.next_command_latency(latency_ns)) return true;
    return false;
}

bool Buses::end_logs() {
    bool whole = true;
    for (auto& each : buses_) whole = each.end_log() && whole;
    return whole;
}

std::uint64_t Buses::messages_lost() const SHIFTRIG_REALTIME {
    std::uint64_t lost = 0;
    for (const auto& each : buses_) lost += each.messages_lost();
    return lost;
}

namespace {

void append(std::vector<std::string>& all, const std::vector<std::string>& more) {
    all.insert(all.end(), more.begin(), more.end());
}

}  // namespace

std::vector<std::string> Buses::warnings() const {
    std::vector<std::string> all;
    for (const auto& each : buses_) append(all, each.warnings());
    return all;
}

std::vector<std::string> Buses::summary() const {
    std::vector<std::string> all;
    for (const auto& each : buses_) append(all, each.summary());
    return all;
}

}  // namespace shiftrig::rig
