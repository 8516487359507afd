// Elastic shaft with a damper beside it, between two masses or from one to the housing.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "plant/connectors/connector.h"

namespace shiftrig::plant {

// Elastic shaft with its parallel damper, [Algin] eq. (14): M = stiffness·twist + damping·(ω_a − ω_b).
struct Shaft {
    std::string name, a, b;    // b empty: to the housing
    double stiffness = 0;      // [Nm/rad]
    double damping = 0;        // [Nm s/rad]
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
