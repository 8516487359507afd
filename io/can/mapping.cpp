#include "io/can/mapping.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <iomanip>
#include <set>
#include <sstream>
#include <utility>

#include "io/can/units.h"
#include "io/input_error.h"
#include "io/text_file.h"

namespace shiftrig::io::can {

namespace {

class Reader {
  public:
    explicit Reader(std::string file) : file_(std::move(file)) {}

    Mapping mapping(const YAML::Node& node) const {
        Mapping result;
        result.file = file_;
        keys(node, "the mapping",
             {"dbc", "bit_rate", "data_bit_rate", "protocol", "rig_nodes", "lockstep", "name", "messages",
              "trouble_codes"});
        const std::string dbc = text(need(node, "dbc"));
        result.database = dbc::read((std::filesystem::path(file_).parent_path() / dbc).string());
        if (node["bit_rate"]) result.bit_rate = bit_rate(node["bit_rate"], "bit_rate");
        if (node["data_bit_rate"]) result.data_bit_rate = bit_rate(node["data_bit_rate"], "data_bit_rate");
        if (node["protocol"])
            result.j1939 = one_of<bool>(node["protocol"], "protocol", {{"j1939", true}, {"plain", false}});
        for (const auto& name : list(need(node, "rig_nodes"), "rig_nodes")) {
            const auto& nodes = result.database.nodes;
            result.rig_nodes.push_back(text(name));
            if (std::none_of(nodes.begin(), nodes.end(), [&](const auto& n) { return n.name == text(name); }))
                fail(name, "rig_nodes: " + result.database.file + " has no node \"" + text(name) + "\"");
        }
        for (const auto& entry : map(need(node, "messages"), "messages"))
            result.messages.push_back(message(entry.first, entry.second, result.database));
        if (const YAML::Node lockstep = node["lockstep"]) {
            keys(lockstep, "lockstep", {"question", "answer"});
            result.question = counted(need(lockstep, "question"), result);
            result.answer = counted(need(lockstep, "answer"), result);
        }
        if (const YAML::Node name = node["name"]) {
            keys(name, "name", {"manufacturer", "identity"});
            if (name["manufacturer"])
                result.manufacturer = static_cast<std::uint16_t>(integer(name["manufacturer"], 0, 0x7FF));
            if (name["identity"])
                result.identity = static_cast<std::uint32_t>(integer(name["identity"], 0, 0x1FFFFF));
        }
        if (node["trouble_codes"])
            for (const auto& entry : list(node["trouble_codes"], "trouble_codes")) troubles(entry, result);
        return result;
    }

    [[noreturn]] void fail(const YAML::Node& node, const std::string& what) const {
        throw InputError(file_, node.Mark().line + 1, node.Mark().column + 1, what);
    }

  private:
    // A lockstep message must be mapped and carry a counter.
    std::string counted(const YAML::Node& node, const Mapping& mapping) const {
        const MessageMap* found = mapping.find(text(node));
        if (!found) fail(node, "lockstep: message \"" + text(node) + "\" is not mapped below");
        if (found->counter.empty()) fail(node, "lockstep: message \"" + text(node) + "\" has no counter");
        return found->name;
    }

