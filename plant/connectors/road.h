// Grade and air on a body; law: laws/road.h.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "plant/connectors/connector.h"

namespace shiftrig::plant {

// The road under a translating mass: grade and air. Grade is the input `environment.grade` (tangent).
struct Road {
    std::string name, body;
    double mass = 0;             // that gravity acts on [kg]
    double air_coefficient = 0;  // ½ρc_wA [N s²/m²]
};

// ---- what it answers (connector.h)

inline const char* kind(const Road&) {
    return "road";
}
inline std::array<End, 1> ends(const Road& c) {
    return {End{.field = "body", .mass = c.body, .motion = EndMotion::translating}};
}
void check_parameters(const Check& check, const Road& device);
void add_law(detail::ModelBuilder& builder, const Road& device);

}  // namespace shiftrig::plant
