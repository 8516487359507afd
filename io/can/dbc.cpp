#include "io/can/dbc.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <set>
#include <unordered_map>

#include "io/can/dbc_scanner.h"
#include "io/input_error.h"
#include "io/text_file.h"

namespace shiftrig::io::can::dbc {

namespace {

constexpr std::uint32_t kExtendedFlag = 0x80000000U;
// Vector tools keep signals that belong to no message in a pseudo message.
constexpr std::uint32_t kIndependentSignals = 0xC0000000U;
constexpr int kLongestMessage = 1785;  // J1939 transport protocol

// The name a value of an enumeration attribute has, if `text` is its index.
std::string choice(const AttributeDefinition& definition, const std::string& text) {
    std::size_t index = 0;
    const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), index);
    const bool is_index = error == std::errc{} && rest == text.data() + text.size();
    return is_index && index < definition.choices.size() ? definition.choices[index] : text;
}

std::string shortest(double value) {
    char buffer[32];
    const auto end = std::to_chars(buffer, buffer + sizeof buffer, value).ptr;
    return {buffer, end};
}

class Parser {
  public:
    Parser(std::string_view text, const std::string& file) : scan_(to_utf8(text), file) { db_.file = file; }

    Database parse() {
        while (!scan_.at_end()) statement();
        finish();
        return std::move(db_);
    }

  private:
    using Handler = void (Parser::*)();
    static const std::map<std::string, Handler, std::less<>>& handlers() {
        static const std::map<std::string, Handler, std::less<>> table{
            {"VERSION", &Parser::version},
            {"NS_", &Parser::new_symbols},
            {"BS_", &Parser::bit_timing},
            {"BU_", &Parser::nodes},
            {"BO_", &Parser::message},
            {"SG_", &Parser::signal},
            {"VAL_TABLE_", &Parser::value_table},
            {"BO_TX_BU_", &Parser::transmitters},
            {"EV_", &Parser::environment},
            {"SIG_GROUP_", &Parser::signal_group},
            {"SIG_VALTYPE_", &Parser::value_type},
            {"SG_MUL_VAL_", &Parser::multiplexed_by},
            {"CM_", &Parser::comment},
            {"BA_DEF_", &Parser::attribute_definition},
            {"BA_", &Parser::attribute},
            {"BA_DEF_DEF_", &Parser::attribute_default},
            {"VAL_", &Parser::value_names}};
        return table;
    }
    static bool is_keyword(const std::string& word) { return handlers().contains(word); }

    void statement() {
        const std::string keyword = scan_.peek_word();
        const auto handler = handlers().find(keyword);
        if (handler != handlers().end()) {
            if (keyword == "SG_" && !current_) scan_.fail("a signal stands outside of a message");
            scan_.word();
            (this->*handler->second)();
        } else if (keyword.empty()) {
            if (!scan_.accept(';')) scan_.fail("a section's keyword is wanted");
        } else {
            skip_section();
        }
    }

    // An unknown section ends where a line begins with a keyword we know, or after its semicolon.
    void skip_section() {
        scan_.skip_token();
        while (!scan_.at_end()) {
            if (scan_.accept(';')) return;
            if (scan_.at_line_start() && is_keyword(scan_.peek_word())) return;
            scan_.skip_token();
        }
    }

    void version() { db_.version = scan_.string(); }

    void new_symbols() {
        scan_.expect(':');
        while (scan_.alone_on_line() && !scan_.peek_word().empty()) scan_.word();
    }

    void bit_timing() {
        scan_.expect(':');
        const int line = scan_.line();
        if (!scan_.at_line_start() && line == scan_.line()) scan_.skip_line();
    }

    void nodes() {
        scan_.expect(':');
        for (std::string name = scan_.peek_word(); !name.empty(); name = scan_.peek_word()) {
            if (scan_.at_line_start() && is_keyword(name)) return;
            db_.nodes.push_back({.name = scan_.word(), .comment = {}, .attributes = {}});
        }
    }

    // ---- messages and signals --------------------------------------------------------------------------

