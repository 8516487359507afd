// What a user wrote about his machine, as plain data in SI units: masses and the connectors between
// them, laws with their parameters, sources. io/ fills it from YAML, tests fill it by hand, and
// Model::build() (model.h) turns it into something that steps or names what is wrong with it.
//
// Links are mass names. An empty second link means the housing (where a device allows it).
// Signs follow [Algin]: a device's torque M_k is the torque on its first link; positive M_k is passed
// from the first mass into the device.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace shiftrig::plant {

enum class Motion { rotating, translating };

struct Mass {
    std::string name;
    double inertia = 0;  // [kg m²], or [kg] where translating
    Motion motion = Motion::rotating;
    double initial_speed = 0;  // [rad/s] or [m/s]
};

// Elastic shaft with its parallel damper, [Algin] eq. (14): M = stiffness·twist + damping·(ω_a − ω_b).
struct Shaft {
    std::string name, a, b;
    double stiffness = 0;      // [Nm/rad]
    double damping = 0;        // [Nm s/rad]
    double initial_twist = 0;  // [rad], positive where a is ahead of b
};

// Elastic shaft with play: within the gap it passes on nothing, laws/backlash.h.
struct Backlash {
    std::string name, a, b;
    double stiffness = 0;      // of the closed flanks [Nm/rad], > 0
    double damping = 0;        // of the closed flanks [Nm s/rad], ≥ 0
    double gap = 0;            // the whole play [rad], > 0
    double initial_twist = 0;  // [rad], positive where a is ahead of b; 0: in the middle of the play
};

struct Damper {
    std::string name, a, b;  // b empty: to the housing
    double damping = 0;      // [Nm s/rad]
};

// Prescribed function of time for self-contained reference problems: the sum of pieces, each
// offset + slope·(t − from) + amplitude·sin(2π·frequency·(t − phase_time)) on [from, until), 0 outside.
struct Waveform {
    struct Piece {
        double from = -1e300, until = 1e300;  // [s]
        double offset = 0, slope = 0;         // [unit], [unit/s]
        double amplitude = 0, frequency = 0;  // [unit], [Hz]
        double phase_time = 0;                // [s]
    };
    std::vector<Piece> pieces;
};

// ---- friction pairs -------------------------------------------------------------------------------

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
    int surfaces = 0;              // z
    double outer_radius = 0;       // ro [m]
    double inner_radius = 0;       // ri [m]
    double piston_area = 0;        // [m²]
    double return_pressure = 0;    // p_return [Pa]: spring line at full stroke
    double mu_static = 0;          // [1]
    double mu_sliding = 0;         // μ(v) = mu_sliding + mu_rise·e^(−v/mu_speed)
    double mu_rise = 0;            // [1]
    double mu_speed = 1;           // [m/s] at the mean radius
    double clearance = 0;          // h per surface when open [m], for the drag of the oil
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
    double preload_pressure = 0;   // spring line at zero stroke [Pa]; at full stroke: WetPlates::return_pressure
    double stroke = 0;             // [m]; 0 with fill_volume 0: no piston fill
    double fill_volume = 0;        // [m³]
    double fill_flow = 0;          // [m³/s] at warm oil
    std::optional<Solenoid> solenoid;
    double initial = 0;            // pressure at start, command and chamber [Pa]
};

using Friction = std::variant<DryFriction, WetPlates>;
using Actuation =
    std::variant<ActuationConstant, ActuationDirect, ActuationRelease, ActuationApply, ActuationHydraulic>;

// Facing surface and bulk as two heat nodes; the surface takes the friction heat.
struct FacingHeat {
    double surface_capacity = 0;     // [J/K]
    double bulk_capacity = 0;        // [J/K]
    double surface_to_bulk = 0;      // [W/K]
    double bulk_to_oil = 0;          // [W/K]
    double facing_area = 0;          // [m²]
    double warn_temperature = 0;     // [°C]
    double fail_temperature = 0;     // [°C]
};

