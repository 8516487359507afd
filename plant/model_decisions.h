// The last part of building a Model: what its sizes and laws decide together. Internal to plant/.
#pragma once

#include "plant/model_data.h"

namespace shiftrig::plant::detail {

// How many events and parts a step may have at most: as described, or as stiff flanks and steep friction need.
void bound_step(ModelData& model);

// The tree of the engine for long chains where that is to be used, and why so. Throws ModelError where the machine asks for
// it and is none.
void choose_engine(ModelData& model);

// Constants of the loops over heated clutches and pick-ups, side by side.
void build_device_numbers(ModelData& model);

// Where everything is in the State block.
void build_layout(ModelData& model);

}  // namespace shiftrig::plant::detail
