// Planetary row: a rigid device with three links.
//
//     ω_s − u ω_r − (1 − u) ω_c = 0                            Willis, column (sun: 1, ring: −u, carrier: −(1 − u))
//     M_r = −û M_s,   M_c = −(1 − û) M_s,   û = u η₀^x         torques, with losses; M_s + M_r + M_c = 0
//     x = sign(M_s (ω_s − ω_c))                                +1: the sun drives, seen from the carrier
//
//   M_s, M_r, M_c   torques from sun, ring, carrier into the row    Nm
//   ω_s, ω_r, ω_c   their speeds                                    rad/s
//   u               ω_s/ω_r with the carrier held                   1, negative for a simple row (−z_ring/z_sun); not 0, not 1
//   η₀              efficiency of the meshes, carrier held          1, in (0, 1]
//
// The power lost is (1 − η₀^x) M_s (ω_s − ω_c), not negative: a row that turns as one loses nothing. At ω_s = ω_c under load it
// sticks, as a gear does at rest.
// Source: [Algin] eq. (16)–(25).
// Does not model: single planets and their bearings, inertia of the planets about their own axes, play, elasticity.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "plant/connectors/connector.h"

namespace shiftrig::plant {

struct Planetary {
    std::string name, sun, ring, carrier;
    double ratio = 0;       // u [1], not 0, not 1
    double efficiency = 1;  // η₀ (0, 1]
};

// ---- what it answers (connector.h)

inline const char* kind(const Planetary&) {
    return "planetary row";
}
inline std::array<End, 3> ends(const Planetary& p) {
    return {End{"sun", p.sun, false, "sun"}, End{"ring", p.ring, false, "ring", EndMotion::alike},
            End{"carrier", p.carrier, false, "carrier", EndMotion::alike}};
}
void check_parameters(const Check& check, const Planetary& device);
void assemble(Assembly& assembly, const Planetary& device);
void name_outputs(detail::ModelBuilder& builder, const std::vector<Planetary>& devices);
double* show(const detail::Shown& at, const std::vector<Planetary>& devices, double* next) SHIFTRIG_REALTIME;

}  // namespace shiftrig::plant
