// To the instant at which a device changes its state, by parts of a step that end there. Internal to plant/.
#pragma once

#include "plant/transitions.h"

namespace shiftrig::plant::detail {

constexpr double instant = 1e-10;  // parts of a step shorter than this are none

// Does the device change where the part begins? `length` of the part just computed, as a share of the step.
bool changes_at_once(const Work& work, const Crossing& crossing, double length) SHIFTRIG_REALTIME;

struct Approached {
    double fraction = 0;  // of the step; `end` is there
    bool found = true;    // the margin is as near to nothing there as it has to be
};

// From the part just computed, between the fractions `done` and `until` of the step, across whose end the device does not
// hold: takes it anew to where its margin vanishes.
Approached approach(Work& work, const Mode& mode, const Crossing& crossing, double done,
                    double until) SHIFTRIG_REALTIME;

}  // namespace shiftrig::plant::detail
