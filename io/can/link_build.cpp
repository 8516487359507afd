// Compiles a mapping into the descriptors that CanLink runs. Everything that can be wrong is said here.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "io/can/link_data.h"
#include "io/can/units.h"
#include "io/input_error.h"

namespace shiftrig::io::can {

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr std::uint32_t kPriorityBits = 0x1C000000, kSourceBits = 0xFF;

std::int64_t to_ns(double ms) {
    return std::llround(ms * 1e6);
}

[[noreturn]] void fail(const Mapping& mapping, int line, int column, const std::string& what) {
    throw InputError(mapping.file, line, column, what);
}

std::string in_unit(plant::Unit unit) {
    const auto symbol = plant::symbol(unit);
    return symbol.empty() ? "a plain number" : std::string(quantity(unit)) + " [" + std::string(symbol) + "]";
}

// "controller.current_gear: … ; did you mean …"
std::string suggestions(const SignalTable& signals, const std::string& name) {
    std::string list;
    for (const auto& near : signals.nearest(name)) list += (list.empty() ? "" : ", ") + near;
    return list.empty() ? "" : "; nearest: " + list;
}

std::vector<Selection> selections(const dbc::Message& layout, const dbc::Signal& signal, bool j1939) {
    std::vector<Selection> chain;
    for (const dbc::Signal* at = &signal; at && !at->multiplexor.empty(); at = layout.find(at->multiplexor))
        chain.push_back({SignalCodec(*layout.find(at->multiplexor), j1939), at->selected_by});
    return chain;
}

// A signal of the link itself; a second link on the same table shares it.
int own_signal(SignalTable& signals, const std::string& name, const std::string& description,
               double initial = 0) {
    const int found = signals.find(name);
    if (found >= 0) return found;
    plant::Signal signal;
    signal.name = name;
    signal.initial = initial;
    signal.description = description;
    return signals.add(signal);
}

// Of a message, as the mapping has it or else the DBC [ms]; 0: it has none.
double cycle_ms(const Mapping& mapping, const dbc::Message& layout, const MessageMap& map) {
    if (map.cycle_ms) return *map.cycle_ms;
    const double cycle = layout.cycle_time_ms();
    if (cycle != 0 && !(cycle >= kShortestPeriodMs && cycle <= kLongestPeriodMs))
        fail(mapping, map.line, map.column,
             "message " + map.name + ": GenMsgCycleTime = " + layout.attributes.at("GenMsgCycleTime") +
                 " in " + mapping.database.file + "; " + within_words(kShortestPeriodMs, kLongestPeriodMs) +
                 ", or be overruled by cycle_ms");
    return cycle;
}

template <class Optional>
double or_else(const Optional& value, double fallback) {
    return value ? *value : fallback;
}

}  // namespace

CanLink::Data::Data(const Mapping& mapping, CanPort& a_port, SignalTable& signals,
                    const LinkOptions& some_options)
    : port(&a_port), options(some_options) {
    for (const auto& map : mapping.messages) {
        const dbc::Message& layout = *mapping.database.find(map.name);
        if (layout.length > (mapping.data_bit_rate > 0 || mapping.is_j1939(layout) ? 64 : 8))
            fail(mapping, map.line, map.column,
                 "message " + map.name + " has " + std::to_string(layout.length) +
                     " bytes; a frame holds 8, with data_bit_rate (CAN FD) or J1939's transport protocol 64");
        const bool sends = mapping.sent_by_rig(layout) == (options.role == Role::rig);
        if (sends)
            build_sent(mapping, layout, map, signals);
        else
            build_received(mapping, layout, map, signals);
    }
    const auto j1939 = [&mapping](const MessageMap& map) {
        return mapping.is_j1939(*mapping.database.find(map.name));
    };
    if (std::any_of(mapping.messages.begin(), mapping.messages.end(), j1939)) {
        network.emplace(mapping, options.role, options.address_claim);
        for (const auto& node : network->nodes())
            address_index.push_back(own_signal(signals, "bus." + node.name + ".address",
                                               "0 waiting, 1 claimed, 2 lost to another controller"));
    }
    settle_duplicates(mapping, signals);
    build_look_up();

    const auto position = [](const auto& messages, const std::string& name) {
        for (std::size_t i = 0; i < messages.size(); ++i)
            if (messages[i].report.name == name) return static_cast<int>(i);
        return -1;
    };
    const bool rig = options.role == Role::rig;
    question = rig ? position(sent, mapping.question) : position(received, mapping.question);
    answer = rig ? position(received, mapping.answer) : position(sent, mapping.answer);
    if (!mapping.question.empty() && (question < 0 || answer < 0))
        fail(mapping, 0, 0,
             "lockstep: the rig must send " + mapping.question + " and the controller " + mapping.answer);

    spread_phases();
    judge_load(mapping);
    valid_index = own_signal(
        signals, "bus.command_valid",
        "1 while the command messages that the controller sends are trusted within their timeouts", 1);
    if (rig) build_troubles(mapping, signals);
}

