#include "apps/rig/variation.h"

#include <cmath>

#include "io/input_error.h"
#include "io/number.h"
#include "io/yaml_document.h"

namespace shiftrig::rig {

namespace {

std::vector<std::string> split(const std::string& text, char separator) {
    std::vector<std::string> parts(1);
    for (const char c : text) {
        if (c == separator)
            parts.emplace_back();
        else
            parts.back() += c;
    }
    return parts;
}

double number(const std::string& text, const std::string& whole) {
    const auto value = io::finite_number(text);
    if (!value)
        throw io::InputError("--vary " + whole + ": \"" + text +
                             "\" is not a number; write NAME=A,B,C or NAME=LOW:HIGH[:COUNT] or NAME=+-P%");
    return *value;
}

// SplitMix64 [Steele 2014]: a good number from any counter.
std::uint64_t mixed(std::uint64_t x) {
    x += 0x9E3779B97F4A7C15u;
    x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9u;
    x = (x ^ (x >> 27)) * 0x94D049BB133111EBu;
    return x ^ (x >> 31);
}

// Every map with its merge keys resolved, so that a change to one device does not change its siblings.
YAML::Node resolved(const std::string& path, const YAML::Node& node) {
    if (node.IsMap()) {
        YAML::Node copy(YAML::NodeType::Map);
        for (const auto& entry : io::entries(path, node, node.Mark(), ""))
            copy.force_insert(entry.key, resolved(path, entry.value));
        return copy;
    }
    if (node.IsSequence()) {
        YAML::Node copy(YAML::NodeType::Sequence);
        for (const auto& item : node) copy.push_back(resolved(path, item));
        return copy;
    }
    return YAML::Clone(node);
}

}  // namespace

std::string full_name(const Variation& v) {
    const char* prefix = v.target == Variation::Target::calibration ? "calibration."
                         : v.target == Variation::Target::model     ? "model."
                                                                    : "";
    return prefix + v.name;
}

Variation parse_variation(const std::string& text) {
    const auto equals = text.find('=');
    if (equals == std::string::npos || equals == 0)
        throw io::InputError("--vary " + text + ": write NAME=A,B,C or NAME=LOW:HIGH[:COUNT] or NAME=+-P%");
    Variation v;
    v.name = text.substr(0, equals);
    if (v.name.starts_with("calibration.")) {
        v.target = Variation::Target::calibration;
        v.name = v.name.substr(12);
    } else if (v.name.starts_with("model.")) {
        v.target = Variation::Target::model;
        v.name = v.name.substr(6);
    }
    const std::string range = text.substr(equals + 1);
    if (range.starts_with("+-") && range.ends_with("%")) {
        const double share = number(range.substr(2, range.size() - 3), text) / 100;
        if (share <= 0) throw io::InputError("--vary " + text + ": P must be > 0");
        v.relative = true;
        v.low = 1 - share;
        v.high = 1 + share;
        return v;
    }
    const auto bounds = split(range, ':');
    if (bounds.size() == 1) {
        for (const auto& value : split(range, ',')) v.values.push_back(number(value, text));
        return v;
    }
    v.low = number(bounds[0], text);
    v.high = number(bounds[1], text);
    if (!std::isfinite(v.high - v.low)) throw io::InputError("--vary " + text + ": too far apart");
    if (bounds.size() == 2) return v;
    const double count = number(bounds[2], text);
    if (bounds.size() > 3 || count < 2 || count > 1e6 || count != std::floor(count))
        throw io::InputError("--vary " + text + ": LOW:HIGH:COUNT needs a whole count from 2 to 1000000");
    for (int i = 0; i < static_cast<int>(count); ++i)
        v.values.push_back(v.low + (v.high - v.low) * i / (count - 1));
    return v;
}

Plan::Plan(std::vector<Variation> variations, std::int64_t branches, std::uint64_t seed)
    : variations_(std::move(variations)), branches_(1), seed_(seed), random_(false) {
    for (const auto& v : variations_) {
        random_ = random_ || v.values.empty();
        branches_ *= static_cast<std::int64_t>(std::max<std::size_t>(1, v.values.size()));
        if (branches_ > 10'000'000) throw io::InputError("--vary: more than 10000000 combinations");
    }
    if (random_) branches_ = branches;
}

std::vector<double> Plan::values(std::int64_t branch) const {
    std::vector<double> values;
    auto rest = static_cast<std::uint64_t>(branch);
    for (std::size_t i = 0; i < variations_.size(); ++i) {
        const Variation& v = variations_[i];
        const std::uint64_t draw = mixed(mixed(seed_ + i) ^ static_cast<std::uint64_t>(branch));
        if (v.values.empty()) {
            values.push_back(v.low + (v.high - v.low) * (static_cast<double>(draw >> 11) * 0x1p-53));
        } else {
            values.push_back(v.values[(random_ ? draw : rest) % v.values.size()]);
            rest /= v.values.size();
        }
    }
    return values;
}

YamlVariant::YamlVariant(const std::string& text, const std::string& path)
    : path_(path), root_(resolved(path, io::parse_yaml(text, path))) {}

void YamlVariant::set(const std::string& key, double value, bool relative) {
    YAML::Node node = root_;
    for (const auto& part : split(key, '.')) {
        if (!node.IsMap() || !node[part])
            throw io::InputError(path_ + ": has no \"" + key + "\" (at \"" + part + "\")");
        node.reset(node[part]);
    }
    double present = 0;
    if (!node.IsScalar() || !YAML::convert<double>::decode(node, present))
        throw io::InputError(path_ + ": \"" + key + "\" is not a number");
    const double original = original_.try_emplace(key, present).first->second;
    node = relative ? value * original : value;
}

std::string YamlVariant::text() const {
    YAML::Emitter out;
    out.SetDoublePrecision(17);
    out << root_;
    return out.c_str();
}

}  // namespace shiftrig::rig
