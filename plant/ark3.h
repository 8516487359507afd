// The implicit–explicit Runge–Kutta step of order 3, ARK3(2)4L[2]SA of [Kennedy], on the tree of rigid groups (tree.h):
// for long chains, where one step must cost O(N). L-stable in the shafts, explicit in the forces. Internal.
#pragma once

#include "plant/forces.h"

namespace shiftrig::plant::detail {

// The diagonal of its implicit table: the stage matrix is M + hγ D + (hγ)² K.
inline constexpr double ark3_gamma = 1767732205903. / 4055673282236;

// Swings are looked after where the embedded method differs by more than the first, as a share of the way that the
// fastest mass turns in the step. It differs by 0.0062 (hω)² hΔω, so never where hω is below the second.
inline constexpr double ark3_swing_tolerance = 1e-7, ark3_slow_swing = 2.8e-3;

// As advance() of etd3.h: from the settled `begin` to `end_fraction` of the step in the mode; fills end, with forces
// and internal torques. Of half it knows the time.
void advance_tree(Work& work, const Mode& mode, double end_fraction) SHIFTRIG_REALTIME;

// The half sample of the part just computed, by Hermite's cubic, for the search of the instant at which a locked pair gives
// way.
void tree_half(Work& work, const Mode& mode) SHIFTRIG_REALTIME;

// The middle sample of the part just computed, as book() of ledger.h needs it, by Hermite's cubic. Returns the energy lost in dampers of shafts and to the housing [J].
double tree_middle(Work& work, const Mode& mode) SHIFTRIG_REALTIME;

}  // namespace shiftrig::plant::detail
