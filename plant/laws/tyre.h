// Driven tyre on soil: Brixius traction with a relaxation length.
//
//     κ̇   = (ω r − v − V κ)/σ,   V = max(|ω r|, |v|)       builds up over the length σ
//     s   = κ + τ' κ̇,            τ' = τ σ/(σ + τ V)             slip-rate damping, fading with speed
//     F   = 0.88 (1 − e^(−0.1 Bn)) (1 − e^(−7.5 |s|)) W · sign s   on the body; F r on the wheel
//     M_roll = 0.04 W r                                                  friction device on the wheel
//     R   = (1/Bn + 0.5 |s|/√Bn) W                                       friction device on the body
//
//   ω    wheel speed                        rad/s
//   v    body speed                         m/s
//   κ    relaxed slip (state)               1, positive when driving
//   F    force of wheel on body             N, positive when driving
//   Bn   mobility number                    1 (80/55/40/20 hard/firm/tilled/soft)
//   W    weight on the contact              N
//   τ    slip-rate damping time             s: at standstill the relaxed tyre is an undamped spring
//
// With F/W + 0.04 = GT and GT − MR = F/W − R/W this is [Brixius]: GT = 0.88(1−e^(−0.1Bn))(1−e^(−7.5s)) + 0.04,
// MR = 1/Bn + 0.04 + 0.5 s/√Bn; made odd in s. At speed the damping never leads beyond steady slip:
// κ + τ'κ̇ = κ + w (κ_steady − κ), w = τV/(σ + τV) < 1.
// Does not model: side force, weight transfer, multi-pass soil compaction, tyre carcass inertia.
#pragma once

#include <algorithm>
#include <cmath>

#include "plant/description.h"
#include "plant/math/elementary.h"

namespace shiftrig::plant {

// What follows from the soil alone, held over a step.
struct TyreSoil {
    double grip = 0;                 // largest F [N]
    double resistance = 0;           // W/Bn [N]
    double resistance_per_slip = 0;  // 0.5 W/√Bn [N]
    double per_length = 0;           // 1/σ [1/m]
};

inline TyreSoil tyre_soil(const BrixiusTyre& p, double mobility_number) noexcept {
    return {0.88 * (1 - exp(-0.1 * mobility_number)) * p.weight, p.weight / mobility_number,
            0.5 * p.weight / std::sqrt(mobility_number), 1 / p.relaxation_length};
}

// κ̇ and the slip s that the force sees.
struct TyreMotion {
    double rate = 0;  // [1/s]
    double slip = 0;  // [1]
};

inline TyreMotion tyre_motion(const BrixiusTyre& p, const TyreSoil& soil, double kappa, double wheel_speed,
                              double body_speed) noexcept {
    const double rim = wheel_speed * p.radius;
    const double rolling = std::max(std::fabs(rim), std::fabs(body_speed));
    const double rate = (rim - body_speed - rolling * kappa) * soil.per_length;
    const double damping = p.slip_damping_time / (1 + p.slip_damping_time * rolling * soil.per_length);
    return {rate, kappa + damping * rate};
}

inline double tyre_force(const TyreSoil& soil, double slip) noexcept {
    const double size = soil.grip * (1 - exp(-7.5 * std::fabs(slip)));
    return slip < 0 ? -size : size;
}

// dF/ds at s = 0 [N].
inline double tyre_force_slope(const TyreSoil& soil) noexcept {
    return 7.5 * soil.grip;
}

// Capacity of the resistance on the body [N], of the rolling moment on the wheel [Nm].
inline double tyre_resistance(const TyreSoil& soil, double slip) noexcept {
    return soil.resistance + soil.resistance_per_slip * std::fabs(slip);
}
inline double rolling_moment(const BrixiusTyre& p) noexcept {
    return p.rolling_coefficient * p.weight * p.radius;
}

}  // namespace shiftrig::plant
