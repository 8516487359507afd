#include "rt/loop.h"

#include <algorithm>

namespace shiftrig::rt {

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