    void message() {
        Message message;
        message.line = scan_.line();
        const std::uint32_t id = message_id();
        message.name = scan_.word();
        scan_.expect(':');
        message.length = static_cast<int>(scan_.integer(0, kLongestMessage, "message length"));
        message.transmitter = scan_.word();
        if (message.transmitter == "Vector__XXX") message.transmitter.clear();
        message.extended = (id & kExtendedFlag) != 0;
        message.id = id & 0x1FFFFFFFU;
        if (!message.extended && message.id > 0x7FF)
            scan_.fail_at(message.line, "message " + message.name + ": identifier " + std::to_string(id) +
                                            " has more than 11 bits and is not marked as extended");
        const auto [known, is_new] = by_id_.emplace(id, db_.messages.size());
        if (!is_new)
            scan_.fail_at(message.line, "message " + message.name + ": identifier " + std::to_string(id) +
                                            " is taken by " + db_.messages[known->second].name + " in line " +
                                            std::to_string(db_.messages[known->second].line));
        if (!names_.insert(message.name).second)
            scan_.fail_at(message.line, "message " + message.name + " is defined twice");
        db_.messages.push_back(std::move(message));
        current_ = id;
        signal_names_.clear();
    }

    void signal() {
        Message& message = db_.messages.back();
        Signal signal;
        signal.line = scan_.line();
        signal.name = scan_.word();
        if (!signal_names_.insert(signal.name).second)
            scan_.fail_at(signal.line, "signal " + message.name + "." + signal.name + " is defined twice");
        if (const std::string mark = scan_.peek_word(); !mark.empty()) multiplexing(scan_.word(), signal);
        scan_.expect(':');
        signal.start_bit = static_cast<int>(scan_.integer(0, 8 * kLongestMessage - 1, "start bit"));
        scan_.expect('|');
        signal.length = static_cast<int>(scan_.integer(1, 64, "signal length"));
        scan_.expect('@');
        signal.little_endian = scan_.integer(0, 1, "byte order") == 1;
        signal.is_signed = scan_.accept('-');
        if (!signal.is_signed) scan_.expect('+');
        scan_.expect('(');
        signal.factor = scan_.number();
        scan_.expect(',');
        signal.offset = scan_.number();
        scan_.expect(')');
        scan_.expect('[');
        signal.minimum = scan_.number();
        scan_.expect('|');
        signal.maximum = scan_.number();
        scan_.expect(']');
        signal.unit = scan_.string();
        receivers(signal);
        if (signal.factor == 0)
            scan_.fail_at(signal.line, "signal " + message.name + "." + signal.name + ": factor 0");
        if (*current_ != kIndependentSignals && !fits(signal, message.length))
            scan_.fail_at(signal.line, "signal " + message.name + "." + signal.name + ": bits " +
                                           std::to_string(signal.start_bit) + "|" +
                                           std::to_string(signal.length) + " reach beyond the message's " +
                                           std::to_string(message.length) + " bytes");
        message.signals.push_back(std::move(signal));
    }

    // M, m7, m7M
    void multiplexing(const std::string& mark, Signal& signal) {
        std::string_view rest = mark;
        if (rest.starts_with('m')) {
            std::uint64_t value = 0;
            const auto [end, error] = std::from_chars(rest.data() + 1, rest.data() + rest.size(), value);
            if (error != std::errc{})
                scan_.fail("multiplexing mark \"" + mark + "\" must be M, m<number> or m<number>M");
            signal.selected_by.emplace_back(value, value);
            rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
        }
        if (rest == "M")
            signal.is_multiplexor = true;
        else if (!rest.empty())
            scan_.fail("multiplexing mark \"" + mark + "\" must be M, m<number> or m<number>M");
    }

    void receivers(Signal& signal) {
        for (std::string name = scan_.peek_word(); !name.empty() && !scan_.at_line_start();
             name = scan_.peek_word()) {
            if (name != "Vector__XXX") signal.receivers.push_back(name);
            scan_.word();
            scan_.accept(',');
        }
    }

    static bool fits(const Signal& signal, int bytes) {
        if (signal.little_endian) return signal.start_bit + signal.length <= 8 * bytes;
        // Motorola: down from the start bit within its byte, then from bit 7 of the next.
        const int last = 8 * (signal.start_bit / 8) + (7 - signal.start_bit % 8) + signal.length;
        return last <= 8 * bytes;
    }

