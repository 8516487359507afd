// Prescribed torque on a mass: test benches and reference problems.
//
//     T = T_w(t) + T_u − c ω |ω|
//
//   T     torque on the mass, into it                   Nm (N on a body that moves straight on), positive drives forward
//   T_w   of the waveform, the sum of its pieces        Nm; where it jumps a step is split
//   T_u   input `source.<name>.torque`                  Nm, held over a step
//   c     quadratic                                     Nm s²/rad² (N s²/m²), ≥ 0
//   ω     speed of the mass                             rad/s (m/s)
//
// All of it is work from outside: what the quadratic drag takes is booked as negative energy.input, not as dissipated.
// Source: a definition; the drag is that of a fan or a water brake.
// Does not model: a limit of power or speed, the inertia of the machine behind it. A drag without a bound on its slope is too
// fast for a step from some speed on (resolution.h warns).
#pragma once

#include <array>
#include <string>
#include <vector>

#include "plant/connectors/connector.h"
#include "plant/waveform.h"

namespace shiftrig::plant {

struct TorqueSource {
    std::string name, mass;
    Waveform waveform;     // prescribed part
    double quadratic = 0;  // c [Nm s²/rad²], ≥ 0
    bool input = false;    // adds the input `source.<name>.torque`
};

// ---- what it answers (connector.h)

inline const char* kind(const TorqueSource&) {
    return "source";
}
inline std::array<End, 1> ends(const TorqueSource& c) {
    return {End{.field = "mass", .mass = c.mass}};
}
void check_parameters(const Check& check, const TorqueSource& device);
void add_law(detail::ModelBuilder& builder, const TorqueSource& device);

}  // namespace shiftrig::plant
