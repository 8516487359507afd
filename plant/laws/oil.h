// Transmission oil: viscosity, what cold oil does to valves, and the drag of an open wet clutch.
//
//     η = η_0 · e^(−decay·T)
//     cold share c = (ln η − ln η_warm)/(ln η_cold − ln η_warm), within 0…1; linear in T, warm above cold
//     dead time factor 1 + (cold_dead_time_factor − 1) c
//     valve frequency factor 1 + (cold_valve_frequency_factor − 1) c
//     fill flow factor 1/(1 + η/η_fill)
//     drag T = z π η Δω (ro⁴ − ri⁴)/(2 h), Δω limited to ± drag_speed_limit
//
//   η     dynamic viscosity                 Pa s
//   T     oil temperature                   °C
//   h     clearance per surface when open   m
//   Δω    slip of the open clutch           rad/s; T acts on the first link with its sign
//
// Source: laminar shear of a full gap (Newton); temperatures and factors are estimates (config/tractor.yaml).
// Does not model: aeration and emptying of the gap beyond its limit speed, oil flow, heating of the oil.
#pragma once

#include "plant/description.h"
#include "plant/laws/friction.h"
#include "plant/math/elementary.h"

namespace shiftrig::plant {

inline double viscosity(const Oil& oil, double temperature) noexcept {
    return oil.viscosity_at_zero * exp(-oil.viscosity_decay * temperature);
}

// 0 at warm_temperature and above, 1 at cold_temperature and below.
inline double cold_share(const Oil& oil, double temperature) noexcept {
    const double share = (oil.warm_temperature - temperature) / (oil.warm_temperature - oil.cold_temperature);
    return share < 0 ? 0 : share > 1 ? 1 : share;
}

struct OilEffects {
    double viscosity = 0;               // [Pa s]
    double dead_time_factor = 1;        // [1]
    double valve_frequency_factor = 1;  // [1]
    double fill_flow_factor = 1;        // [1]
};

inline OilEffects oil_effects(const Oil& oil, double temperature) noexcept {
    const double eta = viscosity(oil, temperature);
    const double cold = cold_share(oil, temperature);
    return {eta, 1 + (oil.cold_dead_time_factor - 1) * cold, 1 + (oil.cold_valve_frequency_factor - 1) * cold,
            1 / (1 + eta / oil.fill_viscosity)};
}

// Drag per viscosity and slip: z π (ro⁴ − ri⁴)/(2 h) [m³]; 0 where no clearance is given.
inline double drag_factor(const WetPlates& p) noexcept {
    const double ro2 = p.outer_radius * p.outer_radius, ri2 = p.inner_radius * p.inner_radius;
    return p.clearance > 0 ? p.surfaces * pi * (ro2 * ro2 - ri2 * ri2) / (2 * p.clearance) : 0;
}

inline double drag_torque(double factor, double eta, double slip, double speed_limit) noexcept {
    const double limited = slip > speed_limit ? speed_limit : slip < -speed_limit ? -speed_limit : slip;
    return factor * eta * limited;
}

}  // namespace shiftrig::plant