// ---- one signal --------------------------------------------------------------------------------------------

int CanLink::Data::resolve(const Mapping& mapping, const SignalMap& map, plant::Unit unit, bool receiving,
                           SignalTable& signals) {
    const int found = signals.find(map.signal);
    if (found >= 0) return found;
    // What the controller says about itself is the link's to declare; so is all a controller knows.
    if (options.role == Role::rig && !(receiving && map.signal.starts_with("controller.")))
        fail(mapping, map.line, map.column,
             "there is no signal \"" + map.signal + "\"" + suggestions(signals, map.signal));
    const bool heard = receiving && options.role == Role::controller;
    return signals.add({.name = map.signal,
                        .unit = unit,
                        .initial = heard              ? kNaN
                                   : map.when.empty() ? 0
                                                      : map.otherwise,
                        .description = "from " + map.dbc_signal});
}

Field CanLink::Data::build_field(const Mapping& mapping, const dbc::Message& layout, const SignalMap& map,
                                 bool receiving, SignalTable& signals) {
    const dbc::Signal& signal = *layout.find(map.dbc_signal);
    const std::string label = layout.name + "." + signal.name;
    const bool j1939 = mapping.is_j1939(layout);
    Field field;
    field.codec = SignalCodec(signal, j1939);
    field.use = map.use;
    field.above = map.above;
    field.is = static_cast<std::uint64_t>(map.is);
    field.otherwise_raw = static_cast<std::uint64_t>(map.otherwise_raw);
    field.selected = selections(layout, signal, j1939);
    if (map.use == Use::constant) return field;

    const auto unit = unit_conversion(signal.unit);
    if (!unit) fail(mapping, map.line, map.column, label + ": unit \"" + signal.unit + "\" is not known");
    // The unit that the table's signal must have so that it becomes the DBC's.
    plant::Unit wanted = unit->unit;
    if (map.use == Use::travelled) {
        if (wanted != plant::Unit::metre)
            fail(mapping, map.line, map.column,
                 label + ": a distance travelled is a length, not " + in_unit(wanted));
        wanted = plant::Unit::metre_per_second;
    }
    if (map.times) {
        if (wanted != plant::Unit::metre_per_second || map.times->unit != plant::Unit::metre)
            fail(mapping, map.line, map.column,
                 label + ": `times` turns an angular speed by a radius [m] into a speed");
        wanted = plant::Unit::radian_per_second;
    }
    if (map.per) {
        if (wanted != plant::Unit::one)
            fail(mapping, map.line, map.column,
                 label + ": with `per` the DBC signal is a plain number, not " + in_unit(wanted));
        wanted = map.per->unit;
    }
    field.index = resolve(mapping, map, wanted, receiving, signals);
    const plant::Unit actual = signals.signal(field.index).unit;
    const bool any_unit = map.use == Use::direction || map.use == Use::flag;
    if (actual != wanted && !any_unit)
        fail(mapping, map.line, map.column,
             label + " in \"" + signal.unit + "\" wants " + in_unit(wanted) + ", but " + map.signal + " is " +
                 in_unit(actual));
    const double scale = or_else(map.per ? std::optional(map.per->value) : std::nullopt, 1) /
                         or_else(map.times ? std::optional(map.times->value) : std::nullopt, 1);
    field.gain = unit->factor * scale;
    field.bias = unit->offset * scale;
    if (map.use == Use::complement) {  // x/per = 1 − bus value
        field.gain = -field.gain;
        field.bias = scale - field.bias;
    }

    if (map.plausible)
        std::tie(field.lowest, field.highest) = *map.plausible;
    else if (signal.minimum != 0 || signal.maximum != 0)
        std::tie(field.lowest, field.highest) = std::pair(signal.minimum, signal.maximum);
    const double grain = 0.5 * std::abs(signal.factor);  // limits in DBC files are often rounded
    field.lowest -= grain;
    field.highest += grain;
    if (!map.enable.empty()) field.enable = SignalCodec(*layout.find(map.enable), false);
    field.disabled = map.disabled;
    if (!map.when.empty()) field.when = SignalCodec(*layout.find(map.when), false);
    for (const auto raw : map.when_is) field.when_is.push_back(static_cast<std::uint64_t>(raw));
    field.otherwise = map.otherwise;
    field.absent = options.role == Role::controller ? kNaN : signals.signal(field.index).initial;
    return field;
}

