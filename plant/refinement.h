// Is a part of a step short enough for what happens in it? Internal to plant/.
#pragma once

#include "plant/forces.h"

namespace shiftrig::plant::detail {

// After advance(): do shafts swing within the part, or do forces that depend on the motion change so fast, that
// its few samples do not show it? Linear motion is exact at any length; finding the instants at which contacts change
// is not, nor are forces taken from the stages.
bool is_coarse(Work& work, const Mode& mode) SHIFTRIG_REALTIME;

// Where between begin and end the first slip comes upon a knot of its friction table, beyond which the part's few samples
// would see another slope. 1: nowhere.
double first_knot(const Work& work) SHIFTRIG_REALTIME;

}  // namespace shiftrig::plant::detail
