// Linear damper between two masses or to the housing: the drag of bearings and oil.
//
//     M = d (ω_a − ω_b), ω_b = 0 for the housing      column (a: 1, b: −1)
//     dissipated d (ω_a − ω_b)²
//
//   M     torque on the first link, from a into the damper      Nm (N on a body that moves straight on)
//   d     damping                                               Nm s/rad (N s/m), > 0
//
// Linear, so it is part of L of the mode and no damping limits the step.
// Source: viscous (Newtonian) shear. It shows no outputs of its own; what it takes is in energy.dissipated.
// Does not model: dry friction (a brake with a dry law), drag that grows with the square of the speed (source.h), drag of an
// open clutch by the oil's temperature (laws/oil.h).
#pragma once

#include <array>
#include <string>
#include <vector>

#include "plant/connectors/connector.h"

namespace shiftrig::plant {

struct Damper {
    std::string name, a, b;  // b empty: to the housing
    double damping = 0;      // [Nm s/rad], > 0
};

// ---- what it answers (connector.h)

inline const char* kind(const Damper&) {
    return "damper";
}
inline std::array<End, 2> ends(const Damper& c) {
    return {End{"a", c.a},
            End{.field = "b", .mass = c.b, .may_be_housing = true, .motion = EndMotion::alike}};
}
void check_parameters(const Check& check, const Damper& device);
void assemble(Assembly& assembly, const Damper& device);

}  // namespace shiftrig::plant
