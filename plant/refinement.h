// Is a part of a step short enough for what happens in it? Internal to plant/.
#pragma once

#include "plant/forces.h"

namespace shiftrig::plant::detail {

// After advance(): do shafts swing within the part, or do forces that depend on the motion change so fast, that
// its few samples do not show it? The exponential step takes linear motion exactly at any length, but not the instants at which
// contacts change, nor forces taken from the stages; that along the tree does not take swings exactly either.
// `shortest`: so much so that it is told of, since no shorter part is allowed.
bool is_coarse(Work& work, const Mode& mode, bool shortest = false) SHIFTRIG_REALTIME;

// Where between begin and end a law first comes upon a knot (of a friction table, of a converter, of an engine's curve or its
// governor's limits), beyond which the part's few samples would see another slope. 1: nowhere.
double look_for_knots(const Work& work) SHIFTRIG_REALTIME;
inline double first_knot(const Work& work) SHIFTRIG_REALTIME {
    const ModelData& m = work.model;
    return m.tabled_pairs.empty() && m.converters.empty() && m.engines.empty() ? 1 : look_for_knots(work);
}

}  // namespace shiftrig::plant::detail