    MessageMap message(const YAML::Node& name, const YAML::Node& node, const dbc::Database& database) const {
        MessageMap result;
        result.name = text(name);
        result.line = name.Mark().line + 1;
        result.column = name.Mark().column + 1;
        const dbc::Message* layout = database.find(result.name);
        if (!layout) fail(name, database.file + " has no message \"" + result.name + "\"");
        keys(node, "message " + result.name,
             {"command", "cycle_ms", "timeout_ms", "phase_ms", "pin", "when_lost", "counter", "checksum",
              "signals"});
        if (node["command"]) result.command = boolean(node["command"]);
        if (node["cycle_ms"]) result.cycle_ms = period(node["cycle_ms"], "cycle_ms");
        if (node["timeout_ms"]) result.timeout_ms = period(node["timeout_ms"], "timeout_ms");
        if (node["phase_ms"]) result.phase_ms = within(node["phase_ms"], "phase_ms", 0, kLongestPeriodMs);
        if (node["pin"]) {
            for (const auto& pin : list(node["pin"], "pin")) {
                if (text(pin) != "source" && text(pin) != "priority")
                    fail(pin, "pin: must be source or priority");
                (text(pin) == "source" ? result.pin_source : result.pin_priority) = true;
            }
        }
        if (node["when_lost"])
            result.hold_when_lost =
                one_of<bool>(node["when_lost"], "when_lost", {{"hold", true}, {"initial", false}});
        if (const YAML::Node counter = node["counter"]) {
            keys(counter, "counter of " + result.name, {"signal", "modulo", "max_step"});
            result.counter = layout_signal(need(counter, "signal"), *layout);
            if (counter["modulo"])
                result.counter_modulo = static_cast<unsigned>(integer(counter["modulo"], 2, 65536));
            result.counter_max_step = std::min(3U, result.counter_modulo - 1);
            if (counter["max_step"])
                result.counter_max_step =
                    static_cast<unsigned>(integer(counter["max_step"], 1, result.counter_modulo - 1));
        }
        if (const YAML::Node checksum = node["checksum"]) {
            keys(checksum, "checksum of " + result.name, {"signal", "formula"});
            result.checksum = layout_signal(need(checksum, "signal"), *layout);
            result.formula = one_of<ChecksumFormula>(need(checksum, "formula"), "formula",
                                                     {{"tsc1", ChecksumFormula::tsc1},
                                                      {"xor8", ChecksumFormula::xor8},
                                                      {"sum8", ChecksumFormula::sum8},
                                                      {"crc8_j1850", ChecksumFormula::crc8_j1850}});
            if (result.formula == ChecksumFormula::tsc1 && (layout->length != 8 || result.counter.empty()))
                fail(checksum,
                     "checksum of " + result.name + ": tsc1 wants a counter and a message of 8 bytes");
        }
        if (node["signals"])
            for (const auto& entry : map(node["signals"], "signals of " + result.name))
                result.signals.push_back(signal(entry.first, entry.second, *layout));
        return result;
    }

    SignalMap signal(const YAML::Node& name, const YAML::Node& node, const dbc::Message& layout) const {
        SignalMap result;
        result.dbc_signal = layout_signal(name, layout);
        result.line = name.Mark().line + 1;
        result.column = name.Mark().column + 1;
        if (node.IsScalar()) {
            result.signal = text(node);
            return result;
        }
        const std::string label = layout.name + "." + result.dbc_signal;
        keys(node, label,
             {"signal", "as", "above", "is", "else", "per", "times", "plausible", "enable", "disabled",
              "when", "otherwise", "constant"});
        if (node["constant"]) {
            if (node.size() != 1) fail(node, label + ": a constant takes no other key");
            result.use = Use::constant;
            result.constant = number(node["constant"]);
            return result;
        }
        result.signal = text(need(node, "signal"));
        if (node["as"])
            result.use = one_of<Use>(node["as"], "as",
                                     {{"value", Use::value},
                                      {"magnitude", Use::magnitude},
                                      {"direction", Use::direction},
                                      {"flag", Use::flag},
                                      {"complement", Use::complement},
                                      {"travelled", Use::travelled}});
        if (node["above"]) result.above = number(node["above"]);
        if (node["is"]) {
            result.use = Use::one_of;
            result.is = integer(node["is"], 0, INT64_MAX);
            if (node["else"]) result.otherwise_raw = integer(node["else"], 0, INT64_MAX);
        }
        for (const char* key : {"per", "times"}) {
            if (!node[key]) continue;
            const Quantity factor = quantity_of(node[key]);
            if (factor.value == 0) fail(node[key], label + ": " + key + " must not be 0");
            (key[0] == 'p' ? result.per : result.times) = factor;
        }
        if (const YAML::Node range = node["plausible"]) {
            if (!range.IsSequence() || range.size() != 2)
                fail(range, label + ": plausible must be [lowest, highest]");
            result.plausible = {number(range[0]), number(range[1])};
        }
        if (node["is"] && node["when"]) fail(node["when"], label + ": is and when exclude each other");
        if (node["enable"]) result.enable = layout_signal(node["enable"], layout);
        if (node["disabled"]) result.disabled = number(node["disabled"]);
        if (const YAML::Node when = node["when"]) {
            if (!when.IsMap() || when.size() != 1)
                fail(when, label + ": when must be {SIGNAL: [raw values]}");
            const YAML::detail::iterator_value entry =
                *when.begin();  // the iterator's arrow yields a temporary
            result.when = layout_signal(entry.first, layout);
            if (!entry.second.IsSequence() || entry.second.size() == 0)
                fail(when, label + ": when must be {SIGNAL: [raw values]}");
            for (const auto& value : entry.second) result.when_is.push_back(integer(value, 0, INT64_MAX));
            result.otherwise = number(need(node, "otherwise"));
        }
        return result;
    }

