// Road under a body: grade and air.
//
//     F_grade = −m g sin(arctan grade),    F_air = −c v |v|
//
//   F       force on the body in driving direction   N
//   grade   tangent of the slope, positive uphill    1
//   m       mass that gravity acts on                kg
//   c       ½ ρ c_w A                                N s²/m²
//   v       body speed                               m/s
//
// Does not model: wind, weight transfer by the grade (contact weights stay as given).
#pragma once

#include <cmath>

#include "plant/description.h"

namespace shiftrig::plant {

inline double grade_force(const Road& p, double grade, double gravity) noexcept {
    return -p.mass * gravity * (grade / std::sqrt(1 + grade * grade));
}

inline double air_force(const Road& p, double v) noexcept {
    return -p.air_coefficient * v * std::fabs(v);
}

}  // namespace shiftrig::plant
