// A judged shift as the pages show it: labels, units and limits beside the values.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "analysis/scorecard.h"

namespace shiftrig::analysis {

// {from, to, kind, command_s, end_s, completed, verdict, phases: [{name, from, to}],
//  metrics: [{name, label, value | null, unit, good, reject, verdict}]}; times in seconds of the run.
nlohmann::json shift_page(const Run& run, const ShiftScore& score, const Limits& limits);
nlohmann::json shift_pages(const Run& run, const Scorecard& scorecard, const Limits& limits);

}  // namespace shiftrig::analysis
