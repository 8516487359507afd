// Linear damper between two masses or to the housing: the drag of bearings and oil.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "plant/connectors/connector.h"

namespace shiftrig::plant {

struct Damper {
    std::string name, a, b;  // b empty: to the housing
    double damping = 0;      // [Nm s/rad]
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
