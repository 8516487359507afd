// Hydrodynamic torque converter between pump and turbine.
//
//     driving   |ω_p| ≥ |ω_t|:  ν = ω_t/ω_p, T_p = sign(ω_p) (ω_p/K(ν))² g(ν), T_t = R(ν) T_p
//     overrun   |ω_t| > |ω_p|:  ν = ω_p/ω_t, T_t = −sign(ω_t) (ω_t/K(ν))² g(ν), T_p = T_t
//     g(ν) = min(1, (1 − ν)/0.02)
//
//   T_p   torque passed from the pump mass into the converter     Nm
//   T_t   torque passed from the converter to the turbine mass    Nm
//   ν     speed ratio slow over fast, limited to ≥ 0              1
//   K     capacity factor ω_p/√T_p of the pump                    rad/s/√Nm, > 0
//   R     torque ratio                                            1, ≥ 0; R(ν) ν ≤ 1, else it made power
//
// g carries the torque through zero at synchronous speed: published K tables end there with a finite
// value, which as it stands would jump in sign.
// Source: usual K-factor model (SAE J643 notation).
// Does not model: fluid inertia, heating of the converter's oil, a different curve in overrun.
#pragma once

#include <cmath>

#include "plant/description.h"
#include "plant/math/table.h"

namespace shiftrig::plant {

struct ConverterTorques {
    double pump = 0;     // [Nm] from the pump mass into the converter
    double turbine = 0;  // [Nm] from the converter to the turbine mass
    // Loss: pump·ω_p − turbine·ω_t ≥ 0 [W].
};

inline ConverterTorques converter_torques(const TorqueConverter& p, double pump_speed,
                                          double turbine_speed) noexcept {
    const bool driving = std::fabs(pump_speed) >= std::fabs(turbine_speed);
    const double fast = driving ? pump_speed : turbine_speed;
    const double slow = driving ? turbine_speed : pump_speed;
    if (fast == 0) return {};
    const double ratio = slow / fast > 0 ? slow / fast : 0;
    constexpr double fade = 0.02;
    const double gate = ratio > 1 - fade ? (1 - ratio) / fade : 1;
    const double root = fast / interpolate(p.k_over_speed_ratio, ratio);
    const double torque = gate * root * std::fabs(root);
    if (driving) return {torque, interpolate(p.torque_ratio_over_speed_ratio, ratio) * torque};
    return {-torque, -torque};
}

}  // namespace shiftrig::plant