// ---- messages ------------------------------------------------------------------------------------------------

namespace {

std::optional<CounterField> counter_field(const dbc::Message& layout, const MessageMap& map) {
    if (map.counter.empty()) return std::nullopt;
    return CounterField{SignalCodec(*layout.find(map.counter), false), map.counter_modulo,
                        map.counter_max_step};
}

std::optional<ChecksumField> checksum_field(const dbc::Message& layout, const MessageMap& map) {
    if (map.checksum.empty()) return std::nullopt;
    ChecksumField field{SignalCodec(*layout.find(map.checksum), false), map.formula, std::nullopt};
    if (!map.counter.empty()) field.counter = SignalCodec(*layout.find(map.counter), false);
    return field;
}

}  // namespace

void CanLink::Data::build_received(const Mapping& mapping, const dbc::Message& layout, const MessageMap& map,
                                   SignalTable& signals) {
    ReceivedMessage message;
    message.report.name = layout.name;
    message.extended = layout.extended;
    message.mask = layout.extended ? 0x1FFFFFFF : 0x7FF;
    if (mapping.is_j1939(layout)) {
        if (!map.pin_priority) message.mask &= ~kPriorityBits;
        if (!map.pin_source) message.mask &= ~kSourceBits;
        message.to_everyone = is_pdu1(layout.id);
    }
    message.id = layout.id & message.mask;
    message.length = static_cast<std::uint8_t>(layout.length);
    message.command = map.command;
    message.hold = map.hold_when_lost.value_or(map.command);
    const double cycle = cycle_ms(mapping, layout, map);
    message.timeout_ns = to_ns(or_else(map.timeout_ms, 5 * cycle));
    message.late_ns = to_ns(1.5 * cycle);
    if (map.command && message.timeout_ns == 0)
        fail(mapping, map.line, map.column, "message " + map.name + " is a command and needs a timeout_ms");
    message.counter = counter_field(layout, map);
    message.checksum = checksum_field(layout, map);
    for (const auto& entry : map.signals) {
        const bool no_way_back =
            entry.use == Use::constant || entry.use == Use::direction || entry.use == Use::travelled;
        if (!no_way_back) message.fields.push_back(build_field(mapping, layout, entry, true, signals));
    }
    message.status_index = own_signal(signals, "bus." + layout.name + ".status",
                                      "0 never seen, 1 alive, 2 late, 3 lost, 4 corrupt");
    received.push_back(std::move(message));
}

void CanLink::Data::build_sent(const Mapping& mapping, const dbc::Message& layout, const MessageMap& map,
                               SignalTable& signals) {
    SentMessage message;
    message.report.name = layout.name;
    message.report.sent_by_us = true;
    message.frame.id = layout.id;
    message.frame.extended = layout.extended;
    message.frame.fd = mapping.data_bit_rate > 0 && layout.length > 8;
    message.frame.bit_rate_switch = message.frame.fd;
    message.frame.length = message.frame.fd ? fd_length(static_cast<unsigned>(layout.length))
                                            : static_cast<std::uint8_t>(layout.length);
    if (mapping.is_j1939(layout)) message.frame.data.fill(0xFF);
    message.by_transport = layout.length > 8 && !message.frame.fd;
    if (message.by_transport) message.frame.length = static_cast<std::uint8_t>(layout.length);
    message.cycle_ns = to_ns(cycle_ms(mapping, layout, map));
    message.phase_ns = map.phase_ms ? to_ns(*map.phase_ms) : -1;
    if (message.cycle_ns == 0)
        warnings.push_back(mapping.file + ":" + std::to_string(map.line) + ": message " + map.name +
                           " has no cycle time and is sent on request only");
    message.counter = counter_field(layout, map);
    message.checksum = checksum_field(layout, map);
    for (const auto& entry : map.signals) {
        Field field = build_field(mapping, layout, entry, false, signals);
        // An enable bit goes out set: what we send is meant.
        if (!entry.enable.empty()) field.enable->put(message.frame.data.data(), 1);
        if (field.selected.size() > 1)
            fail(mapping, entry.line, entry.column,
                 layout.name + "." + entry.dbc_signal +
                     ": sending a multiplexor within a multiplexor is not supported");
        for (const auto& selection : field.selected) {
            message.multiplexor = selection.multiplexor;
            message.multiplexor_values.push_back(selection.values.front().first);
        }
        if (entry.use == Use::constant) {
            bool limited = false;
            field.codec.put(message.frame.data.data(), field.codec.from_physical(entry.constant, limited));
            if (limited)
                fail(mapping, entry.line, entry.column,
                     layout.name + "." + entry.dbc_signal + ": the constant does not fit");
        } else {
            message.fields.push_back(std::move(field));
        }
    }
    auto& values = message.multiplexor_values;
    std::sort(values.begin(), values.end());
    values.erase(std::unique(values.begin(), values.end()), values.end());
    sent.push_back(std::move(message));
}

