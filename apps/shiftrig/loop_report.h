// The loop's report as people and programs read it; shared by every command that runs a loop.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "rt/loop.h"
#include "rt/thread.h"

namespace shiftrig::cli {

// {"outcome", "executed", "skipped", "late", …, "wake_up_ns": {"p50", "p90", "p99", "p99_9", "max", "count"},
// …}
nlohmann::json to_json(const rt::LoopReport& report);
nlohmann::json to_json(const rt::Histogram& histogram);
nlohmann::json to_json(const rt::Refusals& refusals);

// Some lines: counts, then percentiles of wake-up, lateness, step and response as far as recorded.
std::string describe(const rt::LoopReport& report);

// Why the loop gave up; empty if it came to its end, or to where somebody stopped it.
std::string gave_up(const rt::LoopReport& report);

}  // namespace shiftrig::cli
