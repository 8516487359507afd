// What CanLink is made of: descriptors compiled from the mapping (link_build.cpp) and run by link.cpp.
#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "io/can/codec.h"
#include "io/can/j1939.h"
#include "io/can/link.h"
#include "io/can/mapping.h"

namespace shiftrig::io::can {

// A multiplexed signal is there only where every multiplexor above it has one of these values.
struct Selection {
    SignalCodec multiplexor;
    std::vector<std::pair<std::uint64_t, std::uint64_t>> values;
    bool holds(const std::uint8_t* data) const SHIFTRIG_REALTIME {
        const std::uint64_t raw = multiplexor.raw(data);
        for (const auto& [first, last] : values)
            if (raw >= first && raw <= last) return true;
        return false;
    }
};

struct Field {
    SignalCodec codec;
    Use use = Use::value;
    int index = -1;             // in the signal table
    double gain = 1, bias = 0;  // table value = physical · gain + bias
    std::uint64_t is = 1, otherwise_raw = 0;
    double above = 0.5;
    std::vector<Selection> selected;

    // receiving
    double lowest = -1e300, highest = 1e300;  // plausible physical values
    std::optional<SignalCodec> enable;
    double disabled = 0;
    std::optional<SignalCodec> when;
    std::vector<std::uint64_t> when_is;
    double otherwise = 0, absent = 0;  // table values: condition not met; not available or lost

    // Is the condition `when` met, if there is one? Otherwise nobody reads the field, whatever stands in it.
    bool is_meant(const std::uint8_t* data) const SHIFTRIG_REALTIME {
        return !when || std::find(when_is.begin(), when_is.end(), when->raw(data)) != when_is.end();
    }

    // sending
    double travelled = 0;  // physical · gain
};

struct CounterField {
    SignalCodec codec;
    unsigned modulo = 16, max_step = 3;
};

struct ChecksumField {
    SignalCodec codec;
    ChecksumFormula formula = ChecksumFormula::tsc1;
    std::optional<SignalCodec> counter;
    unsigned compute(const Frame& frame) const SHIFTRIG_REALTIME;
};

struct ReceivedMessage {
    MessageReport report;
    std::uint32_t id = 0, mask = 0;  // matches where (frame.id & mask) == id
    bool extended = false;
    bool to_everyone = false;  // PDU1: also frames to the global address
    std::uint8_t length = 0;
    bool command = false, hold = false;
    std::int64_t timeout_ns = 0, late_ns = 0;  // 0: not supervised
    std::optional<CounterField> counter;
    std::optional<ChecksumField> checksum;
    std::vector<Field> fields;
    int status_index = -1;

    std::int64_t heard_ns = 0, good_ns = 0, bad_ns = 0;  // last frame at all, trusted, not trusted
    bool seen_good = false, seen_bad = false, last_was_bad = false, was_overdue = false;
    bool counting = false;  // last_counter is known
    unsigned last_counter = 0;
    bool expected = false;  // a command that the controller sends: its silence is a loss
};

struct SentMessage {
    MessageReport report;
    Frame frame;  // constants and "not available" filled in
    std::int64_t cycle_ns = 0, phase_ns = 0, due_ns = 0;
    std::optional<CounterField> counter;
    std::optional<ChecksumField> checksum;
    std::vector<Field> fields;
    std::optional<SignalCodec> multiplexor;  // sent in turns, one value a cycle
    std::vector<std::uint64_t> multiplexor_values;
    std::size_t turn = 0;
    unsigned next_counter = 0;
    bool requested = false;     // by a J1939 request: sent at the next opportunity
    bool by_transport = false;  // more than 8 bytes on a classic J1939 bus
};

// Of a trouble code: fulfilled while above < value < below has held for `after_ns`.
struct Condition {
    int index = -1;                        // in the signal table
    double above = -1e300, below = 1e300;  // [the signal's unit]
    std::int64_t after_ns = 0;
    int code = -1;  // of network->troubles

    bool holds = false;
    std::int64_t since_ns = 0;
};

struct CanLink::Data {
    Data(const Mapping& mapping, CanPort& port, SignalTable& signals, const LinkOptions& options);

