// A DBC file as data: nodes, messages, signals and what is said about them. Read once at start.
//
// Understood: VERSION, BU_, BO_, SG_ (Intel and Motorola, signed, multiplexed, extended multiplexing by
// SG_MUL_VAL_), SIG_VALTYPE_, VAL_, VAL_TABLE_, CM_, BA_DEF_, BA_DEF_DEF_, BA_, BO_TX_BU_, SIG_GROUP_, EV_, long
// names (System…LongSymbol), CRLF, UTF-8 or Latin-1. Sections it does not know are skipped. What is broken is an
// InputError `file:line:column: …`; what is merely odd (a comment on a signal that is not there) a warning.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace shiftrig::io::can::dbc {

enum class ValueType : std::uint8_t { integer, float32, float64 };

using Attributes = std::map<std::string, std::string>;  // enumerations by the name of the value
using ValueNames = std::vector<std::pair<std::int64_t, std::string>>;

struct Signal {
    std::string name;
    int start_bit = 0;          // as written: least significant bit (Intel), most significant bit (Motorola)
    int length = 0;             // bits
    bool little_endian = true;  // Intel
    bool is_signed = false;
    ValueType type = ValueType::integer;
    double factor = 1, offset = 0;    // physical = raw · factor + offset
    double minimum = 0, maximum = 0;  // physical; both 0: not given
    std::string unit;
    std::vector<std::string> receivers;

    bool is_multiplexor = false;
    std::string multiplexor;  // the signal that selects this one; empty: always there
    std::vector<std::pair<std::uint64_t, std::uint64_t>> selected_by;  // its values [first, last]

    ValueNames value_names;
    std::string comment;
    Attributes attributes;
    int line = 0;
};

struct Message {
    std::string name;
    std::uint32_t id = 0;
    bool extended = false;
    int length = 0;           // bytes; J1939 transport messages up to 1785
    std::string transmitter;  // empty: Vector__XXX
    std::vector<std::string> other_transmitters;
    std::vector<Signal> signals;
    std::vector<std::pair<std::string, std::vector<std::string>>> groups;
    std::string comment;
    Attributes attributes;
    int line = 0;

    const Signal* find(std::string_view signal) const noexcept;
    // GenMsgCycleTime [ms]; 0: none.
    double cycle_time_ms() const noexcept;
};

struct AttributeDefinition {
    std::string object;  // "", "BU_", "BO_", "SG_", "EV_"
    std::string type;    // INT, HEX, FLOAT, STRING, ENUM
    std::vector<std::string> choices;
    std::string default_value;
};

struct Node {
    std::string name, comment;
    Attributes attributes;
};

struct EnvironmentVariable {
    std::string name, unit, comment;
    double minimum = 0, maximum = 0, initial = 0;
    ValueNames value_names;
};

struct Database {
    std::string file, version, comment;
    std::vector<Node> nodes;
    std::vector<Message> messages;
    std::map<std::string, ValueNames> value_tables;
    std::map<std::string, AttributeDefinition> attribute_definitions;
    std::vector<EnvironmentVariable> environment;
    Attributes attributes;
    std::vector<std::string> warnings;

    const Message* find(std::string_view message) const noexcept;
};

Database read(const std::string& path);
Database parse(std::string_view text, const std::string& file);

}  // namespace shiftrig::io::can::dbc
