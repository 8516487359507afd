#include "rt/loop.h"

#include <algorithm>

namespace shiftrig::rt {

const char* name(Outcome outcome) noexcept {
    switch (outcome) {
        case Outcome::completed:
            return "completed";
        case Outcome::stopped:
            return "stopped";
        case Outcome::too_far_behind:
            return "too_far_behind";
        case Outcome::late_too_often:
            return "late_too_often";
    }
    return "";
}

void LoopReport::add(const LoopReport& later) {
    outcome = later.outcome;
    for (std::int64_t LoopReport::*count :
         {&LoopReport::executed, &LoopReport::skipped, &LoopReport::late, &LoopReport::late_runs,
          &LoopReport::overruns, &LoopReport::unanswered, &LoopReport::clock_reversals, &LoopReport::anchors})
        this->*count += later.*count;
    longest_late_run = std::max(longest_late_run, later.longest_late_run);
    ended = later.ended;
    late_after = later.late_after;
    for (Histogram LoopReport::*durations :
         {&LoopReport::wake_up, &LoopReport::lateness, &LoopReport::step, &LoopReport::response})
        (this->*durations).merge(later.*durations);
}

}  // namespace shiftrig::rt
