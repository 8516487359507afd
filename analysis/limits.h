// What is good and what is to be rejected in a shift, per metric: config/limits.yaml, or a
// file like it. Limits for launches and shuttles may differ from those of shifts between forward gears.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "analysis/shifts.h"

namespace shiftrig::analysis {

// A metric is good up to `good`, to be rejected beyond `reject`, acceptable between.
struct Limit {
    double good = 0, reject = 0;
};

struct Limits {
    ShiftRules rules;
    std::map<std::string, Limit> shift;    // by metric: "duration_s"; per clutch: "clutch_energy_j"
    std::map<std::string, Limit> launch;   // what differs for launches
    std::map<std::string, Limit> shuttle;  // what differs for shuttles

    // nullptr: the metric is told, not judged.
    const Limit* find(const std::string& metric, ShiftKind kind) const;
};

// config/limits.yaml as it was when the program was built.
Limits default_limits();

// Every metric there is: [0] = "duration_s", … in the order of the scorecard.
const std::vector<std::string>& metric_names();

// Throws io::InputError naming file, line, key and rule. Metrics not in the file are not judged.
Limits read_limits(const std::string& path);
Limits parse_limits(const std::string& text, const std::string& path);

}  // namespace shiftrig::analysis
