// Diesel engine on the crankshaft mass: net full-load curve, governor, fuel actuator, turbocharger.
//
//     no-load speed   n0 = low_idle + throttle (high_idle − low_idle), or the TSC1 speed request
//     full load       T_full(ω): table; below fade_from falling linearly to 0 at fade_to
//     available       T_av = T_full (φ + (1 − φ) b)
//     demand          T_d = slope (n0 − ω), limited to −T_friction(ω) … min(T_av, limit · max T_full);
//                     −T_friction when the fuel is cut
//     actuator        lag_a · Ṫ = T_d − T
//     turbo           lag_t · ḃ = max(T, 0)/T_full − b, limited to 0…1
//     friction        T_friction = constant + per_speed · |ω|
//
//   T     net torque on the crankshaft (state)    Nm, positive drives
//   b     boost, share of what the turbo adds (state)   1
//   φ     share of T_full available without boost       1
//   ω     crankshaft speed                        rad/s
//   limit TSC1 torque limit                       1, of the peak of T_full
//
// The curve is net: friction shows only where the governor closes the rack beyond zero (overrun, fuel
// cut), along the governor's own line. Below stall_speed the engine has stalled: its torque is 0 and its
// friction becomes a friction device on the crankshaft (capacity T_friction), so that it resists either
// way and holds at rest. A start event cranks it with half of the torque at fade_from [estimate] up to
// fade_from (and stall_speed), or for at most 3 s.
// Source: usual mean-value model; parameters of the reference tractor in config/tractor.yaml.
// Does not model: cylinder-by-cylinder torque, smoke limit beyond φ, engine brake, temperature.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "plant/description.h"
#include "plant/math/table.h"

namespace shiftrig::plant {

struct EngineInput {
    double throttle = 0;  // 0…1
    bool speed_request_enable = false;
    double speed_request = 0;  // [rad/s]
    double torque_limit = 1;   // [1]
    bool fuel_cut = false;
};

// The differential states; not stiff, integrated with the step's stages.
struct EngineState {
    double torque = 0;  // [Nm]
    double boost = 0;   // 0…1
};

enum class EngineMode { running, stalled, cranking };

// Turned backwards, beyond what rounding leaves of a speed at rest [rad/s]: one that neither fades nor stalls gives its torque at
// rest as well, whichever sign that has.
constexpr double turned_backwards = -1e-9;

inline double full_load(const Engine& p, double speed) noexcept {
    if (speed >= p.fade_from || (p.fade_from == 0 && speed >= turned_backwards))
        return interpolate(p.full_load, speed);
    if (speed <= p.fade_to) return 0;
    return interpolate(p.full_load, p.fade_from) * ((speed - p.fade_to) / (p.fade_from - p.fade_to));
}

// The same from the curve made ready.
inline double full_load(const Engine& p, const Curve& curve, double speed) noexcept {
    if (speed >= p.fade_from || (p.fade_from == 0 && speed >= turned_backwards)) return curve.at(speed);
    if (speed <= p.fade_to) return 0;
    return curve.at(p.fade_from) * ((speed - p.fade_to) / (p.fade_from - p.fade_to));
}

inline double engine_friction(const Engine& p, double speed) noexcept {
    return p.friction_constant + p.friction_per_speed * std::fabs(speed);
}

inline double no_load_speed(const Engine& p, const EngineInput& input) noexcept {
    if (input.speed_request_enable) return input.speed_request;
    return p.low_idle + input.throttle * (p.high_idle - p.low_idle);
}

// What an input sets, as long as it stays the same. `peak` = largest_value(p.full_load), kept by the caller.
struct EngineSetting {
    double no_load_speed = 0;  // [rad/s]
    double most = 0;           // torque limit [Nm]
    bool fuel_cut = false;
    double actuator_rate = 0, turbo_rate = 0;  // 1/lag, 0 where there is none [1/s]
};
inline EngineSetting engine_setting(const Engine& p, double peak, const EngineInput& input) noexcept {
    const auto rate = [](double lag) { return lag > 0 ? 1 / lag : 0; };
    return {no_load_speed(p, input), input.torque_limit * peak, input.fuel_cut, rate(p.actuator_lag),
            rate(p.turbo_lag)};
}

// Between which limits the governor asks for how much.
struct EngineDemand {
    double governor = 0, available = 0, friction = 0;  // [Nm]
};
inline EngineDemand engine_demand(const Engine& p, const EngineSetting& set, double speed, double full,
                                  double boost) noexcept {
    const double share =
        p.turbo_lag > 0 ? p.turbo_instant_fraction + (1 - p.turbo_instant_fraction) * boost : 1;
    return {p.governor_slope * (set.no_load_speed - speed), full * share, engine_friction(p, speed)};
}

inline double torque_demand(const Engine& p, const EngineSetting& set, double speed, double full,
                            double boost) noexcept {
    const EngineDemand d = engine_demand(p, set, speed, full, boost);
    if (set.fuel_cut) return -d.friction;
    return std::max(-d.friction, std::min(d.governor, std::min(d.available, set.most)));
}

inline double starter_torque(const Engine& p) noexcept {
    return 0.5 * interpolate(p.full_load, p.fade_from);
}

// Torque of the engine on its mass, without the friction device of the stalled one, and derivatives of its state; a lag
// of 0 gives 0, the torque is the demand itself then. `full` is the full load at this speed.
struct EngineDrive {
    double torque = 0;  // [Nm]
    EngineState rate;   // [Nm/s], [1/s]
};
inline EngineDrive engine_drive(const Engine& p, const EngineSetting& set, const EngineState& state,
                                EngineMode mode, double speed, double full) noexcept {
    EngineDrive drive;
    if (mode != EngineMode::running) {
        if (mode == EngineMode::cranking) drive.torque = starter_torque(p);
        return drive;
    }
    const double demand = torque_demand(p, set, speed, full, state.boost);
    drive.torque = set.actuator_rate > 0 ? state.torque : demand;
    drive.rate.torque = (demand - state.torque) * set.actuator_rate;
    if (set.turbo_rate > 0) {
        const double load = full > 0 && drive.torque > 0 ? std::min(drive.torque / full, 1.) : 0;
        drive.rate.boost = (load - state.boost) * set.turbo_rate;
    }
    return drive;
}

inline double stalled_friction_capacity(const Engine& p, EngineMode mode, double speed) noexcept {
    return mode == EngineMode::stalled ? engine_friction(p, speed) : 0;
}

inline bool has_stalled(const Engine& p, double speed) noexcept {
    return speed < p.stall_speed && (p.stall_speed > 0 || speed < turned_backwards);
}

// Mode for the next step, decided at the end of this one. `crank_time` [s] counts in cranking.
inline EngineMode next_engine_mode(const Engine& p, EngineMode mode, double speed, bool start_edge, double h,
                                   double& crank_time) noexcept {
    constexpr double longest_cranking = 3;  // [s]
    switch (mode) {
        case EngineMode::running:
            return has_stalled(p, speed) ? EngineMode::stalled : EngineMode::running;
        case EngineMode::stalled:
            crank_time = 0;
            return start_edge ? EngineMode::cranking : EngineMode::stalled;
        case EngineMode::cranking:
            crank_time += h;
            if (speed >= p.fade_from && !has_stalled(p, speed)) return EngineMode::running;
            return crank_time < longest_cranking ? EngineMode::cranking : EngineMode::stalled;
    }
    return mode;
}

}  // namespace shiftrig::plant
