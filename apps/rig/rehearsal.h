// A rehearsal before a run by the clock: the modes that the run will most likely meet are built before the first tick.
//
// A mode's matrices are built by the tick that first meets the mode, which makes that tick a good many times as long
// as the others (docs/real-time.md). They are a pure function of model, step size and mode, so building them
// beforehand changes no bit of the run but `certificate.mode_misses`, which counts them.
#pragma once

#include <cstdint>

#include "apps/rig/rig.h"

namespace shiftrig::rig {

// A twin of the rig lives through the scenario as fast as it goes, at most `most_ticks` of it, on the in-process bus: with
// the rig's built-in controller or candump log, or with the shipped controller in place of one in another process. The
// twin's modes become the rig's. Returns the ticks rehearsed: 0 without a scenario. Not while the loop runs.
std::int64_t rehearse(Rig& rig, std::int64_t most_ticks);

}  // namespace shiftrig::rig
