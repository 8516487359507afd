#include "analysis/limits.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <utility>

#include "analysis/limits_text.h"
#include "io/input_error.h"
#include "io/text_file.h"

namespace shiftrig::analysis {

namespace {

[[noreturn]] void refuse(const std::string& path, const YAML::Node& node, const std::string& what) {
    const YAML::Mark mark = node.Mark();
    throw io::InputError(path, mark.line + 1, mark.column + 1, what);
}

double number(const std::string& path, const std::string& key, const YAML::Node& node) {
    double value = 0;
    if (!node.IsScalar() || !YAML::convert<double>::decode(node, value) || !(value >= 0)) {
        refuse(path, node, key + " = " + (node.IsScalar() ? node.Scalar() : "…") + "; must be a number ≥ 0");
    }
    return value;
}

// The entries of a map in file order; refuses what is none.
std::vector<std::pair<std::string, YAML::Node>> entries(const std::string& path, const std::string& key,
                                                        const YAML::Node& node) {
    if (!node.IsMap()) refuse(path, node, key + ": must be a map");
    std::vector<std::pair<std::string, YAML::Node>> list;
    for (const auto& entry : node) {
        list.emplace_back(entry.first.Scalar(), entry.second);
        const auto twice = [&](const auto& other) { return other.first == list.back().first; };
        if (std::count_if(list.begin(), list.end(), twice) > 1) {
            refuse(path, entry.first, key + ": \"" + list.back().first + "\" is given twice");
        }
    }
    return list;
}

void read_rules(const std::string& path, const YAML::Node& node, ShiftRules& rules) {
    const std::pair<const char*, double*> fields[] = {{"ratio_tolerance", &rules.ratio_tolerance},
                                                      {"hold_s", &rules.hold},
                                                      {"timeout_s", &rules.timeout},
                                                      {"launch_timeout_s", &rules.launch_timeout},
                                                      {"lever_lookback_s", &rules.lever_lookback},
                                                      {"settling_s", &rules.settling}};
    for (const auto& [key, value] : entries(path, "rules", node)) {
        const auto field =
            std::find_if(std::begin(fields), std::end(fields), [&](const auto& f) { return key == f.first; });
        if (field == std::end(fields)) refuse(path, value, "rules: unknown key \"" + key + "\"");
        *field->second = number(path, "rules: " + key, value);
    }
}

void read_group(const std::string& path, const std::string& group, const YAML::Node& node,
                std::map<std::string, Limit>& limits) {
    const std::vector<std::string>& known = metric_names();
    for (const auto& [metric, value] : entries(path, group, node)) {
        if (std::find(known.begin(), known.end(), metric) == known.end()) {
            refuse(path, value, group + ": unknown metric \"" + metric + "\"");
        }
        Limit limit;
        bool has_good = false, has_reject = false;
        const std::string place = group + ": " + metric;
        for (const auto& [key, bound] : entries(path, place, value)) {
            if (key != "good" && key != "reject")
                refuse(path, bound, place + ": unknown key \"" + key + "\"");
            (key == "good" ? limit.good : limit.reject) = number(path, place + ": " + key, bound);
            (key == "good" ? has_good : has_reject) = true;
        }
        if (!has_good || !has_reject) refuse(path, value, place + ": needs both good and reject");
        if (limit.reject < limit.good) refuse(path, value, place + ": reject must not be below good");
        limits[metric] = limit;
    }
}

}  // namespace

const Limit* Limits::find(const std::string& metric, ShiftKind kind) const {
    const auto look = [&metric](const std::map<std::string, Limit>& group) {
        const auto place = group.find(metric);
        return place == group.end() ? nullptr : &place->second;
    };
    const Limit* own = kind == ShiftKind::launch    ? look(launch)
                       : kind == ShiftKind::shuttle ? look(shuttle)
                                                    : nullptr;
    return own != nullptr ? own : look(shift);
}

const std::vector<std::string>& metric_names() {
    static const std::vector<std::string> names{"duration_s",
                                                "peak_acceleration_change_m_s2",
                                                "vdv_m_s1_75",
                                                "speed_dip_percent",
                                                "clutch_energy_j",
                                                "clutch_peak_power_w",
                                                "clutch_temperature_degc",
                                                "torque_hole_percent",
                                                "slip_time_s",
                                                "peak_jerk_m_s3",
                                                "fill_time_s",
                                                "torque_phase_s",
                                                "inertia_phase_s",
                                                "flare_rad_s",
                                                "tie_up_torque_nm"};
    return names;
}

Limits default_limits() {
    static const Limits limits = parse_limits(std::string(limits_text), "config/limits.yaml");
    return limits;
}

Limits parse_limits(const std::string& text, const std::string& path) {
    YAML::Node root;
    try {
        root = YAML::Load(text);
    } catch (const YAML::ParserException& error) {
        throw io::InputError(path, error.mark.line + 1, error.mark.column + 1, error.msg);
    }
    if (root.IsNull()) throw io::InputError(path, 1, 1, "the file is empty");
    Limits limits;
    for (const auto& [key, value] : entries(path, "limits", root)) {
        if (key == "rules") {
            read_rules(path, value, limits.rules);
        } else if (key == "shift") {
            read_group(path, key, value, limits.shift);
        } else if (key == "launch") {
            read_group(path, key, value, limits.launch);
        } else if (key == "shuttle") {
            read_group(path, key, value, limits.shuttle);
        } else {
            refuse(path, value, "unknown key \"" + key + "\"");
        }
    }
    return limits;
}

Limits read_limits(const std::string& path) {
    return parse_limits(io::read_text(path), path);
}

}  // namespace shiftrig::analysis