    void value_type() {
        Signal* signal = signal_reference("SIG_VALTYPE_");
        scan_.accept(':');
        const int line = scan_.line();
        const auto type = scan_.integer(0, 3, "value type");
        end_statement();
        if (!signal) return;
        if (type != 0) signal->type = type == 1 ? ValueType::float32 : ValueType::float64;
        if (type == 3) scan_.fail_at(line, "value type 3 is not defined");
        if (type != 0 && signal->length != (type == 1 ? 32 : 64))
            scan_.fail_at(line, "signal " + signal->name + " is a float of " + (type == 1 ? "32" : "64") +
                                    " bits but has " + std::to_string(signal->length));
    }

    void multiplexed_by() {
        Signal* signal = signal_reference("SG_MUL_VAL_");
        const std::string multiplexor = scan_.word();
        std::vector<std::pair<std::uint64_t, std::uint64_t>> ranges;
        do {
            const auto first = scan_.integer(0, INT64_MAX, "multiplexor value");
            scan_.expect('-');
            const auto last = scan_.integer(first, INT64_MAX, "multiplexor value");
            ranges.emplace_back(first, last);
        } while (scan_.accept(','));
        end_statement();
        if (!signal) return;
        signal->multiplexor = multiplexor;
        signal->selected_by = std::move(ranges);
    }

    void signal_group() {
        Message* message = message_reference("SIG_GROUP_");
        std::pair<std::string, std::vector<std::string>> group{scan_.word(), {}};
        scan_.number();  // repetitions, always 1
        scan_.expect(':');
        while (!scan_.peek_word().empty()) group.second.push_back(scan_.word());
        end_statement();
        if (message) message->groups.push_back(std::move(group));
    }

    void transmitters() {
        Message* message = message_reference("BO_TX_BU_");
        scan_.expect(':');
        while (!scan_.peek_word().empty()) {
            std::string name = scan_.word();
            if (message && name != message->transmitter)
                message->other_transmitters.push_back(std::move(name));
            scan_.accept(',');
        }
        end_statement();
    }

    void environment() {
        EnvironmentVariable variable;
        variable.name = scan_.word();
        scan_.expect(':');
        scan_.number();  // type
        scan_.expect('[');
        variable.minimum = scan_.number();
        scan_.expect('|');
        variable.maximum = scan_.number();
        scan_.expect(']');
        variable.unit = scan_.string();
        variable.initial = scan_.number();
        while (!scan_.at_end() && scan_.peek() != ';') scan_.skip_token();  // number, access, nodes
        end_statement();
        db_.environment.push_back(std::move(variable));
    }

    // ---- what is said about them -----------------------------------------------------------------------

    void value_table() {
        const std::string name = scan_.word();
        db_.value_tables[name] = value_list();
        end_statement();
    }

    void value_names() {
        const std::string variable = scan_.peek_word();
        if (!variable.empty()) {
            scan_.word();
            for (auto& known : db_.environment)
                if (known.name == variable) known.value_names = value_list();
            while (!scan_.at_end() && scan_.peek() != ';') scan_.skip_token();
        } else {
            Signal* signal = signal_reference("VAL_");
            if (const std::string table = scan_.peek_word(); !table.empty()) {
                scan_.word();
                if (signal) signal->value_names = db_.value_tables[table];
            } else {
                ValueNames names = value_list();
                if (signal) signal->value_names = std::move(names);
            }
        }
        end_statement();
    }

    ValueNames value_list() {
        ValueNames names;
        while (!scan_.at_end() && scan_.peek() != ';') {
            const double value = scan_.number();
            std::string name = scan_.string();
            if (std::abs(value) < 9e18) names.emplace_back(static_cast<std::int64_t>(value), std::move(name));
        }
        return names;
    }

