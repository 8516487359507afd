// The scorecard: every shift of a run with its metrics and a verdict on each. The formulas stand in
// docs/shift-quality.md and above the functions in metrics.cpp.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "analysis/limits.h"
#include "analysis/run.h"
#include "analysis/shifts.h"

namespace shiftrig::analysis {

enum class Verdict { good, acceptable, reject, told };  // told: has no limit
std::string_view name(Verdict verdict);

struct Metric {
    std::string name;             // "duration_s", "clutch_energy_j"
    std::string clutch;           // of a metric per clutch, else empty
    std::optional<double> value;  // none: it has no meaning in this shift, or its signals are missing
    Verdict verdict = Verdict::told;
    std::string full_name() const {
        return clutch.empty() ? name : name + "." + clutch;
    }  // as scenarios write it
};

struct ShiftScore {
    Shift shift;
    std::vector<Metric>
        metrics;  // in the order tractor drivers rank them, then the per-clutch ones, then the rest
    Verdict verdict = Verdict::good;  // not completed: reject; else the worst of its metrics

    const Metric* find(std::string_view full_name) const noexcept;
};

struct Scorecard {
    std::vector<ShiftScore> shifts;
    Verdict verdict = Verdict::good;  // the worst
};

Scorecard score(const Run& run, const Limits& limits = default_limits());

// The metrics of one shift between two of the run's gears, not yet judged (metrics.cpp).
std::vector<Metric> measure(const Run& run, const std::vector<Gear>& gears, const Shift& shift);

// An array of {from, to, kind, completed, end, asked_s, ended_s, verdict, duration_s, …,
// clutch_energy_j: {F2: …, F3: …}, …, verdicts: {duration_s: "good", "clutch_energy_j.F3": "reject"}}.
nlohmann::json to_json(const Scorecard& scorecard);
// A table for a terminal, one column per shift.
std::string to_text(const Scorecard& scorecard);

}  // namespace shiftrig::analysis
