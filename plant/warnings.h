// What a careful engineer would like to hear about his machine before anything turns: what `check` warns about.
#pragma once

#include <string>
#include <vector>

#include "plant/modal.h"
#include "plant/plant.h"

namespace shiftrig::plant {

// One sentence each: efficiencies below 0.5, rigid parts that hold masses at rest for ever, initial speeds that contradict rigid
// parts, what a step of the model's size cannot resolve (resolution.h), gear paths that block their own output, loops of them
// that share torque in no unique way, damped modes that an engine's main order meets between idle and high idle.
std::vector<std::string> model_warnings(const Model& model);

// Where the description's initial speeds contradict gears, rows or pairs locked at the start: which, and what the run begins
// with. Empty: nowhere.
std::string initial_speed_warning(const Model& model);

}  // namespace shiftrig::plant
