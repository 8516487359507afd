// Draft of a mouldboard plough, [D497]:
//
//     D = F_i (A + B S + C S²) W T
//
//   D         draft                        N, a capacity: it resists motion and holds at rest (friction device)
//   F_i       soil factor                  1 (fine 1.0, medium 0.70, coarse 0.45)
//   A, B, C   of the implement             N/(m cm), N h/(m cm km), N h²/(m cm km²)
//   S         speed over ground            km/h
//   W, T      working width, depth         m, cm
//
// Source: [D497]. Does not model: scatter of the soil (± 40 % in the field), weight transfer, entering and
// leaving other than by the scale 0…1.
#pragma once

#include <cmath>

#include "plant/description.h"

namespace shiftrig::plant {

// The same per share in the ground over the speed itself: D = a + |v| (b + |v| c).
struct PloughCurve {
    double a = 0;  // [N]
    double b = 0;  // [N s/m]
    double c = 0;  // [N s²/m²]
};
inline PloughCurve plough_curve(const Plough& p) noexcept {
    const double cut = p.soil_factor * p.width * (100 * p.depth);  // [m cm]
    return {cut * p.a, 3.6 * cut * p.b, 3.6 * 3.6 * cut * p.c};
}

// Draft capacity at body speed v [m/s], scaled by `share` 0 (out) … 1 (in the ground). [N], ≥ 0.
inline double plough_draft(const PloughCurve& curve, double v, double share) noexcept {
    const double speed = std::fabs(v);
    return share * (curve.a + speed * (curve.b + speed * curve.c));
}
inline double plough_draft(const Plough& p, double v, double share) noexcept {
    return plough_draft(plough_curve(p), v, share);
}

}  // namespace shiftrig::plant