    // building
    void build_received(const Mapping& mapping, const dbc::Message& layout, const MessageMap& map,
                        SignalTable& signals);
    void build_sent(const Mapping& mapping, const dbc::Message& layout, const MessageMap& map,
                    SignalTable& signals);
    int resolve(const Mapping& mapping, const SignalMap& map, plant::Unit unit, bool receiving,
                SignalTable& signals);
    Field build_field(const Mapping& mapping, const dbc::Message& layout, const SignalMap& map,
                      bool receiving, SignalTable& signals);
    void build_look_up();
    void settle_duplicates(const Mapping& mapping, const SignalTable& signals);
    void spread_phases();
    void build_troubles(const Mapping& mapping, const SignalTable& signals);
    void judge_load(const Mapping& mapping);

    // running
    ReceivedMessage* match(const Frame& frame) SHIFTRIG_REALTIME;
    bool trusted(ReceivedMessage& message, const Frame& frame) SHIFTRIG_REALTIME;
    bool plausible(const ReceivedMessage& message, const Frame& frame) const SHIFTRIG_REALTIME;
    void decode(const ReceivedMessage& message, const Frame& frame,
                SignalTable& signals) const SHIFTRIG_REALTIME;
    void take(const Frame& frame, std::int64_t now_ns, SignalTable& signals) SHIFTRIG_REALTIME;
    void supervise(std::int64_t now_ns, SignalTable& signals) SHIFTRIG_REALTIME;
    bool judge_commands(std::int64_t now_ns, SignalTable& signals) SHIFTRIG_REALTIME;
    void encode(SentMessage& message, const SignalTable& signals) SHIFTRIG_REALTIME;
    void transmit(SentMessage& message, std::int64_t now_ns, const SignalTable& signals) SHIFTRIG_REALTIME;
    bool due(SentMessage& message, std::int64_t now_ns) SHIFTRIG_REALTIME;
    bool put_on_bus(SentMessage& message, std::int64_t now_ns) SHIFTRIG_REALTIME;
    void find_troubles(std::int64_t now_ns, const SignalTable& signals) SHIFTRIG_REALTIME;
    void hear_network(std::int64_t now_ns, SignalTable& signals) SHIFTRIG_REALTIME;

    CanPort* port;
    LinkOptions options;
    std::vector<ReceivedMessage> received;
    std::vector<SentMessage> sent;
    struct LookUp {
        std::uint64_t key;
        std::size_t message;
    };
    std::vector<LookUp> look_up;  // sorted by key
    std::array<Frame, 64> buffer;
    std::optional<j1939::Network> network;
    std::vector<Condition> conditions;  // by code
    std::vector<int> address_index;     // signal `bus.<node>.address` of each of the network's nodes
    std::vector<std::string> warnings;
    double load = 0;
    int valid_index = -1;

    bool started_receiving = false, started_sending = false, valid = true;
    std::int64_t receive_start_ns = 0, last_send_ns = 0;
    bool hearing_commands = false, commands_gathered = false;  // see judge_commands
    std::int64_t commands_began_ns = 0;

    // Lockstep. For the rig `question` is sent and `answer` received, for the controller the other way round.
    int question = -1, answer = -1;  // indices into `sent` or `received`
    bool awaiting = false, pending = false, asked_before = false;
    unsigned question_counter = 0;
    std::int64_t question_ns = 0;

    std::int64_t command_arrived_ns =
        0;  // stamp of the oldest command that no frame sent reflects yet; 0: none
};

// The part of an identifier that names what a frame is about, see link.cpp.
std::uint64_t exact_key(std::uint32_t id, bool extended) SHIFTRIG_REALTIME;
std::uint64_t pgn_key(std::uint32_t id) SHIFTRIG_REALTIME;
// Parameter group number: the destination of a PDU1 identifier is not part of it.
std::uint32_t pgn_of(std::uint32_t id) SHIFTRIG_REALTIME;
inline bool is_pdu1(std::uint32_t id) SHIFTRIG_REALTIME {
    return ((id >> 16) & 0xFFU) < 240;
}

}  // namespace shiftrig::io::can
