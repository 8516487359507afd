// Friction pair: sliding and static torque of a clutch, brake or contact, [Algin] eq. (11).
//
//     M_F = load · (base + rise · e^(−|Δω|/fade_speed)) · sign Δω          sliding
//     M_T = load · static_factor                                           largest torque of a closed pair
//
//   dry     load = engagement · sliding_capacity, base = 1 − falling, rise = falling, static_factor = static_ratio
//           or, with factor_over_slip f, M_F = load · f(|Δω|), M_T = load · static_ratio · f(0)
//   wet     load = max(0, p − p_return) · A_piston · r_m · z, base + rise e^… = μ(v), static_factor = μ_static,
//           r_m = 2/3 (ro³ − ri³)/(ro² − ri²)
//
//   M_F     sliding torque on the first link      Nm (N for a translating pair), sign of Δω
//   M_T     static capacity                       Nm, ≥ 0
//   load    what presses the pair together        Nm, ≥ 0
//   Δω      slip, first link minus second         rad/s
//   p       chamber pressure                      Pa
//   v       |Δω| r_m, sliding speed               m/s
//   z       number of friction surfaces           1
//
// Source: [Algin] eq. (11)–(13); μ(v) as a fade from rest; figures in config/tractor.yaml.
// Does not model: growth of the static capacity with time closed, fading with temperature, wear, judder from
// the geometry of the plates.
#pragma once

#include <cmath>
#include <variant>

#include "plant/description.h"
#include "plant/math/elementary.h"
#include "plant/math/table.h"

namespace shiftrig::plant {

struct FrictionLaw {
    double base = 0;           // [1]
    double rise = 0;           // [1]
    double inverse_speed = 0;  // 1/fade_speed [s/rad]
    double static_factor = 0;  // [1]
    // dry: load = load_per_engagement · engagement, wet: load_per_pascal · max(0, p − return_pressure)
    double load_per_engagement = 0;  // [Nm]
    double load_per_pascal = 0;      // [Nm/Pa]
    double return_pressure = 0;      // [Pa]
    // factor_over_slip of the description, if it has one: the law keeps a view, the description must outlive it.
    const Table* factor_over_slip = nullptr;
};

inline double mean_radius(const WetPlates& p) noexcept {
    const double ro = p.outer_radius, ri = p.inner_radius;
    return 2.0 / 3 * (ro * ro * ro - ri * ri * ri) / (ro * ro - ri * ri);
}

inline FrictionLaw friction_law(const DryFriction& p) noexcept {
    FrictionLaw law;
    law.base = 1 - p.falling;
    law.rise = p.falling;
    law.inverse_speed = 1 / p.falling_speed;
    law.static_factor = p.static_ratio;
    if (!p.factor_over_slip.empty()) {
        law.factor_over_slip = &p.factor_over_slip;
        law.static_factor *= interpolate(p.factor_over_slip, 0);
    }
    law.load_per_engagement = p.sliding_capacity;
    return law;
}

inline FrictionLaw friction_law(const WetPlates& p) noexcept {
    const double radius = mean_radius(p);
    FrictionLaw law;
    law.base = p.mu_sliding;
    law.rise = p.mu_rise;
    law.inverse_speed = radius / p.mu_speed;
    law.static_factor = p.mu_static;
    law.load_per_pascal = p.piston_area * radius * p.surfaces;
    law.return_pressure = p.return_pressure;
    return law;
}

inline double load_from_pressure(const FrictionLaw& law, double pressure) noexcept {
    const double net = pressure - law.return_pressure;
    return net > 0 ? net * law.load_per_pascal : 0;
}

inline double load_from_engagement(const FrictionLaw& law, double engagement) noexcept {
    return engagement > 0 ? engagement * law.load_per_engagement : 0;
}

// Friction factor of the sliding pair at this slip; times load = sliding capacity.
inline double sliding_factor(const FrictionLaw& law, double slip) noexcept {
    // Beyond its last point a table goes on as it came, but friction never drives.
    if (law.factor_over_slip != nullptr)
        return std::fmax(0, extrapolate(*law.factor_over_slip, std::fabs(slip)));
    if (law.rise == 0) return law.base;
    return law.base + law.rise * exp(-std::fabs(slip) * law.inverse_speed);
}

// How steeply that factor rises and falls over the slip, at most [s/rad]: friction that grows with speed damps, and such
// that fades lets a slip grow; both take small steps.
struct Steepness {
    double rise = 0, fall = 0;
};
inline Steepness steepness(const FrictionLaw& law) noexcept {
    Steepness most;
    const auto consider = [&most](double slope) {
        most.rise = std::fmax(most.rise, slope);
        most.fall = std::fmax(most.fall, -slope);
    };
    if (law.factor_over_slip == nullptr) {
        consider(-law.rise * law.inverse_speed);
        return most;
    }
    const Table& table = *law.factor_over_slip;
    for (std::size_t i = 1; i < table.size(); ++i)
        consider((table[i].second - table[i - 1].second) / (table[i].first - table[i - 1].first));
    return most;
}

inline double sliding_capacity(const FrictionLaw& law, double load, double slip) noexcept {
    return load * sliding_factor(law, slip);
}

inline double static_capacity(const FrictionLaw& law, double load) noexcept {
    return load * law.static_factor;
}

}  // namespace shiftrig::plant
