// A result set: what one build, one calibration or one recording says of some runs, for compare.h.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "analysis/limits.h"

namespace shiftrig::analysis {

// Reads a result set: a recording; a JSON file of `shiftrig run --json` or `shiftrig test --json` (an object with
// "shifts", or an array of such objects, or an object with them in "runs"); or a folder of such files. A run is called
// by its "scenario" or "name", else by its file. Result: {run name: shifts array}. Throws InputError or RecordingError,
// also where two runs have one name, or one is not whole: a recording cut or damaged, a run that was stopped or gave up,
// a scenario that could not be judged.
nlohmann::json read_results(const std::string& path, const Limits& limits);

}  // namespace shiftrig::analysis
