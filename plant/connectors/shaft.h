// Elastic shaft with a damper beside it, between two masses or from one to the housing.
//
//     M = k φ + d φ̇,   φ̇ = ω_a − ω_b                 column (a: 1, b: −1)
//     stored ½ k φ², dissipated d φ̇²
//
//   M     torque on the first link, from a into the shaft       Nm (N between bodies that move straight on)
//   φ     twist (state)                                         rad (m), positive where a is ahead of b
//   k     stiffness                                             Nm/rad, > 0
//   d     damping                                               Nm s/rad, ≥ 0
//
// Linear, so it is part of L of the mode and no stiffness limits the step.
// Source: [Algin] eq. (14).
// Does not model: its own inertia (share it between the masses), stiffness that changes with the twist, hysteresis; play is
// backlash.h.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "plant/connectors/connector.h"

namespace shiftrig::plant {

struct Shaft {
    std::string name, a, b;    // b empty: to the housing
    double stiffness = 0;      // [Nm/rad], > 0
    double damping = 0;        // [Nm s/rad], ≥ 0
    double initial_twist = 0;  // [rad], positive where a is ahead of b
};

// ---- what it answers (connector.h)

inline const char* kind(const Shaft&) {
    return "shaft";
}
inline std::array<End, 2> ends(const Shaft& c) {
    return {End{"a", c.a},
            End{.field = "b", .mass = c.b, .may_be_housing = true, .motion = EndMotion::alike}};
}
void check_parameters(const Check& check, const Shaft& device);
void assemble(Assembly& assembly, const Shaft& device);
void name_outputs(detail::ModelBuilder& builder, const std::vector<Shaft>& devices);
double* show(const detail::Shown& at, const std::vector<Shaft>& devices, double* next) SHIFTRIG_REALTIME;

}  // namespace shiftrig::plant
