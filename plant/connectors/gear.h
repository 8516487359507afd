// Fixed-axis gear: a rigid device, with losses or without.
//
//     ω_a = u ω_b                                             kinematics, column (a: 1, b: −u)
//     M_b = −û M_a + u o s,   û = u η^x                       torques, with losses
//     x = sign((M_a − κ s) s),   s = sign ω_a                 +1: a drives, η and o as given; −1: b does, 1/η' and o'
//     κ = (o' − o)/(1/η' − η), o/2 where both are 1           where both losses agree (Mesh::loss_kink)
//
//   M_a, M_b   torques from the masses into the gear          Nm (N on a body that moves straight on)
//   ω_a, ω_b   speeds of the links                            rad/s (m/s)
//   u          ratio ω_a/ω_b                                  1 (1/m to a body), negative where the senses differ; not 0
//   η, η'      efficiency where a drives, where b does        1, in (0, 1]
//   o, o'      load-independent friction, referred to a       Nm, ≥ 0
//
// The power lost is ((1 − η^x) M_a + o s) ω_a, not negative. At ω_a = 0 the loss takes whatever it has to, up to its limit in
// either direction: contact states in contact.h, limits in rest_problem.h.
// Source: [Algin] eq. (16)–(25).
// Does not model: elasticity and play of the teeth (put a shaft or a backlash beside it), losses that depend on speed or oil,
// churning (put a damper on the mass).
#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "plant/connectors/connector.h"

namespace shiftrig::plant {

struct Gear {
    std::string name, a, b;
    double ratio = 0;           // [1], negative for an external pair drawn with its sign; not 0
    double efficiency = 1;      // (0, 1]
    double bearing_torque = 0;  // ≥ 0 [Nm] load-independent friction behind the mesh, referred to link a
    // The same two where b drives, if they differ: M_b = −u (M_a/η − bearing).
    double backward_efficiency = 0;       // 0: as efficiency
    double backward_bearing_torque = -1;  // negative: as bearing_torque
    // Selectable ratios (a range group): names and ratios; `ratio` is the one in use.
    std::vector<std::pair<std::string, double>> options;
};

// ---- what it answers (connector.h)

inline const char* kind(const Gear&) {
    return "gear";
}
inline std::array<End, 2> ends(const Gear& c) {
    return {End{"a", c.a}, End{"b", c.b}};
}
void check_parameters(const Check& check, const Gear& device);
void assemble(Assembly& assembly, const Gear& device);
void name_outputs(detail::ModelBuilder& builder, const std::vector<Gear>& devices);
double* show(const detail::Shown& at, const std::vector<Gear>& devices, double* next) SHIFTRIG_REALTIME;

}  // namespace shiftrig::plant
