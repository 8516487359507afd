// Prescribed torque on a mass: test benches and reference problems.
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
    double quadratic = 0;  // −quadratic·ω·|ω| [Nm s²/rad²]
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
