// The driveline as Graphviz text, for those who lay out and style their own drawings.
#pragma once

#include <string>

#include "plant/description.h"

namespace shiftrig::analysis {

std::string driveline_dot(const plant::Description& machine);

}  // namespace shiftrig::analysis
