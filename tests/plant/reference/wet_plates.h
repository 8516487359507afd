// Wet plates behind valves and pistons for the reference solver, and the oil that both depend on.
#pragma once

#include <functional>
#include <string>

#include "tests/plant/reference/fields.h"

namespace shiftrig::reference {

using Tell = std::function<Told(const std::string& input, double initial)>;

// Gives the pairs of clutches with wet plates, which `system` has in their places, their laws until the time `until`.
void add_wet_plates(System& system, const plant::Description& description, const Tell& told, double until);

}  // namespace shiftrig::reference
