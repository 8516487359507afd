// A change of state in JSON, the same in every command: what io::event_json says of a device's, and of the bench's own
// time_s, kind and device "", each with its words in `text`.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "analysis/run.h"

namespace shiftrig::analysis {

nlohmann::json to_json(const Change& change);

}  // namespace shiftrig::analysis
