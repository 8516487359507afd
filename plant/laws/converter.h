// Hydrodynamic torque converter between pump and turbine.
//
//     driving   |ω_p| ≥ |ω_t|:  ν = ω_t/ω_p, T_p = sign(ω_p) (ω_p/K(ν))² g(ν), T_t = R(ν) T_p
//     overrun   |ω_t| > |ω_p|:  ν = ω_p/ω_t, T_p = −sign(ω_t) (ω_t/K(ν))² g(ν), T_t = R' T_p
//     g(ν) = min(1, (1 − ν)/0.02)
//     R' = 1, and where the two turn against one another R' = 1 + (R(0) − 1) |ω_p/ω_t|
//
//   T_p   torque passed from the pump mass into the converter     Nm
//   T_t   torque passed from the converter to the turbine mass    Nm
//   ν     speed ratio slow over fast, limited to ≥ 0              1
//   K     capacity factor ω_p/√T_p of the pump                    rad/s/√Nm, > 0
//   R     torque ratio                                            1, ≥ 0; R(ν) ν ≤ 1, else it made power
//
// g carries the torque through zero at synchronous speed: published K tables end there with a finite
// value, which as it stands would jump in sign. R' does the same for the torque ratio of a turbine that is turned backwards
// (a shuttle reversal, a vehicle that rolls back): it is R(0) up to the speed of the pump, and without R' would jump to 1 there.
// Source: usual K-factor model (SAE J643 notation).
// Does not model: fluid inertia, heating of the converter's oil, a different curve in overrun.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "plant/description.h"
#include "plant/math/table.h"

namespace shiftrig::plant {

constexpr double converter_fade = 0.02;  // of g

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
    const double gate = ratio > 1 - converter_fade ? (1 - ratio) / converter_fade : 1;
    const double root = fast / interpolate(p.k_over_speed_ratio, ratio);
    const double torque = gate * root * std::fabs(root);
    if (driving) return {torque, interpolate(p.torque_ratio_over_speed_ratio, ratio) * torque};
    const double against = slow / fast < 0 ? -slow / fast : 0;
    const double multiplied =
        against > 0 ? 1 + (interpolate(p.torque_ratio_over_speed_ratio, 0) - 1) * against : 1;
    return {-torque, -multiplied * torque};
}

// Where its tables, g or R' bend: both speeds on the line pump·ω_p + turbine·ω_t = 0.
struct ConverterKnot {
    double pump = 0, turbine = 0;
};
inline std::vector<ConverterKnot> converter_knots(const TorqueConverter& p) {
    std::vector<double> capacity{0, 1 - converter_fade}, multiplied{-1, 1};
    for (const auto& [ratio, k] : p.k_over_speed_ratio) capacity.push_back(ratio);
    for (const auto& [ratio, torque] : p.torque_ratio_over_speed_ratio) multiplied.push_back(ratio);
    std::vector<ConverterKnot> knots;
    for (const double ratio : capacity) knots.push_back({1, -ratio});  // overrun
    multiplied.insert(multiplied.end(), capacity.begin(), capacity.end());
    std::sort(multiplied.begin(), multiplied.end());
    multiplied.erase(std::unique(multiplied.begin(), multiplied.end()), multiplied.end());
    for (const double ratio : multiplied) knots.push_back({-ratio, 1});
    return knots;
}

// How steeply the torque answers the speed of either side, at most: by 2 c ω. Near synchronous speed g makes it (ω/K)² over
// 0.02 ω, elsewhere it grows with the square of the speed.
inline double steepest_coefficient(const TorqueConverter& p) noexcept {
    double least = p.k_over_speed_ratio.front().second, most = 1;
    for (const auto& [ratio, k] : p.k_over_speed_ratio) least = std::fmin(least, k);
    for (const auto& [ratio, torque] : p.torque_ratio_over_speed_ratio) most = std::fmax(most, torque);
    const double synchronous = interpolate(p.k_over_speed_ratio, 1);
    return std::fmax(most / (least * least), 0.5 / converter_fade / (synchronous * synchronous));
}

}  // namespace shiftrig::plant
