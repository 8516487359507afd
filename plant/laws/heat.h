// Temperature of a clutch: the facing surface takes the friction heat and passes it to the bulk, the bulk to
// the oil.
//
//     C_s Ṫ_s = P − G_sb (T_s − T_b)
//     C_b Ṫ_b = G_sb (T_s − T_b) − G_bo (T_b − T_oil)
//
//   T_s, T_b, T_oil   surface, bulk, oil temperature   °C
//   P                 friction heat, mean of the step  W
//   C_s, C_b          heat capacities                  J/K
//   G_sb, G_bo        conductances                     W/K
//
// Advanced exactly for constant P and T_oil: y = T − T_oil, y₁ = E y₀ + F P with E = e^(Ah), F = h φ₁(Ah)
// (1/C_s, 0).
// Source: two-node lumped model; figures are estimates.
// Does not model: distribution over the plates, radial hot spots.
#pragma once

#include <cmath>

#include "plant/description.h"
#include "plant/math/elementary.h"

namespace shiftrig::plant {

struct HeatOperator {
    double e11 = 1, e12 = 0, e21 = 0, e22 = 1;  // [1]
    double f1 = 0, f2 = 0;                      // [K/W]
};

struct HeatState {
    double surface = 0, bulk = 0;  // [°C]
};

inline HeatOperator heat_operator(const FacingHeat& p, double h) noexcept {
    const double a11 = -p.surface_to_bulk / p.surface_capacity, a12 = -a11;
    const double a21 = p.surface_to_bulk / p.bulk_capacity, a22 = -a21 - p.bulk_to_oil / p.bulk_capacity;
    const double mean = 0.5 * (a11 + a22), half_gap = std::sqrt(0.25 * (a11 - a22) * (a11 - a22) + a12 * a21);
    const double l1 = mean + half_gap, l2 = mean - half_gap;  // real, ≤ 0
    const auto phi1 = [h](double l) {
        return std::fabs(l * h) < 1e-6 ? h * (1 + 0.5 * l * h) : (exp(l * h) - 1) / l;
    };
    // Any function g of A: g(l1) P1 + g(l2) P2 with the projectors P1 = (A − l2)/(l1 − l2), P2 = I − P1.
    const double p11 = half_gap > 0 ? (a11 - l2) / (2 * half_gap) : 1,
                 p22 = half_gap > 0 ? (a22 - l2) / (2 * half_gap) : 0;
    const double p12 = half_gap > 0 ? a12 / (2 * half_gap) : 0, p21 = half_gap > 0 ? a21 / (2 * half_gap) : 0;
    const double x1 = exp(l1 * h), x2 = exp(l2 * h);
    HeatOperator op;
    op.e11 = x1 * p11 + x2 * (1 - p11);
    op.e12 = (x1 - x2) * p12;
    op.e21 = (x1 - x2) * p21;
    op.e22 = x1 * p22 + x2 * (1 - p22);
    op.f1 = (phi1(l1) * p11 + phi1(l2) * (1 - p11)) / p.surface_capacity;
    op.f2 = (phi1(l1) - phi1(l2)) * p21 / p.surface_capacity;
    return op;
}

inline void advance_heat(const HeatOperator& op, HeatState& state, double power,
                         double oil_temperature) noexcept {
    const double surface = state.surface - oil_temperature, bulk = state.bulk - oil_temperature;
    state.surface = oil_temperature + op.e11 * surface + op.e12 * bulk + op.f1 * power;
    state.bulk = oil_temperature + op.e21 * surface + op.e22 * bulk + op.f2 * power;
}

}  // namespace shiftrig::plant
