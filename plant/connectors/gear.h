// Fixed-axis gear: a rigid device, with losses or without. One column of the distribution matrix (structure.h).
#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "plant/connectors/connector.h"

namespace shiftrig::plant {

// Fixed-axis gear, u = u12 = ω_a/ω_b; efficiency η acts as û = u·η^x.
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