// Friction clutch between a and b; with b empty a brake. b_per_a generalises the pair to a wheel on a
// road ([Algin] Fw): Δ = ω_a − v_b/radius, SDM column (1, −1/radius); radius 0 means a plain clutch.
struct Clutch {
    std::string name, a, b;
    Friction friction;
    Actuation actuation;
    std::optional<FacingHeat> heat;
    double radius = 0;             // [m], wheel contact only
    bool initially_locked = false;
    bool drag = false;             // viscous drag of the open wet clutch, by oil viscosity
};

// One-way clutch (freewheel, sprag) between a and b, with b empty to the housing; laws/freewheel.h. It does not let
// ω_a − ω_b go in the sense it blocks: forward, a cannot run ahead of b; backward, a cannot fall behind.
enum class Sense { forward, backward };

struct Freewheel {
    std::string name, a, b;
    Sense blocks = Sense::forward;
    double rated_torque = 0;   // held in the blocked sense [Nm], > 0
    double sliding_share = 0;  // of it that is left while the overloaded freewheel slips, in (0, 1]
    double drag_torque = 0;    // while overrunning [Nm], ≥ 0
};

// ---- rigid devices -----------------------------------------------------------------------------------

// Fixed-axis gear, u = u12 = ω_a/ω_b; efficiency η acts as û = u·η^x.
struct Gear {
    std::string name, a, b;
    double ratio = 0;           // [1], negative for an external pair drawn with its sign; not 0
    double efficiency = 1;      // (0, 1]
    double bearing_torque = 0;  // ≥ 0 [Nm] load-independent friction behind the mesh, referred to link a
    // The same two where b drives, if they differ: M_b = −u (M_a/η − bearing).
    double backward_efficiency = 0;       // 0: as efficiency
    double backward_bearing_torque = -1;  // negative: as bearing_torque
    // Selectable ratios (a range group): names and ratios; `ratio` is the one in use.
    std::vector<std::pair<std::string, double>> options;
};

// Planetary row: Willis ω_sun − u·ω_ring − (1 − u)·ω_carrier = 0, u = u12 with the carrier held
// (negative for a simple row).
struct Planetary {
    std::string name, sun, ring, carrier;
    double ratio = 0;
    double efficiency = 1;  // η0 of the meshes with the carrier held
};

// ---- force laws --------------------------------------------------------------------------------------

// Tyre with Brixius traction and relaxation, between a wheel and a translating mass.
struct BrixiusTyre {
    std::string name, wheel, body;
    double radius = 0;              // rolling radius [m]
    double mobility_number = 0;     // Bn [1]; initial value of input `environment.mobility_number`
    double relaxation_length = 0;   // σ [m]
    double slip_damping_time = 0;   // τ [s] of numerics.md §9
    double weight = 0;              // on this contact [N]
    double rolling_coefficient = 0; // 0.04: rolling moment coeff·W·r as a friction device on the wheel
    // The rest of the motion resistance acts on the body as a friction device (1/Bn + 0.5|s|/√Bn)·W.
};

struct TorqueConverter {
    std::string name, pump, turbine;
    std::vector<std::pair<double, double>> k_over_speed_ratio;      // K = ω/√T [rad/s/√Nm]
    std::vector<std::pair<double, double>> torque_ratio_over_speed_ratio;
};

// Diesel engine on a mass; the net torque of rulings in docs/mechanics.md.
struct Engine {
    std::string name, mass;
    std::vector<std::pair<double, double>> full_load;  // (ω [rad/s], T [Nm]), rising in ω
    double governor_slope = 0;   // [Nm s/rad]
    double low_idle = 0;         // no-load speed at throttle 0 [rad/s]
    double high_idle = 0;        // no-load speed at throttle 1 [rad/s]
    double friction_constant = 0, friction_per_speed = 0;  // [Nm], [Nm s/rad]; when motoring
    double actuator_lag = 0;     // [s]
    double turbo_instant_fraction = 1, turbo_lag = 0;      // [1], [s]
    double fade_from = 0, fade_to = 0;   // below fade_from the curve falls linearly to 0 at fade_to [rad/s]
    double stall_speed = 0;      // below it the engine has stalled until `engine.<name>.start` [rad/s]
};