    // What a CM_ or BA_ is about; `known` false if it is not there (a warning then).
    struct Object {
        std::string kind;  // "", BU_, BO_, SG_, EV_
        Node* node = nullptr;
        Message* message = nullptr;
        Signal* signal = nullptr;
        EnvironmentVariable* variable = nullptr;
    };
    Object object(const std::string& section) {
        Object object;
        const std::string kind = scan_.peek_word();
        if (kind != "BU_" && kind != "BO_" && kind != "SG_" && kind != "EV_") return object;
        object.kind = scan_.word();
        if (kind == "BO_") {
            object.message = message_reference(section);
        } else if (kind == "SG_") {
            object.signal = signal_reference(section);
        } else {
            const int line = scan_.line();
            const std::string name = scan_.word();
            for (auto& node : db_.nodes)
                if (kind == "BU_" && node.name == name) object.node = &node;
            for (auto& variable : db_.environment)
                if (kind == "EV_" && variable.name == name) object.variable = &variable;
            if (!object.node && !object.variable)
                warn(line, section + " speaks of " + name + ", which is not defined");
        }
        return object;
    }

    void comment() {
        const Object about = object("CM_");
        const std::string text = scan_.string();
        end_statement();
        if (about.kind.empty()) db_.comment = text;
        if (about.node) about.node->comment = text;
        if (about.message) about.message->comment = text;
        if (about.signal) about.signal->comment = text;
        if (about.variable) about.variable->comment = text;
    }

    void attribute_definition() {
        AttributeDefinition definition;
        if (!scan_.peek_word().empty()) definition.object = scan_.word();
        const std::string name = scan_.string();
        definition.type = scan_.word();
        if (definition.type == "ENUM")
            while (scan_.peek_string()) {
                definition.choices.push_back(scan_.string());
                scan_.accept(',');
            }
        while (!scan_.at_end() && scan_.peek() != ';') scan_.skip_token();  // range
        end_statement();
        db_.attribute_definitions[name] = std::move(definition);
    }

    void attribute_default() {
        const std::string name = scan_.string();
        const std::string value = attribute_value();
        end_statement();
        auto& definition = db_.attribute_definitions[name];
        definition.default_value = choice(definition, value);
    }

    void attribute() {
        const std::string name = scan_.string();
        const Object about = object("BA_");
        const auto definition = db_.attribute_definitions.find(name);
        std::string value = attribute_value();
        end_statement();
        if (definition != db_.attribute_definitions.end() && definition->second.type == "ENUM")
            value = choice(definition->second, value);
        if (about.kind.empty()) db_.attributes[name] = value;
        if (about.node) about.node->attributes[name] = value;
        if (about.message) about.message->attributes[name] = value;
        if (about.signal) about.signal->attributes[name] = value;
    }

    std::string attribute_value() { return scan_.peek_string() ? scan_.string() : shortest(scan_.number()); }

    // ---- references ------------------------------------------------------------------------------------

    std::uint32_t message_id() {
        return static_cast<std::uint32_t>(scan_.integer(0, UINT32_MAX, "message identifier"));
    }

    Message* message_reference(const std::string& section) {
        const int line = scan_.line();
        const std::uint32_t id = message_id();
        const auto found = by_id_.find(id);
        if (found != by_id_.end()) return &db_.messages[found->second];
        warn(line, section + " speaks of message " + std::to_string(id) + ", which is not defined");
        return nullptr;
    }

    Signal* signal_reference(const std::string& section) {
        const int line = scan_.line();
        Message* message = message_reference(section);
        const std::string name = scan_.word();
        if (!message) return nullptr;
        for (auto& signal : message->signals)
            if (signal.name == name) return &signal;
        warn(line, section + " speaks of " + message->name + "." + name + ", which is not defined");
        return nullptr;
    }

    void end_statement() { scan_.expect(';'); }
    void warn(int line, const std::string& what) {
        db_.warnings.push_back(db_.file + ":" + std::to_string(line) + ": " + what);
    }

    // ---- what can only be said at the end -----------------------------------------------------------------

