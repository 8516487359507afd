#include "analysis/compare.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "analysis/load_run.h"
#include "analysis/scorecard.h"
#include "io/input_error.h"
#include "io/recording/reader.h"
#include "io/recording/rebuild.h"

namespace shiftrig::analysis {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

std::string stem(const fs::path& path) {
    const std::string file = path.filename().string();
    return file.substr(0, file.find('.'));
}

// Adds the runs of one JSON document to `results`.
void take(const json& document, const std::string& name, const std::string& path, json& results) {
    if (document.is_array()) {
        for (std::size_t i = 0; i < document.size(); ++i)
            take(document[i], name + "#" + std::to_string(i + 1), path, results);
    } else if (document.is_object() && document.contains("shifts") && document["shifts"].is_array()) {
        std::string own = name;
        for (const char* key : {"name", "scenario"}) {
            if (document.contains(key) && document[key].is_string())
                own = stem(document[key].get<std::string>());
        }
        results[own] = document["shifts"];
    } else if (document.is_object() && document.contains("runs")) {
        take(document["runs"], name, path, results);
    } else if (document.is_object() && document.contains("scenarios")) {
        take(document["scenarios"], name, path, results);
    } else {
        throw io::InputError(
            path + ": no \"shifts\" in it; must be a result of run --json or test --json, or a recording");
    }
}

void read_file(const fs::path& path, const Limits& limits, json& results) {
    if (io::looks_like_recording(path.string())) {
        const plant::Description machine =
            io::recorded_model_file(io::RecordingReader(path.string()).manifest()).description;
        results[stem(path)] = to_json(score(load_run(path.string(), scorecard_signals(machine)), limits));
        return;
    }
    std::ifstream file(path);
    const json document = json::parse(file, nullptr, false);
    if (document.is_discarded()) throw io::InputError(path.string() + ": neither a recording nor JSON");
    take(document, stem(path), path.string(), results);
}

// A metric's value by full name ("clutch_energy_j.F3"), if the shift has it.
std::optional<double> value_of(const json& shift, const std::string& full_name) {
    const auto dot = full_name.find('.');
    const auto found = shift.find(full_name.substr(0, dot));
    if (found == shift.end()) return std::nullopt;
    if (dot == std::string::npos)
        return found->is_number() ? std::optional(found->get<double>()) : std::nullopt;
    const auto part = found->find(full_name.substr(dot + 1));
    return part != found->end() && part->is_number() ? std::optional(part->get<double>()) : std::nullopt;
}

// Full names of a shift's metrics that are there, in the scorecard's order.
std::vector<std::string> metrics_of(const json& shift) {
    std::vector<std::string> names;
    for (const std::string& metric : metric_names()) {
        const auto found = shift.find(metric);
        if (found == shift.end()) continue;
        if (!found->is_object()) names.push_back(metric);
        for (auto part = found->begin(); found->is_object() && part != found->end(); ++part) {
            names.push_back(metric + "." + part.key());
        }
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

class Comparison {
  public:
    Comparison(const Limits& limits, const Tolerance& tolerance) : limits_(limits), tolerance_(tolerance) {}

    void runs(const std::string& run, const json& before, const json& after) {
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
        for (const std::string& metric : metrics_of(before)) {
            const Limit* limit = limits_.find(metric.substr(0, metric.find('.')), kind_of(before));
            const std::optional<double> x = value_of(before, metric), y = value_of(after, metric);
            if (limit == nullptr || !x || !y) continue;
            const double scale = std::max(std::abs(*x), 0.1 * limit->good);
            if (!(std::abs(*y - *x) > tolerance_.relative * scale)) continue;
            list.push_back(
                {*y > *x ? Difference::Kind::worse : Difference::Kind::better, run, label, metric, *x, *y});
        }
    }

    const Limits& limits_;
    const Tolerance& tolerance_;
};

}  // namespace

json read_results(const std::string& path, const Limits& limits) {
    json results = json::object();
    std::error_code error;
    if (!fs::is_directory(path, error)) {
        if (!fs::exists(path, error)) throw io::InputError(path + ": no such file");
        read_file(path, limits, results);
        return results;
    }
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(path)) {
        const std::string file = entry.path().filename().string();
        const bool wanted = file.find(".lcmlog") != std::string::npos || entry.path().extension() == ".json";
        if (entry.is_regular_file() && wanted) files.push_back(entry.path());
    }
    if (files.empty())
        throw io::InputError(path + ": no recording (*.lcmlog, *.lcmlog.zst) and no *.json in it");
    std::sort(files.begin(), files.end());
    for (const fs::path& file : files) read_file(file, limits, results);
    return results;
}

std::string Difference::text() const {
    const std::string head = run + " " + shift + ": ";
    if (kind == Kind::missing) return head + "no longer there";
    if (kind == Kind::added) return head + "was not there before";
    const char* verdict = kind == Kind::worse ? "worse" : "better";
    if (metric == "completed") {
        return head + (after > 0 ? "now completed, " : "no longer completed, ") + verdict;
    }
    char text[160];
    if (before != 0) {
        std::snprintf(text, sizeof text, "%s %.4g → %.4g (%+.1f %%), %s", metric.c_str(), before, after,
                      100 * (after - before) / std::abs(before), verdict);
    } else {
        std::snprintf(text, sizeof text, "%s %.4g → %.4g, %s", metric.c_str(), before, after, verdict);
    }
    return head + text;
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
