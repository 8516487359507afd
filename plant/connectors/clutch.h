// Clutch, brake or Coulomb wheel contact: a friction pair, what presses it together, and its heat. Laws: laws/friction.h,
// hydraulics.h, lag.h, heat.h, oil.h.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "plant/connectors/connector.h"
#include "plant/waveform.h"

namespace shiftrig::plant {

// Capacity given as a torque; static capacity = static_ratio · sliding capacity.
struct DryFriction {
    double sliding_capacity = 0;  // [Nm] (for a translating pair [N])
    double static_ratio = 1;      // ≥ 1, [1]
    // Sliding capacity falls with slip speed by the factor 1 − falling·(1 − e^(−|Δω|/falling_speed)).
    double falling = 0;        // [1], 0: Coulomb
    double falling_speed = 1;  // [rad/s]
    // Instead of the exponential: sliding capacity as a factor of sliding_capacity over |Δω| ([rad/s], [1]),
    // piecewise linear, its last slope continued (bearing friction that rises with speed).
    std::vector<std::pair<double, double>> factor_over_slip;
};

// Wet multi-plate clutch: T = μ(v)·max(0, p − p_return)·A_piston·r_m·z, spec of the powershift clutch.
struct WetPlates {
    int surfaces = 0;            // z
    double outer_radius = 0;     // ro [m]
    double inner_radius = 0;     // ri [m]
    double piston_area = 0;      // [m²]
    double return_pressure = 0;  // p_return [Pa]: spring line at full stroke
    double mu_static = 0;        // [1]
    double mu_sliding = 0;       // μ(v) = mu_sliding + mu_rise·e^(−v/mu_speed)
    double mu_rise = 0;          // [1]
    double mu_speed = 1;         // [m/s] at the mean radius
    double clearance = 0;        // h per surface when open [m], for the drag of the oil
};

// ---- how a friction pair is engaged -----------------------------------------------------------------

// Always engaged. (Brake shoes of a test problem, a slipping coupling.)
struct ActuationConstant {};

// Engagement factor 0…1 times the nominal capacity: from a waveform if it has pieces, otherwise from
// the input `clutch.<name>.engagement` (initial value `initial`).
struct ActuationDirect {
    Waveform profile;
    double initial = 0;  // [1]
};

// Spring-closed, released by a command 0…1 through a first-order lag; capacity = nominal·(1 − release).
// Input `clutch.<name>.release_command`.
struct ActuationRelease {
    double lag = 0;  // [s]
    double initial = 0;
};

// Applied by a command 0…1 through a first-order lag; capacity = nominal·application. Input
// `clutch.<name>.application_command`, or the driver's pedal `driver.brake` for a service brake.
struct ActuationApply {
    double lag = 0;  // [s]
    bool by_driver_brake = false;
    double initial = 0;
};

// Solenoid characteristic: pressure over current, rising, with a hysteresis band.
struct Solenoid {
    std::vector<std::pair<double, double>> pressure_over_current;  // ([A], [Pa])
    double hysteresis = 0;                                         // full width [A]
};

// Proportional valve and piston: dead time → slew limit → second-order valve → fill → chamber pressure.
// Input `clutch.<name>.pressure_command` [Pa], or `.current_command` [A] where a solenoid is given.
struct ActuationHydraulic {
    double dead_time = 0;          // [s] at warm oil
    double natural_frequency = 0;  // [rad/s]
    double damping_ratio = 0;      // [1]
    double slew = 0;               // [Pa/s]
    double maximum_pressure = 0;   // [Pa]
    double preload_pressure =
        0;                   // spring line at zero stroke [Pa]; at full stroke: WetPlates::return_pressure
    double stroke = 0;       // [m]; 0 with fill_volume 0: no piston fill
    double fill_volume = 0;  // [m³]
    double fill_flow = 0;    // [m³/s] at warm oil
    std::optional<Solenoid> solenoid;
    double initial = 0;  // pressure at start, command and chamber [Pa]
};

using Friction = std::variant<DryFriction, WetPlates>;
using Actuation =
    std::variant<ActuationConstant, ActuationDirect, ActuationRelease, ActuationApply, ActuationHydraulic>;

// Facing surface and bulk as two heat nodes; the surface takes the friction heat.
struct FacingHeat {
    double surface_capacity = 0;  // [J/K]
    double bulk_capacity = 0;     // [J/K]
    double surface_to_bulk = 0;   // [W/K]
    double bulk_to_oil = 0;       // [W/K]
    double facing_area = 0;       // [m²]
    double warn_temperature = 0;  // [°C]
    double fail_temperature = 0;  // [°C]
};

// Friction clutch between a and b; with b empty a brake. A radius generalises the pair to the rim of a wheel on a
// road ([Algin] Fig. 11, Fw): Δ = ω_a − v_b/radius, positive where the rim runs ahead, SDM column (1, −1/radius),
// sliding_capacity = μ · weight · radius. It knows no tyre elasticity, soil (tyre.h does) or side force.
struct Clutch {
    std::string name, a, b;
    Friction friction;
    Actuation actuation;
    std::optional<FacingHeat> heat;
    double radius = 0;  // [m], wheel contact only; 0: a plain clutch or brake
    bool initially_locked = false;
    bool drag = false;  // viscous drag of the open wet clutch, by oil viscosity
};

// ---- what it answers (connector.h)

inline const char* kind(const Clutch& c) {
    return c.b.empty() ? "brake" : "clutch";
}
inline std::array<End, 2> ends(const Clutch& c) {
    const bool on_road = c.radius > 0;
    return {End{.field = "a", .mass = c.a, .motion = on_road ? EndMotion::rotating : EndMotion::any},
            End{.field = "b",
                .mass = c.b,
                .may_be_housing = true,
                .motion = on_road ? EndMotion::translating : EndMotion::alike}};
}
inline bool may_be_closed(const Clutch&) {
    return true;
}
void check_parameters(const Check& check, const Clutch& device);
void check_surroundings(const Description& machine, const Clutch& device);
void assemble(Assembly& assembly, const Clutch& device);
void add_pair_law(detail::ModelBuilder& builder, const Clutch& device);
void name_outputs(detail::ModelBuilder& builder, const std::vector<Clutch>& devices);
double* show(const detail::Shown& at, const std::vector<Clutch>& devices, double* next) SHIFTRIG_REALTIME;
std::string in_words(const Clutch& device, const Event& event);

}  // namespace shiftrig::plant
