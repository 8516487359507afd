// Pairs that slip nowhere, since others hold them: a brake that begins to press where another one holds already. Internal to
// plant/.
//
// Such a pair passes what it can on sliding, the others the rest. Once that is as much as the share that it would have as one of
// them, it holds it: [Algin] eq. (12) read backwards, since no slip that vanishes (eq. (13)) will tell. What it could hold
// before it slid does not count: it would let go again at once.
#pragma once

#include "plant/modes.h"
#include "plant/transitions.h"

namespace shiftrig::plant::detail {

inline bool is_wedged(const Work& work, const Mode& mode, int pair) noexcept {
    return slips(work.contact[pair]) && mode.bound[pair];
}

// What it would carry at the sample if it were locked, in the sense in which it pushes and beyond what it passes so, or others
// beyond what they hold [Nm]. Where the load has turned it locks in any case, and settle() looks further.
double wedged_excess(Work& work, const Mode& mode, int pair, Sample& sample) SHIFTRIG_REALTIME;

// May it lock at the sample? By more than rounding: what locks now is not to let go at once.
bool may_hold(Work& work, const Mode& mode, int pair, Sample& sample) SHIFTRIG_REALTIME;

}  // namespace shiftrig::plant::detail
