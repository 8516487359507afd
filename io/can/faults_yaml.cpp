// Reads the faults of a scenario.
#include <charconv>
#include <cmath>
#include <initializer_list>

#include "io/can/faults.h"
#include "io/can/mapping.h"
#include "io/input_error.h"

namespace shiftrig::io::can {

namespace {

constexpr std::pair<std::string_view, FaultKind> kKinds[] = {
    {"drop", FaultKind::drop},
    {"delay", FaultKind::delay},
    {"jitter", FaultKind::jitter},
    {"duplicate", FaultKind::duplicate},
    {"reorder", FaultKind::reorder},
    {"corrupt", FaultKind::corrupt},
    {"freeze", FaultKind::freeze},
    {"wrong_counter", FaultKind::wrong_counter},
    {"wrong_checksum", FaultKind::wrong_checksum},
    {"babble", FaultKind::babble},
    {"bus_off", FaultKind::bus_off},
};

class Reader {
  public:
    Reader(const std::string& file, const Mapping& mapping) : file_(file), mapping_(mapping) {}

    FaultPlan plan(const YAML::Node& node, std::uint64_t seed) const {
        FaultPlan plan;
        plan.seed = seed;
        if (node.IsMap()) {
            for (const auto& entry : node)
                if (const auto key = entry.first.Scalar();
                    key != "seed" && key != "bit_rate" && key != "faults")
                    fail(entry.first, "unknown key \"" + key + "\"");
            if (node["bit_rate"]) plan.bit_rate = number(node["bit_rate"], 1e3, 1e9);
            if (node["seed"]) plan.seed = static_cast<std::uint64_t>(number(node["seed"], 0, 9e15));
        }
        const YAML::Node list = node.IsMap() ? node["faults"] : node;
        if (node.IsMap() && !list) return plan;
        if (!list || !list.IsSequence()) fail(node, "a list of faults is wanted");
        for (const auto& entry : list) plan.faults.push_back(fault(entry));
        return plan;
    }

  private:
    BusFault fault(const YAML::Node& node) const {
        if (!node.IsMap() || !node["fault"]) fail(node, "key \"fault\" is missing");
        BusFault fault;
        const std::string kind = node["fault"].Scalar();
        bool known = false;
        std::string choices;
        for (const auto& [name, value] : kKinds) {
            if (kind == name) fault.kind = value, known = true;
            choices += (choices.empty() ? "" : ", ") + std::string(name);
        }
        if (!known) fail(node["fault"], "fault: \"" + kind + "\" is none of " + choices);
        for (const auto& entry : node) take(fault, entry.first, entry.second);

        const auto need = [&](bool given, const std::string& key) {
            if (!given) fail(node, kind + " needs " + key);
        };
        if (fault.kind == FaultKind::delay || fault.kind == FaultKind::jitter) need(fault.by_ns > 0, "by_ms");
        if (fault.kind == FaultKind::babble) need(fault.rate_hz > 0, "rate_hz");
        if (fault.kind == FaultKind::freeze) need(!fault.signal.empty(), "message and signal");
        if (fault.until_ns <= fault.from_ns) fail(node, "until_s must be after from_s");
        const MessageMap* map = mapping_.find(fault.message);
        if (fault.kind == FaultKind::wrong_counter)
            need(map && !map->counter.empty(), "a message with a counter");
        if (fault.kind == FaultKind::wrong_checksum)
            need(map && !map->checksum.empty(), "a message with a checksum");
        if (!fault.signal.empty()) {
            const dbc::Message* layout = mapping_.database.find(fault.message);
            if (!layout || !layout->find(fault.signal))
                fail(node["signal"],
                     "message \"" + fault.message + "\" has no signal \"" + fault.signal + "\"");
        }
        return fault;
    }

    void take(BusFault& fault, const YAML::Node& key_node, const YAML::Node& value) const {
        const std::string key = key_node.Scalar();
        if (key == "fault") {
        } else if (key == "message") {
            fault.message = value.Scalar();
            if (!mapping_.database.find(fault.message))
                fail(value, mapping_.database.file + " has no message \"" + fault.message + "\"");
        } else if (key == "signal") {
            fault.signal = value.Scalar();
        } else if (key == "direction") {
            const std::string direction = value.Scalar();
            if (direction != "received" && direction != "sent" && direction != "both")
                fail(value, "direction must be received, sent or both");
            fault.on_received = direction != "sent";
            fault.on_sent = direction != "received";
        } else if (key == "from_s") {
            fault.from_ns = nanoseconds(number(value, 0, 1e8));
        } else if (key == "until_s") {
            fault.until_ns = nanoseconds(number(value, 0, 1e8));
        } else if (key == "probability") {
            fault.probability = number(value, 0, 1);
        } else if (key == "by_ms") {
            fault.by_ns = nanoseconds(1e-3 * number(value, 0, 1e6));
        } else if (key == "bits") {
            fault.bits = static_cast<int>(number(value, 1, 64));
        } else if (key == "rate_hz") {
            fault.rate_hz = number(value, 1e-3, 1e6);
        } else if (key == "id") {
            const std::string text = value.Scalar();
            const bool hex = text.starts_with("0x");
            const char* end = text.data() + text.size();
            const auto [rest, error] =
                std::from_chars(text.data() + (hex ? 2 : 0), end, fault.id, hex ? 16 : 10);
            if (error != std::errc{} || rest != end || fault.id > 0x1FFFFFFF)
                fail(value, "id: \"" + text + "\" is not a 29-bit identifier");
        } else {
            fail(key_node, "unknown key \"" + key + "\"");
        }
    }

    static std::int64_t nanoseconds(double seconds) { return std::llround(seconds * 1e9); }

    double number(const YAML::Node& node, double smallest, double largest) const {
        double value = 0;
        const std::string text = node.IsScalar() ? node.Scalar() : "";
        const char* end = text.data() + text.size();
        const auto [rest, error] = std::from_chars(text.data(), end, value);
        if (error != std::errc{} || rest != end) fail(node, "\"" + text + "\" is not a number");
        if (!(value >= smallest && value <= largest)) fail(node, text + " is out of range");
        return value;
    }

    [[noreturn]] void fail(const YAML::Node& node, const std::string& what) const {
        throw InputError(file_, node.Mark().line + 1, node.Mark().column + 1, "bus_faults: " + what);
    }

    const std::string& file_;
    const Mapping& mapping_;
};

}  // namespace

FaultPlan parse_faults(const YAML::Node& node, const std::string& file, const Mapping& mapping,
                       std::uint64_t seed) {
    return Reader(file, mapping).plan(node, seed);
}

std::string describe(const BusFault& fault) {
    std::string text;
    for (const auto& [name, kind] : kKinds)
        if (kind == fault.kind) text = name;
    if (!fault.message.empty()) text += " " + fault.message;
    if (!fault.signal.empty()) text += "." + fault.signal;
    return text;
}

}  // namespace shiftrig::io::can