// Two messages may not write one signal of the rig. A controller may hear a quantity twice (EEC1 and the signed
// shaft speeds): it keeps the first that says the value itself, sign included.
void CanLink::Data::settle_duplicates(const Mapping& mapping, const SignalTable& signals) {
    std::vector<Field*> source(static_cast<std::size_t>(signals.size()), nullptr);
    for (const Use preferred : {Use::value, Use::magnitude})
        for (auto& message : received)
            for (auto& field : message.fields) {
                Field*& owner = source[static_cast<std::size_t>(field.index)];
                const bool plain = field.use == Use::value;
                if ((preferred == Use::value) != plain) continue;
                if (!owner)
                    owner = &field;
                else if (options.role == Role::rig && field.selected.empty())
                    fail(mapping, 0, 0,
                         "signal " + signals.signal(field.index).name + " is written by " +
                             message.report.name + " and by another message");
            }
    if (options.role == Role::rig) return;
    for (auto& message : received)
        std::erase_if(message.fields, [&](const Field& field) {
            return source[static_cast<std::size_t>(field.index)]->use != field.use;
        });
}

void CanLink::Data::build_look_up() {
    for (std::size_t i = 0; i < received.size(); ++i) {
        const auto& message = received[i];
        const bool whole = !message.extended || message.mask == 0x1FFFFFFF;
        look_up.push_back({whole ? exact_key(message.id, message.extended) : pgn_key(message.id), i});
    }
    std::stable_sort(look_up.begin(), look_up.end(),
                     [](const auto& a, const auto& b) { return a.key < b.key; });
}

// Transmission times within the cycles so that as few frames as possible fall into the same tick. Short cycles
// first, each at the phase whose busiest tick is least busy.
void CanLink::Data::spread_phases() {
    constexpr std::int64_t kLongest = 10'000;  // ticks looked at
    std::vector<SentMessage*> order;
    std::int64_t horizon = 1;
    const auto ticks = [this](std::int64_t ns) { return std::max<std::int64_t>(1, ns / options.tick_ns); };
    for (auto& message : sent) {
        if (message.cycle_ns == 0) continue;
        order.push_back(&message);
        horizon = std::min(kLongest, std::lcm(horizon, ticks(message.cycle_ns)));
    }
    std::stable_sort(order.begin(), order.end(), [](auto* a, auto* b) { return a->cycle_ns < b->cycle_ns; });
    std::vector<int> frames(static_cast<std::size_t>(horizon), 0);
    // The question of lockstep comes at the end of its cycle, when everything else has been told.
    if (options.role == Role::rig && question >= 0) {
        auto& asking = sent[static_cast<std::size_t>(question)];
        if (asking.phase_ns < 0 && asking.cycle_ns > 0)
            asking.phase_ns = (ticks(asking.cycle_ns) - 1) * options.tick_ns;
    }
    for (auto* message : order) {
        const std::int64_t cycle = ticks(message->cycle_ns);
        std::int64_t best = 0;
        if (message->phase_ns >= 0) {
            best = message->phase_ns / options.tick_ns % cycle;
        } else {
            std::pair<int, int> least{INT32_MAX, INT32_MAX};  // busiest tick, frames in all of them
            for (std::int64_t phase = 0; phase < std::min(cycle, horizon); ++phase) {
                std::pair<int, int> now{0, 0};
                for (std::int64_t t = phase; t < horizon; t += cycle) {
                    now.first = std::max(now.first, frames[static_cast<std::size_t>(t)]);
                    now.second += frames[static_cast<std::size_t>(t)];
                }
                if (now < least) least = now, best = phase;
            }
            message->phase_ns = best * options.tick_ns;
        }
        for (std::int64_t t = best; t < horizon; t += cycle) ++frames[static_cast<std::size_t>(t)];
    }
}

