// What a step cannot resolve: a machine with bodies too light for the forces on them. Internal to plant/.
//
// Inertias, shafts and dampers are exact at any step; forces are taken from a few samples of the shortest part of a step
// (h over maximum_parts, in which `step` halves it). Two things can be too fast for these:
//
//   a force that answers the speed of its body     time of the answer < part     it overshoots, at a few parts without end
//   friction on a body that swings on its shaft    ω part > 2 (ARK3: 0.3)        its reversals are missed
//
// The bounds are measured (docs/mechanics.md, One step).
#pragma once

#include <string>
#include <vector>

#include "plant/modal.h"
#include "plant/plant.h"

namespace shiftrig::plant {

// A contact state that `check` looks at, and its modes.
struct LookedAt {
    GearVariant state;
    ModalResult modal;
    std::string label;  // "gear F2/M", "all open"
    bool is_gear = false;
};

void warn_of_what_steps_miss(const Model& model, const std::vector<LookedAt>& states,
                             std::vector<std::string>& warnings);

}  // namespace shiftrig::plant