    void finish() {
        if (const auto pseudo = by_id_.find(kIndependentSignals); pseudo != by_id_.end())
            db_.messages.erase(db_.messages.begin() + static_cast<std::ptrdiff_t>(pseudo->second));
        for (auto& message : db_.messages) {
            resolve_multiplexing(message);
            const auto cycle = db_.attribute_definitions.find("GenMsgCycleTime");
            if (cycle != db_.attribute_definitions.end() && !cycle->second.default_value.empty())
                message.attributes.emplace("GenMsgCycleTime", cycle->second.default_value);
            use_long_name(message.attributes, "SystemMessageLongSymbol", message.name);
            for (auto& signal : message.signals) rename_signal(message, signal);
        }
        for (auto& node : db_.nodes) {
            const std::string short_name = node.name;
            use_long_name(node.attributes, "SystemNodeLongSymbol", node.name);
            if (node.name != short_name)
                for (auto& message : db_.messages)
                    if (message.transmitter == short_name) message.transmitter = node.name;
        }
    }

    static void use_long_name(const Attributes& attributes, const std::string& attribute, std::string& name) {
        const auto found = attributes.find(attribute);
        if (found != attributes.end() && !found->second.empty()) name = found->second;
    }

    static void rename_signal(Message& message, Signal& signal) {
        const std::string short_name = signal.name;
        use_long_name(signal.attributes, "SystemSignalLongSymbol", signal.name);
        if (signal.name == short_name) return;
        for (auto& other : message.signals)
            if (other.multiplexor == short_name) other.multiplexor = signal.name;
    }

    // Simple multiplexing names no multiplexor: it is the message's only one. A chain must end at a signal that
    // is always there.
    void resolve_multiplexing(Message& message) {
        std::vector<const Signal*> plain;
        for (const auto& signal : message.signals)
            if (signal.is_multiplexor && signal.selected_by.empty()) plain.push_back(&signal);
        for (auto& signal : message.signals) {
            if (signal.selected_by.empty()) continue;
            if (signal.multiplexor.empty()) {
                if (plain.size() != 1)
                    scan_.fail_at(signal.line, "signal " + message.name + "." + signal.name +
                                                   " is multiplexed, but " + message.name + " has " +
                                                   std::to_string(plain.size()) +
                                                   " multiplexors to choose from");
                signal.multiplexor = plain.front()->name;
            }
        }
        for (const auto& signal : message.signals) {
            const Signal* above = &signal;
            for (std::size_t depth = 0; above && !above->multiplexor.empty(); ++depth) {
                if (depth > message.signals.size())
                    scan_.fail_at(signal.line, "signal " + message.name + "." + signal.name +
                                                   ": its multiplexors select each other");
                const Signal* next = message.find(above->multiplexor);
                if (!next)
                    scan_.fail_at(above->line, "signal " + message.name + "." + above->name +
                                                   ": multiplexor " + above->multiplexor + " is not defined");
                above = next;
            }
        }
    }

    Scanner scan_;
    Database db_;
    std::optional<std::uint32_t> current_;  // raw identifier of the message whose signals follow
    std::unordered_map<std::uint32_t, std::size_t> by_id_;
    std::set<std::string> names_, signal_names_;
};

}  // namespace

const Signal* Message::find(std::string_view signal) const noexcept {
    const auto found =
        std::find_if(signals.begin(), signals.end(), [&](const Signal& s) { return s.name == signal; });
    return found == signals.end() ? nullptr : &*found;
}

double Message::cycle_time_ms() const noexcept {
    const auto found = attributes.find("GenMsgCycleTime");
    if (found == attributes.end()) return 0;
    double value = 0;
    std::from_chars(found->second.data(), found->second.data() + found->second.size(), value);
    return std::isfinite(value) && value > 0 ? value : 0;
}

const Message* Database::find(std::string_view message) const noexcept {
    const auto found =
        std::find_if(messages.begin(), messages.end(), [&](const Message& m) { return m.name == message; });
    return found == messages.end() ? nullptr : &*found;
}

Database parse(std::string_view text, const std::string& file) {
    return Parser(text, file).parse();
}

Database read(const std::string& path) {
    Database database = parse(read_text(path), path);
    if (database.messages.empty()) throw InputError(path, 0, 0, "has no messages; is it a DBC file?");
    return database;
}

}  // namespace shiftrig::io::can::dbc
