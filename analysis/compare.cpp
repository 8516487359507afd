#include "analysis/compare.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

namespace shiftrig::analysis {

namespace {

using nlohmann::json;

// A metric's value by full name ("clutch_energy_j.F3"); NaN where the shift has none. Nothing where it cannot be
// compared: the temperature of a clutch that is not told.
std::optional<double> value_of(const json& shift, const std::string& full_name) {
    const auto dot = full_name.find('.');
    const std::string metric = full_name.substr(0, dot);
    const auto found = shift.find(metric);
    if (dot == std::string::npos)
        return found != shift.end() && found->is_number() ? found->get<double>() : std::nan("");
    if (found != shift.end()) {
        const auto part = found->find(full_name.substr(dot + 1));
        if (part != found->end()) return part->is_number() ? part->get<double>() : std::nan("");
    }
    // Clutches beside the shift's own are told only once they take heat.
    if (metric == "clutch_temperature_degc") return std::nullopt;
    return 0;
}

// Full names of the metrics that one of two shifts has, in the scorecard's order.
std::vector<std::string> metrics_of(const json& before, const json& after) {
    std::vector<std::string> names;
    for (const std::string& metric : metric_names()) {
        std::set<std::string> found;
        for (const json* shift : {&before, &after}) {
            const auto place = shift->find(metric);
            if (place == shift->end()) continue;
            if (!place->is_object()) found.insert(metric);
            for (auto part = place->begin(); place->is_object() && part != place->end(); ++part)
                found.insert(metric + "." + part.key());
        }
        names.insert(names.end(), found.begin(), found.end());
    }
    return names;
}

ShiftKind kind_of(const json& shift) {
    const std::string text = shift.value("kind", "");
    for (const ShiftKind kind : {ShiftKind::launch, ShiftKind::shuttle}) {
        if (text == name(kind)) return kind;
    }
    return ShiftKind::power_upshift;  // the limits are the same for the others
}

// "F2->F3", from the second on "F2->F3 (2)".
std::map<std::string, const json*> by_label(const json& shifts) {
    std::map<std::string, int> count;
    std::map<std::string, const json*> result;
    for (const json& shift : shifts) {
        std::string label = shift.value("from", "?") + "->" + shift.value("to", "?");
        const int number = ++count[label];
        if (number > 1) label += " (" + std::to_string(number) + ")";
        result[label] = &shift;
    }
    return result;
}

std::string number(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.4g", value);
    return std::isnan(value) ? "no value" : text;
}

class Comparison {
  public:
    Comparison(const Limits& limits, const Tolerance& tolerance) : limits_(limits), tolerance_(tolerance) {}

    void runs(const std::string& run, const json& before, const json& after) {
        if (before.is_null() || after.is_null()) return;
        const auto old_shifts = by_label(before), new_shifts = by_label(after);
        for (const auto& [label, shift] : old_shifts) {
            const auto same = new_shifts.find(label);
            if (same == new_shifts.end()) {
                list.push_back({Difference::Kind::missing, run, label, "", 0, 0});
            } else {
                shifts(run, label, *shift, *same->second);
            }
        }
        for (const auto& [label, shift] : new_shifts) {
            if (old_shifts.count(label) == 0) list.push_back({Difference::Kind::added, run, label, "", 0, 0});
        }
    }

    std::vector<Difference> list;

  private:
    void shifts(const std::string& run, const std::string& label, const json& before, const json& after) {
        const bool was = before.value("completed", false), is = after.value("completed", false);
        if (was != is) {
            list.push_back({is ? Difference::Kind::better : Difference::Kind::worse, run, label, "completed",
                            was ? 1. : 0., is ? 1. : 0.});
        }
        for (const std::string& metric : metrics_of(before, after)) {
            const Limit* limit = limits_.find(metric.substr(0, metric.find('.')), kind_of(before));
            const std::optional<double> x = value_of(before, metric), y = value_of(after, metric);
            if (limit == nullptr || !x || !y || !differ(*x, *y, *limit)) continue;
            const bool worse = std::isnan(*y) || *y > *x;
            list.push_back(
                {worse ? Difference::Kind::worse : Difference::Kind::better, run, label, metric, *x, *y});
        }
    }
    bool differ(double x, double y, const Limit& limit) const {
        if (std::isnan(x) || std::isnan(y)) return std::isnan(x) != std::isnan(y);
        return std::abs(y - x) > tolerance_.relative * std::max(std::abs(x), 0.1 * limit.good);
    }

    const Limits& limits_;
    const Tolerance& tolerance_;
};

}  // namespace

std::string Difference::text() const {
    const std::string head = run + " " + shift + ": ";
    if (kind == Kind::missing) return head + "no longer there";
    if (kind == Kind::added) return head + "was not there before";
    const char* verdict = kind == Kind::worse ? "worse" : "better";
    if (metric == "completed") {
        return head + (after > 0 ? "now completed, " : "no longer completed, ") + verdict;
    }
    std::string change;
    if (before != 0 && !std::isnan(after - before)) {
        char percent[32];
        std::snprintf(percent, sizeof percent, " (%+.1f %%)", 100 * (after - before) / std::abs(before));
        change = percent;
    }
    return head + metric + " " + number(before) + " → " + number(after) + change + ", " + verdict;
}

std::vector<Difference> compare(const json& before, const json& after, const Limits& limits,
                                const Tolerance& tolerance) {
    Comparison comparison(limits, tolerance);
    if (before.size() == 1 && after.size() == 1) {
        comparison.runs(after.begin().key(), before.begin().value(), after.begin().value());
    } else {
        for (auto run = before.begin(); run != before.end(); ++run) {
            comparison.runs(run.key(), run.value(), after.value(run.key(), json::array()));
        }
        for (auto run = after.begin(); run != after.end(); ++run) {
            if (!before.contains(run.key())) comparison.runs(run.key(), json::array(), run.value());
        }
    }
    std::stable_sort(
        comparison.list.begin(), comparison.list.end(), [](const Difference& a, const Difference& b) {
            const auto rank = [](const Difference& d) {
                return d.kind == Difference::Kind::missing ? 0 : d.kind == Difference::Kind::worse ? 1 : 2;
            };
            return rank(a) < rank(b);
        });
    return std::move(comparison.list);
}

}  // namespace shiftrig::analysis