    // One entry of `trouble_codes`: a component, and what can be wrong with it.
    void troubles(const YAML::Node& node, Mapping& mapping) const {
        keys(node, "trouble_codes", {"spn", "of", "lamp", "after_ms", "fmi"});
        TroubleMap code;
        code.spn = static_cast<std::uint32_t>(integer(need(node, "spn"), 1, 0x7FFFF));
        code.node = text(need(node, "of"));
        const auto& ours = mapping.rig_nodes;
        if (std::find(ours.begin(), ours.end(), code.node) == ours.end())
            fail(node["of"], "trouble_codes: \"" + code.node + "\" is none of the rig_nodes");
        code.lamp = one_of<j1939::Lamp>(need(node, "lamp"), "lamp",
                                        {{"none", j1939::Lamp::none},
                                         {"protect", j1939::Lamp::protect},
                                         {"amber", j1939::Lamp::amber},
                                         {"red", j1939::Lamp::red},
                                         {"malfunction", j1939::Lamp::malfunction}});
        if (node["after_ms"]) code.after_ms = period(node["after_ms"], "after_ms");
        if (!need(node, "fmi").IsMap()) fail(node["fmi"], "fmi: {5: sensor.output.dropout, …} is wanted");
        for (const auto& entry : node["fmi"]) {
            code.fmi = static_cast<unsigned>(integer(entry.first, 0, 31));
            code.line = entry.first.Mark().line + 1;
            code.column = entry.first.Mark().column + 1;
            for (const auto& other : mapping.troubles)
                if (other.spn == code.spn && other.fmi == code.fmi && other.node == code.node)
                    fail(entry.first, "trouble_codes: SPN " + std::to_string(code.spn) + " FMI " +
                                          std::to_string(code.fmi) + " of " + code.node + " stands in line " +
                                          std::to_string(other.line) + " already");
            code.any_of.clear();
            if (entry.second.IsSequence())
                for (const auto& each : entry.second) code.any_of.push_back(condition(each));
            else
                code.any_of.push_back(condition(entry.second));
            mapping.troubles.push_back(code);
        }
    }

    TroubleCondition condition(const YAML::Node& node) const {
        TroubleCondition result;
        result.line = node.Mark().line + 1;
        result.column = node.Mark().column + 1;
        if (node.IsScalar()) {
            result.signal = text(node);
            return result;
        }
        keys(node, "trouble_codes", {"signal", "above", "below"});
        result.signal = text(need(node, "signal"));
        if (node["above"]) result.above = quantity_of(node["above"]);
        if (node["below"]) result.below = quantity_of(node["below"]);
        if (!result.above && !result.below) fail(node, "trouble_codes: above or below is missing");
        return result;
    }

    std::string layout_signal(const YAML::Node& name, const dbc::Message& layout) const {
        if (!layout.find(text(name)))
            fail(name, "message " + layout.name + " has no signal \"" + text(name) + "\"");
        return text(name);
    }

    Quantity quantity_of(const YAML::Node& node) const {
        const std::string written = text(node);
        double value = 0;
        const auto [rest, error] = std::from_chars(written.data(), written.data() + written.size(), value);
        const auto unit =
            unit_conversion({rest, static_cast<std::size_t>(written.data() + written.size() - rest)});
        if (error != std::errc{} || !unit || !std::isfinite(value))
            fail(node, "\"" + written + "\" is not a number with a unit, such as 1201 Nm");
        return {value * unit->factor + unit->offset, unit->unit};
    }

    // ---- YAML ------------------------------------------------------------------------------------------

