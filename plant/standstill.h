// Devices at rest that hold one another: which of them stay, and which go. Internal to plant/.
#pragma once

#include "plant/forces.h"

namespace shiftrig::plant::detail {

// At an instant every pair and every lossy mesh at rest either stays so, with a torque within its limits, or goes, with the
// torque of the limit that it gave way to: a linear complementarity problem between accelerations and what is left
// of the limits. Where closed loops hold, one device at a time cannot find its solution: the load passes from pairs to
// meshes and back, and what moves in the end may be a pair that has never been at its limit alone.
//
// Solves it for everything at rest at the sample in the piece around device `around` (piece.h; −1: the whole machine), and puts the
// contact states that follow into place. `gives_way`, a locked pair or −1, is at its limit whatever the last digits of its
// torque say. Where both rest and motion are solutions, what rests stays at rest. `among_losses`: that meshes of one motion share their losses in another way is a change as well.
enum class Rearrangement {
    none,    // no solution other than the states there are
    stands,  // others carry the load, nothing moves
    moves,
};
Rearrangement rearrange(Work& work, int gives_way, int around, Sample& sample,
                        bool among_losses = false) SHIFTRIG_REALTIME;

}  // namespace shiftrig::plant::detail
