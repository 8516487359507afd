// A result set: what one build, one calibration or one recording says of some runs, for compare.h.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "analysis/limits.h"

namespace shiftrig::analysis {

struct ResultSet {
    // {run name: shifts array}; null in place of a run that is not whole (a recording cut or damaged, a run that was stopped
    // or gave up, a scenario that could not be judged): there is nothing to be compared with it.
    nlohmann::json runs = nlohmann::json::object();
    std::map<std::string, std::string> not_whole;  // run name → why: one line
    std::vector<std::string> remarks;              // on what is compared all the same: a line each
};

// Reads a result set: a recording; a JSON file of `shiftrig run --json` or `shiftrig test --json` (an object with
// "shifts", or an array of such objects, or an object with them in "runs"); or a folder of such files. A run is called
// by its "scenario" or "name", else by its file. Throws InputError or RecordingError, also where two runs have one name, or
// none of them is whole.
ResultSet read_results(const std::string& path, const Limits& limits);

}  // namespace shiftrig::analysis