struct TorqueSource {
    std::string name, mass;
    Waveform waveform;     // prescribed part
    double quadratic = 0;  // −quadratic·ω·|ω| [Nm s²/rad²]
    bool input = false;    // adds the input `source.<name>.torque`
};

// The road under a translating mass: grade and air. Grade is the input `environment.grade` (tangent).
struct Road {
    std::string name, body;
    double mass = 0;          // that gravity acts on [kg]
    double air_coefficient = 0;  // ½ρc_wA [N s²/m²]
};

// Plough draft F·(A + B·S + C·S²)·W·T, S in km/h, W in m, T in cm: resists motion and holds at rest.
// Input `environment.draft` scales it 0…1 (plough out … in).
struct Plough {
    std::string name, body;
    double soil_factor = 0, a = 0, b = 0, c = 0;  // ASABE D497
    double width = 0;   // [m]
    double depth = 0;   // [m]
};

// ---- fluids, sensors ------------------------------------------------------------------------------------

struct Oil {
    double viscosity_at_zero = 0;  // [Pa s] at 0 °C
    double viscosity_decay = 0;    // η = viscosity_at_zero·exp(−decay·T) [1/°C]
    double initial_temperature = 90;    // [°C], input `environment.oil_temperature`
    double drag_speed_limit = 60;  // open-clutch drag is linear up to this slip [rad/s]
    double cold_temperature = -10;        // [°C] where the two factors below hold; ln-viscosity between
    double warm_temperature = 90;
    double cold_dead_time_factor = 4;
    double cold_valve_frequency_factor = 0.4;
    double fill_viscosity = 0.1;   // fill flow ÷ (1 + η/fill_viscosity) [Pa s]
    double pump_flow = 0;          // shared by all clutches [m³/s]; 0: unlimited
};

// A speed pick-up. Ideal sensors copy the speed.
struct SpeedSensor {
    std::string name, mass;
    bool ideal = true;
    int teeth = 0;
    bool directional = false;     // false: unsigned
    double drop_out_speed = 0;    // below it the sensor reads 0 [rad/s]
};

// ---- the machine -------------------------------------------------------------------------------------------

enum class Transition { next_step, localised };
enum class Method { automatic, etd3, ark3 };

// A named way to close the driveline: the gear table of `check`, the ratio definition of the scorecard.
struct GearPath {
    std::string name;                  // "F2"
    std::vector<std::string> closed;   // clutches and brakes closed in it
};

struct Description {
    std::string name;
    std::vector<Mass> masses;
    std::vector<Shaft> shafts;
    std::vector<Backlash> backlashes;
    std::vector<Damper> dampers;
    std::vector<Clutch> clutches;      // clutches, brakes, Coulomb wheel contacts
    std::vector<Freewheel> freewheels;
    std::vector<Gear> gears;
    std::vector<Planetary> planetaries;
    std::vector<BrixiusTyre> tyres;
    std::vector<TorqueConverter> converters;
    std::vector<Engine> engines;
    std::vector<TorqueSource> sources;
    std::vector<Road> roads;
    std::vector<Plough> ploughs;
    std::vector<SpeedSensor> sensors;
    std::optional<Oil> oil;
    std::vector<GearPath> gear_paths;
    std::string input_mass, output_mass;  // of the gear table's ratio and of statics
    double gravity = 9.80665;             // [m/s²]

    Transition transition = Transition::localised;
    Method method = Method::automatic;
    int maximum_events = 4;               // K of numerics.md §4
    // A step is taken in up to this many parts where shafts swing or forces change too fast for one; 1: never.
    // Bounds the cost of a step. A backlash whose flanks are too stiff for that many raises both bounds (not 1).
    int maximum_parts = 16;
};

}  // namespace shiftrig::plant