// After everything else: a condition may look at the link's own signals.
void CanLink::Data::build_troubles(const Mapping& mapping, const SignalTable& signals) {
    const auto nodes = network ? network->nodes() : std::vector<j1939::Network::Node>{};
    for (const TroubleMap& map : mapping.troubles) {
        const std::string label =
            "trouble code SPN " + std::to_string(map.spn) + " FMI " + std::to_string(map.fmi);
        const auto owner = std::find_if(nodes.begin(), nodes.end(),
                                        [&map](const auto& node) { return node.name == map.node; });
        if (owner == nodes.end())
            fail(mapping, map.line, map.column,
                 label + ": " + map.node + " sends no J1939 message, so it has no address");
        const int code =
            network->troubles.add(map.spn, static_cast<std::uint8_t>(map.fmi), owner->address, map.lamp);
        if (code < 0)
            fail(mapping, map.line, map.column,
                 label + ": " + map.node + " has more than the " +
                     std::to_string(j1939::TroubleCodes::kMostOfANode) + " that its DM1 can hold");
        for (const TroubleCondition& any : map.any_of) {
            Condition condition;
            condition.code = code;
            condition.after_ns = to_ns(map.after_ms);
            condition.index = signals.find(any.signal);
            if (condition.index < 0)
                fail(
                    mapping, any.line, any.column,
                    label + ": there is no signal \"" + any.signal + "\"" + suggestions(signals, any.signal));
            const plant::Unit unit = signals.signal(condition.index).unit;
            if (!any.above && !any.below) condition.above = 0.5;
            const auto limit = [&](const std::optional<Quantity>& quantity, double& value) {
                if (quantity) value = quantity->value;
                if ((quantity ? quantity->unit : plant::Unit::one) != unit)
                    fail(mapping, any.line, any.column,
                         label + ": " + any.signal + " is " + in_unit(unit) + ", its limit is " +
                             in_unit(quantity ? quantity->unit : plant::Unit::one));
            };
            if (any.above || !any.below) limit(any.above, condition.above);
            if (any.below) limit(any.below, condition.below);
            conditions.push_back(condition);
        }
    }
}

void CanLink::Data::judge_load(const Mapping& mapping) {
    for (const auto& map : mapping.messages) {
        const dbc::Message& layout = *mapping.database.find(map.name);
        const double cycle = cycle_ms(mapping, layout, map);
        if (cycle <= 0) continue;
        double seconds =
            worst_case_classic_bits(layout.extended, std::min(layout.length, 8)) / mapping.bit_rate;
        if (layout.length > 8 && mapping.data_bit_rate <= 0)
            seconds *= 1 + (layout.length + 6) / 7;  // announcement and packets
        if (layout.length > 8 && mapping.data_bit_rate > 0) {
            Frame frame;
            frame.extended = layout.extended;
            frame.fd = frame.bit_rate_switch = true;
            frame.length = fd_length(static_cast<unsigned>(layout.length));
            seconds = 1e-9 * static_cast<double>(duration_ns(frame, mapping.bit_rate, mapping.data_bit_rate));
        }
        load += seconds / (1e-3 * cycle);
    }
    // DM1 once a second of every node that may have troubles.
    std::vector<std::string> tellers;
    for (const auto& map : mapping.troubles)
        if (std::find(tellers.begin(), tellers.end(), map.node) == tellers.end()) tellers.push_back(map.node);
    load += static_cast<double>(tellers.size()) * worst_case_classic_bits(true, 8) / mapping.bit_rate;
    if (load > 1)
        warnings.push_back(mapping.file + ": these messages would load a bus of " +
                           std::to_string(std::lround(mapping.bit_rate / 1000)) + " kbit/s to " +
                           std::to_string(std::lround(100 * load)) +
                           " %: frames will come late or not at all");
}

}  // namespace shiftrig::io::can
