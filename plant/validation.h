// What must hold for a description before anything is built from it.
#pragma once

#include "plant/description.h"

namespace shiftrig::plant {

// Throws ModelError naming device, field and rule at the first thing that is wrong.
void validate(const Description& description);

}  // namespace shiftrig::plant
