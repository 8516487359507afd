#include "io/can/link.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "io/can/link_data.h"

namespace shiftrig::io::can {

namespace {

constexpr int kMostBatches = 64;  // of 64 frames a tick: a flood must not hold up the loop

// CRC-8 of SAE J1850: polynomial 0x1D, start and final XOR 0xFF.
unsigned crc8_j1850(const std::uint8_t* data, int length) SHIFTRIG_REALTIME {
    unsigned crc = 0xFF;
    for (int i = 0; i < length; ++i) {
        crc ^= data[i];
        for (int bit = 0; bit < 8; ++bit) crc = (crc & 0x80U) ? ((crc << 1) ^ 0x1DU) & 0xFFU : crc << 1;
    }
    return crc ^ 0xFFU;
}

}  // namespace

// ---- matching ------------------------------------------------------------------------------------------------

std::uint32_t pgn_of(std::uint32_t id) SHIFTRIG_REALTIME {
    return is_pdu1(id) ? (id >> 8) & 0x3FF00U : (id >> 8) & 0x3FFFFU;
}
std::uint64_t exact_key(std::uint32_t id, bool extended) SHIFTRIG_REALTIME {
    return (std::uint64_t{extended ? 1U : 0U} << 32) | id;
}
std::uint64_t pgn_key(std::uint32_t id) SHIFTRIG_REALTIME {
    return (std::uint64_t{2} << 32) | pgn_of(id);
}

ReceivedMessage* CanLink::Data::match(const Frame& frame) SHIFTRIG_REALTIME {
    if (frame.remote || frame.error) return nullptr;
    const std::uint64_t keys[] = {exact_key(frame.id, frame.extended), pgn_key(frame.id)};
    for (int kind = 0; kind < (frame.extended ? 2 : 1); ++kind) {
        auto at = std::lower_bound(look_up.begin(), look_up.end(), keys[kind],
                                   [](const LookUp& entry, std::uint64_t key) { return entry.key < key; });
        for (; at != look_up.end() && at->key == keys[kind]; ++at) {
            ReceivedMessage& message = received[at->message];
            const bool to_everyone = message.to_everyone && ((frame.id >> 8) & 0xFFU) == 0xFFU;
            const std::uint32_t ignored = to_everyone ? 0xFF00U : 0U;
            if (((frame.id ^ message.id) & message.mask & ~ignored) == 0) return &message;
        }
    }
    return nullptr;
}

// ---- trust ---------------------------------------------------------------------------------------------------

unsigned ChecksumField::compute(const Frame& frame) const SHIFTRIG_REALTIME {
    if (formula == ChecksumFormula::tsc1)
        return tsc1_checksum(frame.id, frame.data.data(),
                             static_cast<unsigned>(counter->raw(frame.data.data())));
    Frame without = frame;  // the others run over the whole frame, the checksum itself taken as 0
    codec.put(without.data.data(), 0);
    if (formula == ChecksumFormula::crc8_j1850) return crc8_j1850(without.data.data(), frame.length);
    unsigned sum = 0;
    for (std::size_t i = 0; i < frame.length; ++i)
        sum = formula == ChecksumFormula::xor8 ? sum ^ without.data[i] : sum + without.data[i];
    return sum & 0xFFU;
}

bool CanLink::Data::trusted(ReceivedMessage& message, const Frame& frame) SHIFTRIG_REALTIME {
    if (frame.length < message.length) {
        ++message.report.wrong_length;
        return false;
    }
    const std::uint8_t* data = frame.data.data();
    if (message.checksum && message.checksum->codec.raw(data) !=
                                (message.checksum->compute(frame) & message.checksum->codec.mask())) {
        ++message.report.wrong_checksum;
        return false;
    }
    if (message.counter) {
        const unsigned modulo = message.counter->modulo;
        const auto counter = static_cast<unsigned>(message.counter->codec.raw(data) % modulo);
        const unsigned step = (counter + modulo - message.last_counter) % modulo;
        const bool known = message.counting;
        message.counting = true;
        message.last_counter = counter;
        if (known && (step == 0 || step > message.counter->max_step)) {
            ++message.report.wrong_counter;
            return false;
        }
        if (known) message.report.missed += step - 1;
    }
    if (!plausible(message, frame)) {
        ++message.report.implausible;
        return false;
    }
    return true;
}

bool CanLink::Data::plausible(const ReceivedMessage& message, const Frame& frame) const SHIFTRIG_REALTIME {
    const std::uint8_t* data = frame.data.data();
    for (const Field& field : message.fields) {
        if (field.use == Use::one_of) continue;
        if (field.enable && field.enable->raw(data) == 0) continue;
        if (!field.is_meant(data)) continue;
        const auto holds = [data](const Selection& s) { return s.holds(data); };
        if (!std::all_of(field.selected.begin(), field.selected.end(), holds)) continue;
        const std::uint64_t raw = field.codec.raw(data);
        if (field.codec.validity(raw) != Validity::valid) {
            if (message.command) return false;  // a command that says it is none
            continue;
        }
        const double physical = field.codec.physical(raw);
        if (!(physical >= field.lowest && physical <= field.highest)) return false;
    }
    return true;
}

// ---- receiving -----------------------------------------------------------------------------------------------

void CanLink::Data::decode(const ReceivedMessage& message, const Frame& frame,
                           SignalTable& signals) const SHIFTRIG_REALTIME {
    const std::uint8_t* data = frame.data.data();
    for (const Field& field : message.fields) {
        const auto holds = [data](const Selection& s) { return s.holds(data); };
        if (!std::all_of(field.selected.begin(), field.selected.end(), holds)) continue;
        double& value = signals.value[static_cast<std::size_t>(field.index)];
        const std::uint64_t raw = field.codec.raw(data);
        if (field.use == Use::one_of) {
            value = raw == field.is ? 1 : 0;
        } else if (field.enable && field.enable->raw(data) == 0) {
            value = field.disabled;
        } else if (!field.is_meant(data)) {
            value = field.otherwise;
        } else if (field.codec.validity(raw) != Validity::valid) {
            value = field.absent;
        } else {
            value = field.codec.physical(raw) * field.gain + field.bias;
        }
    }
}

void CanLink::Data::take(const Frame& frame, std::int64_t now_ns, SignalTable& signals) SHIFTRIG_REALTIME {
    ReceivedMessage* message = match(frame);
    if (!message) return;
    // After silence a sender may count from anywhere; one that never fell silent may not.
    if (message->timeout_ns > 0 && now_ns - message->heard_ns > message->timeout_ns)
        message->counting = false;
    message->heard_ns = now_ns;
    if (!trusted(*message, frame)) {
        message->bad_ns = now_ns;
        message->seen_bad = message->last_was_bad = true;
        return;
    }
    ++message->report.good;
    message->good_ns = now_ns;
    message->seen_good = true;
    message->last_was_bad = false;
    decode(*message, frame, signals);
    if (message->command && command_arrived_ns == 0) command_arrived_ns = frame.timestamp_ns;

    const int index = static_cast<int>(message - received.data());
    if (options.role == Role::rig && index == answer && awaiting && message->last_counter == question_counter)
        awaiting = false;
    if (options.role == Role::controller && index == question) {
        pending = asked_before = true;
        question_counter = message->last_counter;
        question_ns = now_ns;
    }
}

void CanLink::Data::supervise(std::int64_t now_ns, SignalTable& signals) SHIFTRIG_REALTIME {
    for (ReceivedMessage& message : received) {
        const bool supervised = message.timeout_ns > 0;
        const std::int64_t since = message.seen_good ? message.good_ns : receive_start_ns;
        const bool overdue = supervised && now_ns - since > message.timeout_ns;
        const bool bad_lately =
            message.last_was_bad && (!supervised || now_ns - message.bad_ns <= message.timeout_ns);
        MessageStatus status = MessageStatus::alive;
        if (bad_lately)
            status = MessageStatus::corrupt;
        else if (!message.seen_good)
            status = message.seen_bad ? MessageStatus::lost : MessageStatus::never_seen;
        else if (overdue)
            status = MessageStatus::lost;
        else if (message.late_ns > 0 && now_ns - since > message.late_ns)
            status = MessageStatus::late;

        if (overdue && message.seen_good && !message.was_overdue) {
            ++message.report.timeouts;
            if (!message.hold)
                for (const Field& field : message.fields)
                    signals.value[static_cast<std::size_t>(field.index)] = field.absent;
        }
        message.was_overdue = overdue;
        message.report.status = status;
        signals.value[static_cast<std::size_t>(message.status_index)] = static_cast<double>(status);
    }
    valid = judge_commands(now_ns, signals);
    signals.value[static_cast<std::size_t>(valid_index)] = valid ? 1 : 0;
}

// A controller may send every command message of the mapping or only some of them; one frame made by hand is a controller
// too. Those heard since all were silent are expected from then on, and valid means that none of them is overdue.
// After silence the first cycle and a half tells which they are, unless all have come before: until then the
// old values of a message that is about to arrive must not act. Those of one that does not arrive are forgotten.
bool CanLink::Data::judge_commands(std::int64_t now_ns, SignalTable& signals) SHIFTRIG_REALTIME {
    bool any = false, some_heard = false, all_heard = true, overdue = false, in_grace = false;
    std::int64_t gathering_ns = 0;
    for (ReceivedMessage& message : received) {
        if (!message.command) continue;
        any = true;
        const bool heard =
            (message.seen_good || message.seen_bad) && now_ns - message.heard_ns <= message.timeout_ns;
        message.expected = message.expected || heard;
        some_heard = some_heard || heard;
        all_heard = all_heard && message.expected;
        overdue = overdue || (message.expected && message.was_overdue);
        in_grace = in_grace || now_ns - receive_start_ns <= message.timeout_ns;
        gathering_ns = std::max(gathering_ns, message.late_ns);
    }
    if (!any) return true;
    if (!some_heard) {
        for (ReceivedMessage& message : received) message.expected = false;
        hearing_commands = commands_gathered = false;
        return in_grace;
    }
    if (!hearing_commands) commands_began_ns = now_ns;
    hearing_commands = true;
    if (!commands_gathered && (all_heard || now_ns - commands_began_ns >= gathering_ns)) {
        commands_gathered = true;
        for (const ReceivedMessage& message : received)
            if (message.command && !message.expected && message.seen_good)
                for (const Field& field : message.fields)
                    signals.value[static_cast<std::size_t>(field.index)] = field.absent;
    }
    return (commands_gathered || in_grace) && !overdue;
}

// What came in several frames, and what somebody asks us to send.
void CanLink::Data::hear_network(std::int64_t now_ns, SignalTable& signals) SHIFTRIG_REALTIME {
    j1939::LongMessage message;
    while (network->transport.next(message)) {
        Frame whole;
        if (message.length > whole.data.size()) continue;
        whole.extended = true;
        whole.id = (6U << 26) | (message.pgn << 8) | message.source;
        if (is_pdu1(whole.id)) whole.id |= std::uint32_t{message.destination} << 8;
        whole.length = static_cast<std::uint8_t>(message.length);
        std::copy_n(message.data.begin(), message.length, whole.data.begin());
        take(whole, now_ns, signals);
    }
    std::uint32_t pgn = 0;
    std::uint8_t address = 0;
    while (network->requested(pgn, address))
        for (auto& candidate : sent)
            if (candidate.frame.extended && pgn_of(candidate.frame.id) == pgn &&
                (candidate.frame.id & 0xFFU) == address)
                candidate.requested = true;
    for (std::size_t i = 0; i < address_index.size(); ++i) {
        const auto claim = network->nodes()[i].claim;
        signals.value[static_cast<std::size_t>(address_index[i])] = claim == j1939::Claim::claimed ? 1
                                                                    : claim == j1939::Claim::lost  ? 2
                                                                                                   : 0;
    }
}

void CanLink::receive(std::int64_t now_ns, SignalTable& signals) SHIFTRIG_REALTIME {
    Data& d = *data_;
    if (!d.started_receiving) {
        d.started_receiving = true;
        d.receive_start_ns = now_ns;
    }
    for (int batch = 0; batch < kMostBatches; ++batch) {
        const std::size_t count = d.port->receive(now_ns, d.buffer);
        for (std::size_t i = 0; i < count; ++i) {
            if (d.network) d.network->take(d.buffer[i], now_ns, *d.port);
            d.take(d.buffer[i], now_ns, signals);
        }
        if (count < d.buffer.size()) break;
    }
    if (d.network) d.hear_network(now_ns, signals);
    d.supervise(now_ns, signals);
}

// ---- sending -------------------------------------------------------------------------------------------------

void CanLink::Data::encode(SentMessage& message, const SignalTable& signals) SHIFTRIG_REALTIME {
    std::uint8_t* data = message.frame.data.data();
    if (message.multiplexor) {
        message.multiplexor->put(data, message.multiplexor_values[message.turn]);
        message.turn = (message.turn + 1) % message.multiplexor_values.size();
    }
    for (Field& field : message.fields) {
        const auto holds = [data](const Selection& s) { return s.holds(data); };
        if (!std::all_of(field.selected.begin(), field.selected.end(), holds)) continue;
        const double value = signals.value[static_cast<std::size_t>(field.index)];
        if (field.use == Use::one_of) {
            field.codec.put(data, value > 0.5 ? field.is : field.otherwise_raw);
            continue;
        }
        double physical = (value - field.bias) / field.gain;
        switch (field.use) {
            case Use::magnitude:
                physical = std::fabs(physical);
                break;
            case Use::direction:
                physical = value >= 0 ? 1 : 0;
                break;
            case Use::flag:
                physical = value > field.above ? 1 : 0;
                break;
            case Use::travelled:
                physical = field.travelled / field.gain;
                break;
            default:
                break;
        }
        bool limited = false;
        field.codec.put(data, field.codec.from_physical(physical, limited));
        if (limited) ++message.report.limited;
    }
    if (message.counter) message.counter->codec.put(data, message.next_counter);
    if (message.checksum) message.checksum->codec.put(data, message.checksum->compute(message.frame));
}

bool CanLink::Data::put_on_bus(SentMessage& message, std::int64_t now_ns) SHIFTRIG_REALTIME {
    if (!message.by_transport) {
        message.frame.answers_ns = command_arrived_ns;
        if (!port->send(now_ns, message.frame)) return false;
        command_arrived_ns = 0;
        return true;
    }
    if (!network) return false;
    j1939::LongMessage whole;
    whole.pgn = pgn_of(message.frame.id);
    whole.source = static_cast<std::uint8_t>(message.frame.id);
    whole.length = message.frame.length;
    std::copy_n(message.frame.data.begin(), message.frame.length, whole.data.begin());
    return network->transport.send(whole);
}

void CanLink::Data::transmit(SentMessage& message, std::int64_t now_ns,
                             const SignalTable& signals) SHIFTRIG_REALTIME {
    const int index = static_cast<int>(&message - sent.data());
    const bool answering = options.role == Role::controller && index == answer && asked_before;
    if (answering && pending) message.next_counter = question_counter;  // the answer echoes the question
    encode(message, signals);
    if (put_on_bus(message, now_ns))
        ++message.report.good;
    else
        ++message.report.send_dropped;
    if (options.role == Role::rig && index == question) {
        awaiting = true;
        question_counter = message.next_counter;
    }
    if (answering) pending = false;
    if (message.counter) message.next_counter = (message.next_counter + 1) % message.counter->modulo;
}

bool CanLink::Data::due(SentMessage& message, std::int64_t now_ns) SHIFTRIG_REALTIME {
    if (network && message.frame.extended && !network->may_send(static_cast<std::uint8_t>(message.frame.id)))
        return false;
    if (message.requested) {
        message.requested = false;
        return true;
    }
    if (message.cycle_ns == 0) return false;
    const int index = static_cast<int>(&message - sent.data());
    if (options.role == Role::controller && index == answer && asked_before) {
        // An answer waits for its question, but not for ever: without questions it keeps its own time.
        const bool silent = now_ns - question_ns > 3 * message.cycle_ns;
        if (!silent) {
            message.due_ns = now_ns + message.cycle_ns;
            return pending;
        }
    }
    if (now_ns < message.due_ns) return false;
    // A late tick does not shift the schedule; cycles that passed altogether are not made up for.
    const std::int64_t passed = (now_ns - message.due_ns) / message.cycle_ns;
    message.due_ns += (passed + 1) * message.cycle_ns;
    return true;
}

// A code is active while one of its conditions is fulfilled; those of one code stand together.
void CanLink::Data::find_troubles(std::int64_t now_ns, const SignalTable& signals) SHIFTRIG_REALTIME {
    for (std::size_t i = 0; i < conditions.size();) {
        const int code = conditions[i].code;
        bool active = false;
        for (; i < conditions.size() && conditions[i].code == code; ++i) {
            Condition& condition = conditions[i];
            const double value = signals.value[static_cast<std::size_t>(condition.index)];
            const bool holds = value > condition.above && value < condition.below;
            if (holds && !condition.holds) condition.since_ns = now_ns;
            condition.holds = holds;
            active = active || (holds && now_ns - condition.since_ns >= condition.after_ns);
        }
        network->troubles.set(code, active);
    }
}

void CanLink::send(std::int64_t now_ns, const SignalTable& signals) SHIFTRIG_REALTIME {
    Data& d = *data_;
    if (!d.started_sending) {
        d.started_sending = true;
        d.last_send_ns = now_ns;
        for (auto& message : d.sent) message.due_ns = now_ns + std::max<std::int64_t>(0, message.phase_ns);
    }
    const double elapsed = 1e-9 * static_cast<double>(now_ns - d.last_send_ns);
    d.last_send_ns = now_ns;
    for (auto& message : d.sent)
        for (auto& field : message.fields)
            if (field.use == Use::travelled)
                field.travelled += elapsed * std::fabs(signals.value[static_cast<std::size_t>(field.index)]);

    if (d.network) {
        d.find_troubles(now_ns, signals);
        d.network->tell_troubles(now_ns, *d.port);
        d.network->run(now_ns, *d.port);
    }
    // The answer goes last: when it has arrived, all of this cycle has.
    const int last = d.options.role == Role::controller ? d.answer : d.question;
    for (int i = 0; i < static_cast<int>(d.sent.size()); ++i) {
        auto& message = d.sent[static_cast<std::size_t>(i)];
        if (i != last && d.due(message, now_ns)) d.transmit(message, now_ns, signals);
    }
    if (last >= 0) {
        auto& message = d.sent[static_cast<std::size_t>(last)];
        if (d.due(message, now_ns)) d.transmit(message, now_ns, signals);
    }
}

// ---- the rest ------------------------------------------------------------------------------------------------

CanLink::CanLink(const Mapping& mapping, CanPort& port, SignalTable& signals, const LinkOptions& options)
    : data_(std::make_unique<Data>(mapping, port, signals, options)) {}
CanLink::~CanLink() = default;
CanLink::CanLink(CanLink&&) noexcept = default;

bool CanLink::command_valid() const SHIFTRIG_REALTIME {
    return data_->valid;
}
bool CanLink::awaiting_answer() const SHIFTRIG_REALTIME {
    return data_->awaiting;
}
bool CanLink::question_pending() const SHIFTRIG_REALTIME {
    return data_->pending;
}

void CanLink::claim_addresses() {
    if (!data_->network) return;
    // All of it lies before time 0: a log that is replayed and faults of the bus begin with the first tick.
    constexpr std::int64_t kBefore = -60'000'000'000;
    const auto start = std::chrono::steady_clock::now();
    const auto all_settled = [this] {
        const auto& nodes = data_->network->nodes();
        return std::all_of(nodes.begin(), nodes.end(), [](const auto& node) {
            return node.claim == j1939::Claim::claimed || node.claim == j1939::Claim::lost;
        });
    };
    for (std::int64_t now_ns = kBefore; !all_settled() || now_ns == kBefore;) {
        data_->network->run(now_ns, *data_->port);
        data_->port->wait(10'000'000);
        const auto passed = std::chrono::nanoseconds(std::chrono::steady_clock::now() - start).count();
        now_ns = std::min<std::int64_t>(kBefore + passed, -1);
        const std::size_t count = data_->port->receive(now_ns, data_->buffer);
        for (std::size_t i = 0; i < count; ++i) data_->network->take(data_->buffer[i], now_ns, *data_->port);
    }
}

std::vector<MessageReport> CanLink::report() const {
    std::vector<MessageReport> result;
    for (const auto& message : data_->sent) result.push_back(message.report);
    for (const auto& message : data_->received) result.push_back(message.report);
    return result;
}
std::vector<TroubleReport> CanLink::troubles() const {
    std::vector<TroubleReport> result;
    if (!data_->network) return result;
    for (const auto& code : data_->network->troubles.codes()) {
        if (code.occurrences == 0) continue;
        const auto& nodes = data_->network->nodes();
        const auto owner = std::find_if(nodes.begin(), nodes.end(),
                                        [&](const auto& n) { return n.address == code.address; });
        result.push_back({code.spn, code.fmi, owner->name, code.occurrences, code.active});
    }
    return result;
}
double CanLink::bus_load() const noexcept {
    return data_->load;
}
const std::vector<std::string>& CanLink::warnings() const noexcept {
    return data_->warnings;
}
CanPort& CanLink::port() noexcept {
    return *data_->port;
}

}  // namespace shiftrig::io::can
