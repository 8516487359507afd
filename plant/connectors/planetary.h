// Planetary row: a rigid device with three links. One column of the distribution matrix (structure.h).
#pragma once

#include <array>
#include <string>
#include <vector>

#include "plant/connectors/connector.h"

namespace shiftrig::plant {

// Planetary row: Willis ω_sun − u·ω_ring − (1 − u)·ω_carrier = 0, u = u12 with the carrier held
// (negative for a simple row).
struct Planetary {
    std::string name, sun, ring, carrier;
    double ratio = 0;
    double efficiency = 1;  // η0 of the meshes with the carrier held
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