    // What is written as something else would look like an empty one. A key without a value is one.
    YAML::Node map(const YAML::Node& node, const std::string& what) const {
        if (!node.IsMap() && !node.IsNull()) fail(node, what + ": keys and values are wanted");
        std::set<std::string> seen;
        for (const auto& entry : node)
            if (!seen.insert(text(entry.first)).second)
                fail(entry.first, what + ": \"" + text(entry.first) + "\" is given twice");
        return node;
    }
    YAML::Node list(const YAML::Node& node, const std::string& what) const {
        if (!node.IsSequence() && !node.IsNull()) fail(node, what + ": a list is wanted, such as [a, b]");
        return node;
    }
    void keys(const YAML::Node& node, const std::string& what,
              std::initializer_list<std::string_view> known) const {
        if (!node.IsMap()) fail(node, what + ": keys and values are wanted");
        map(node, what);
        for (const auto& entry : node)
            if (std::find(known.begin(), known.end(), text(entry.first)) == known.end())
                fail(entry.first, what + ": unknown key \"" + text(entry.first) + "\"");
    }
    YAML::Node need(const YAML::Node& node, const char* key) const {
        if (!node[key]) fail(node, std::string("key \"") + key + "\" is missing");
        return node[key];
    }
    std::string text(const YAML::Node& node) const {
        if (!node.IsScalar()) fail(node, "a name is wanted");
        return node.Scalar();
    }
    template <class T>
    T parsed(const YAML::Node& node, const char* wanted) const {
        T value{};
        const std::string written = text(node);
        const char* end = written.data() + written.size();
        const auto [rest, error] = std::from_chars(written.data(), end, value);
        if (error != std::errc{} || rest != end) fail(node, "\"" + written + "\" is not " + wanted);
        return value;
    }
    double number(const YAML::Node& node) const {
        const auto value = parsed<double>(node, "a number");
        if (!std::isfinite(value)) fail(node, "\"" + text(node) + "\" must be a finite number");
        return value;
    }
    std::int64_t integer(const YAML::Node& node, std::int64_t smallest, std::int64_t largest) const {
        const auto value = parsed<std::int64_t>(node, "an integer");
        if (value < smallest || value > largest)
            fail(node, std::to_string(value) + " must be " + std::to_string(smallest) + "…" +
                           std::to_string(largest));
        return value;
    }
    double within(const YAML::Node& node, const std::string& key, double smallest, double largest) const {
        const auto value = parsed<double>(node, "a number");
        if (!(value >= smallest && value <= largest))
            fail(node, key + " = " + text(node) + "; " + within_words(smallest, largest));
        return value;
    }
    double period(const YAML::Node& node, const std::string& key) const {
        return within(node, key, kShortestPeriodMs, kLongestPeriodMs);
    }
    double bit_rate(const YAML::Node& node, const std::string& key) const {
        return within(node, key, 1e3, 1e9);
    }
    bool boolean(const YAML::Node& node) const {
        return one_of<bool>(node, "command", {{"true", true}, {"false", false}});
    }
    template <class T>
    T one_of(const YAML::Node& node, const std::string& key,
             std::initializer_list<std::pair<std::string_view, T>> choices) const {
        std::string list;
        for (const auto& [name, value] : choices) {
            if (name == text(node)) return value;
            list += (list.empty() ? "" : ", ") + std::string(name);
        }
        fail(node, key + ": \"" + text(node) + "\" is none of " + list);
    }

    std::string file_;
};

}  // namespace

std::string within_words(double smallest, double largest) {
    std::ostringstream words;
    words << std::setprecision(12) << "must be within " << smallest << " and " << largest;
    return words.str();
}

const MessageMap* Mapping::find(std::string_view message) const noexcept {
    const auto found = std::find_if(messages.begin(), messages.end(),
                                    [&](const MessageMap& m) { return m.name == message; });
    return found == messages.end() ? nullptr : &*found;
}

bool Mapping::sent_by_rig(const dbc::Message& message) const noexcept {
    return std::find(rig_nodes.begin(), rig_nodes.end(), message.transmitter) != rig_nodes.end();
}

Mapping read_mapping(const std::string& path) {
    const std::string text = read_text(path);
    YAML::Node node;
    try {
        node = YAML::Load(text);
    } catch (const YAML::Exception& error) {
        throw InputError(path, error.mark.line + 1, error.mark.column + 1, error.msg);
    }
    if (node.IsNull()) throw InputError(path, 1, 1, "the file is empty");
    return Reader(path).mapping(node);
}

Mapping parse_mapping(const YAML::Node& node, const std::string& path) {
    if (node.IsScalar())
        return read_mapping((std::filesystem::path(path).parent_path() / node.Scalar()).string());
    return Reader(path).mapping(node);
}

}  // namespace shiftrig::io::can
