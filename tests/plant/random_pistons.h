// Random machines whose wet clutches have pistons to be filled, several of them at one pump.
#pragma once

#include "tests/plant/random_systems.h"

namespace shiftrig {

// A random system or a random vehicle with wet clutches in place of most of its own. Their commands fill in a pulse and hold at the kiss
// point, step, climb stairs, wave through the return pressure, stop half way, dip, let go and fill again before all has flowed
// out; many in the same instants, in warm or cold oil, at a pump with less than they ask for or without limit.
RandomSystem random_machine_with_pistons(std::uint64_t seed, double seconds);

}  // namespace shiftrig
