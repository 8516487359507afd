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
#include <utility>
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
    knots.reserve(2 * capacity.size() + multiplied.size());
    for (const double ratio : capacity) knots.push_back({1, -ratio});  // overrun
    multiplied.insert(multiplied.end(), capacity.begin(), capacity.end());
    std::sort(multiplied.begin(), multiplied.end());
    multiplied.erase(std::unique(multiplied.begin(), multiplied.end()), multiplied.end());
    for (const double ratio : multiplied) knots.push_back({-ratio, 1});
    return knots;
}

// How steeply either torque answers either speed, at most: by 2 c ω, with ω the faster one. With q = g/K², driving,
//
//     ∂T_p/∂ω_p = ω (2q − ν q'),  ∂T_p/∂ω_t = ω q',  and the same with R q for T_t,
//
// of which the slope is largest where g falls to zero and where K runs away before synchronous speed. Between the knots of
// the tables it is looked for at nine places, both ends among these.
inline double steepest_coefficient(const TorqueConverter& p) {
    std::vector<double> knots{0, 1 - converter_fade, 1};
    for (const auto& [ratio, k] : p.k_over_speed_ratio) knots.push_back(ratio);
    for (const auto& [ratio, torque] : p.torque_ratio_over_speed_ratio) knots.push_back(ratio);
    std::sort(knots.begin(), knots.end());
    const double at_rest = interpolate(p.k_over_speed_ratio, 0),
                 multiplied = interpolate(p.torque_ratio_over_speed_ratio, 0);
    double most = (1 + multiplied) / (at_rest * at_rest);  // against one another
    for (std::size_t i = 0; i + 1 < knots.size(); ++i) {
        const double from = knots[i], length = knots[i + 1] - from;
        if (from < 0 || length <= 0 || knots[i + 1] > 1) continue;
        const auto line = [&](const Table& table) {
            const double begin = interpolate(table, from), end = interpolate(table, from + length);
            return std::pair{begin, (end - begin) / length};
        };
        const auto [k0, k_slope] = line(p.k_over_speed_ratio);
        const auto [r0, r_slope] = line(p.torque_ratio_over_speed_ratio);
        const bool fades = from + 0.5 * length > 1 - converter_fade;
        constexpr int parts = 8;
        for (int n = 0; n <= parts; ++n) {
            const double way = n * length / parts, ratio = from + way;
            const double k = k0 + k_slope * way, r = r0 + r_slope * way;
            const double g = fades ? (1 - ratio) / converter_fade : 1,
                         g_slope = fades ? -1 / converter_fade : 0;
            const double q = g / (k * k), q_slope = (g_slope - 2 * g * k_slope / k) / (k * k);
            for (const auto& [size, slope] :
                 {std::pair{q, q_slope}, std::pair{r * q, r_slope * q + r * q_slope}})
                most = std::fmax(most, std::fmax(std::fabs(2 * size - ratio * slope), std::fabs(slope)));
        }
    }
    return 0.5 * most;
}

}  // namespace shiftrig::plant
