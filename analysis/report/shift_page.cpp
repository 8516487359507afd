#include "analysis/report/shift_page.h"

#include <array>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

namespace shiftrig::analysis {

using nlohmann::json;

namespace {

// "peak_acceleration_change_m_s2" → {"peak acceleration change", "m/s²"}.
std::pair<std::string, std::string> label_and_unit(const std::string& name) {
    static constexpr std::array<std::pair<std::string_view, std::string_view>, 11> suffixes = {{
        {"_m_s1_75", "m/s¹·⁷⁵"},
        {"_m_s2", "m/s²"},
        {"_m_s3", "m/s³"},
        {"_rad_s", "rad/s"},
        {"_percent", "%"},
        {"_degc", "°C"},
        {"_nm", "Nm"},
        {"_pa", "Pa"},
        {"_j", "J"},
        {"_w", "W"},
        {"_s", "s"},
    }};
    std::string label = name, unit;
    for (const auto& [suffix, symbol] : suffixes)
        if (label.ends_with(suffix)) {
            label.resize(label.size() - suffix.size());
            unit = symbol;
            break;
        }
    for (char& c : label)
        if (c == '_') c = ' ';
    return {label, unit};
}

// Fill: from the first command to the kiss point; torque phase: from there; inertia phase: up to the end.
json phases(const Run& run, const ShiftScore& score) {
    json list = json::array();
    const auto length = [&](const char* metric) {
        const Metric* phase = score.find(metric);
        return phase && phase->value ? *phase->value : 0.0;
    };
    const auto add = [&](const char* phase, double from, double to) {
        if (to > from) list.push_back({{"name", phase}, {"from", from}, {"to", to}});
    };
    const double begun = run.time.at(score.shift.begun), kiss = begun + length("fill_time_s");
    add("fill", begun, kiss);
    add("torque phase", kiss, kiss + length("torque_phase_s"));
    add("inertia phase", score.shift.ended_at - length("inertia_phase_s"), score.shift.ended_at);
    return list;
}

}  // namespace

json shift_page(const Run& run, const ShiftScore& score, const Limits& limits) {
    json metrics = json::array();
    for (const Metric& metric : score.metrics) {
        const auto [label, unit] = label_and_unit(metric.name);
        const Limit* limit = limits.find(metric.name, score.shift.kind);
        metrics.push_back({{"name", metric.full_name()},
                           {"label", metric.clutch.empty() ? label : label + " " + metric.clutch},
                           {"value", metric.value ? json(*metric.value) : json()},
                           {"unit", unit},
                           {"good", limit ? json(limit->good) : json()},
                           {"reject", limit ? json(limit->reject) : json()},
                           {"verdict", name(metric.verdict)}});
    }
    return {{"from", score.shift.from},
            {"to", score.shift.to},
            {"kind", name(score.shift.kind)},
            {"command_s", score.shift.asked_at},
            {"end_s", score.shift.ended_at},
            {"end", name(score.shift.end)},
            {"completed", score.shift.completed()},
            {"verdict", name(score.verdict)},
            {"phases", phases(run, score)},
            {"metrics", metrics}};
}

json shift_pages(const Run& run, const Scorecard& scorecard, const Limits& limits) {
    json list = json::array();
    for (const auto& score : scorecard.shifts) list.push_back(shift_page(run, score, limits));
    return list;
}

}  // namespace shiftrig::analysis
