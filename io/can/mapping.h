// What the frames of a bus mean: a DBC file (layout) and a mapping in YAML (meaning). The comments of
// config/can/tractor.yaml describe the format by example.
#pragma once

#include <yaml-cpp/yaml.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "io/can/dbc.h"
#include "io/can/trouble_codes.h"
#include "plant/signal.h"

namespace shiftrig::io::can {

// How the table's value becomes the DBC signal's (and back, where that is possible).
enum class Use : std::uint8_t {
    value,       // as it is
    magnitude,   // |x|: the standard speeds are unsigned
    direction,   // 1 forward or standing, 0 reverse (ISO 11783)
    flag,        // 1 where x > `above`
    complement,  // 1 − x
    travelled,   // ∫|x| dt since start
    one_of,      // 1 where the raw value is `is`; sent as `is` or `else`
    constant,    // a fixed number in the DBC signal's unit; nothing in the table
};

// Of cycles, timeouts and the like [ms]: from a microsecond to a day.
inline constexpr double kShortestPeriodMs = 1e-3, kLongestPeriodMs = 86'400'000;
// "must be within 0.001 and 86400000"
std::string within_words(double smallest, double largest);

// A number with its unit, as in `per: 1201 Nm`.
struct Quantity {
    double value = 1;  // in `unit`
    plant::Unit unit = plant::Unit::one;
};

struct SignalMap {
    std::string dbc_signal;
    std::string signal;  // in the table; empty for a constant
    Use use = Use::value;
    double constant = 0;
    double above = 0.5;                      // of `flag`
    std::int64_t is = 1, otherwise_raw = 0;  // of `one_of`
    std::optional<Quantity> per;             // table value / per: a torque per 1201 Nm is a plain number
    std::optional<Quantity> times;  // table value · times: an angular speed times a radius is a speed
    std::optional<std::pair<double, double>> plausible;  // in the DBC signal's unit; else the DBC's [min|max]
    std::string enable;   // DBC signal: where it is 0 the value received is `disabled`
    double disabled = 0;  // in the table's unit
    std::string when;     // DBC signal: received only where it is one of `when_is`, else `otherwise`
    std::vector<std::int64_t> when_is;
    double otherwise = 0;  // in the table's unit
    int line = 0, column = 0;
};

enum class ChecksumFormula : std::uint8_t { tsc1, xor8, sum8, crc8_j1850 };

struct MessageMap {
    std::string name;
    bool command = false;              // the safe command acts when it is not to be trusted any more
    std::optional<double> cycle_ms;    // else the DBC's GenMsgCycleTime
    std::optional<double> timeout_ms;  // else five cycles
    std::optional<double> phase_ms;    // else spread by the link
    bool pin_source = false, pin_priority = false;
    std::optional<bool> hold_when_lost;  // else commands hold, others go back to the signals' initial values
    std::string counter;                 // DBC signal; empty: none
    unsigned counter_modulo = 16, counter_max_step = 3;
    std::string checksum;  // DBC signal; empty: none
    ChecksumFormula formula = ChecksumFormula::tsc1;
    std::vector<SignalMap> signals;
    int line = 0, column = 0;
};

// What a trouble code is raised by: a value above and below its limits, as far as there are any.
struct TroubleCondition {
    std::string signal;
    std::optional<Quantity> above, below;  // none: a plain number > 0.5
    int line = 0, column = 0;
};

// A fault of the rig's own that goes out as DM1 [J1939-73].
struct TroubleMap {
    std::uint32_t spn = 0;
    unsigned fmi = 0;
    std::string node;  // in the DBC, one of rig_nodes: whose fault it is
    j1939::Lamp lamp = j1939::Lamp::amber;
    double after_ms = 0;  // how long a condition must hold
    std::vector<TroubleCondition> any_of;
    int line = 0, column = 0;
};

struct Mapping {
    std::string file;
    dbc::Database database;
    double bit_rate = 250e3;             // [bit/s]
    double data_bit_rate = 0;            // [bit/s] of FD frames; 0: classic frames only
    std::optional<bool> j1939;           // nothing: extended identifiers are J1939, 11-bit ones are not
    std::vector<std::string> rig_nodes;  // transmitters the rig plays
    std::string question, answer;        // of lockstep
    std::uint16_t manufacturer = 0;      // of the NAMEs claimed [J1939-81]
    std::uint32_t identity = 1;
    std::vector<MessageMap> messages;
    std::vector<TroubleMap> troubles;

    const MessageMap* find(std::string_view message) const noexcept;
    bool sent_by_rig(const dbc::Message& message) const noexcept;
    bool is_j1939(const dbc::Message& message) const noexcept {
        return message.extended && j1939.value_or(true);
    }
};

// The file of a mapping. Throws InputError.
Mapping read_mapping(const std::string& path);
// The stanza `can:` of a model file, which is a mapping or the path of one (relative to the model file).
Mapping parse_mapping(const YAML::Node& node, const std::string& path);

}  // namespace shiftrig::io::can
