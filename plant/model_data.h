// What a Model holds: the description, its structure, and everything worked out from them once, so that a
// step only adds and multiplies. Internal to plant/.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "plant/connectors.h"
#include "plant/kernels.h"
#include "plant/laws/converter.h"
#include "plant/laws/friction.h"
#include "plant/laws/heat.h"
#include "plant/laws/lag.h"
#include "plant/laws/plough.h"
#include "plant/math/table.h"
#include "plant/plant.h"
#include "plant/state_layout.h"
#include "plant/structure.h"
#include "plant/tree.h"

namespace shiftrig::plant::detail {

// What presses a friction pair together, and where that comes from: first what is actuated, then, from `rolling` on, loads by
// nature.
enum class LoadSource {
    constant,
    waveform,
    input,
    release,
    apply,
    hydraulic,
    rolling,
    resistance,
    engine,
    rated
};

constexpr bool is_actuated(LoadSource source) noexcept {
    return source < LoadSource::rolling;
}

struct PairLaw {
    LoadSource source{};
    FrictionLaw friction;
    double drag = 0;             // of the open clutch, per viscosity and slip [m³]
    double full_load = 0;        // load at full engagement, for a pair stuck closed [Nm]
    double sliding_at_rest = 0;  // friction factor at no slip [1]
    const Waveform* profile = nullptr;
    const ActuationHydraulic* hydraulic = nullptr;
    LagOperator lag;
    int actuator = -1;                                          // offset in the State block
    int delay_slots = 0;                                        // of a hydraulic actuator
    int command = -1, stuck = -1, valve_stuck = -1, leak = -1;  // inputs
    int temperature = -1;                                       // of the surface, offset in the State block
    // The sense of torque and slip in which the pair holds less than in the other, ±1, and what it holds and passes on
    // there, of its load [1]. 0: both senses are alike.
    double weak_sense = 0, weak_factor = 0;
    const FacingHeat* heat = nullptr;
};

// Where a law acts on a mass: as f[force], with −slip[force] as the speed of the mass.
struct TyreLaw {
    int wheel = -1, body = -1, mobility = -1;
    int wheel_force = -1, body_force = -1;
    int resistance = -1;  // friction pair of the body
    double share = 1;     // its mobility number over that of the first tyre, which the input means
};
struct ConverterLaw {
    int pump = -1, turbine = -1;
    int pump_force = -1, turbine_force = -1;
    std::vector<ConverterKnot> knots;
};
struct EngineLaw {
    int mass = -1, pair = -1;
    int force = -1;
    double peak = 0;  // of the full-load curve [Nm]
    Curve full_load;
    int start = -1, speed_request_enable = -1, speed_request = -1, torque_limit = -1, fuel_cut = -1;
};
struct SourceLaw {
    int mass = -1, input = -1;
    int force = -1;
};
struct PloughLaw {
    int mass = -1, pair = -1;  // the body, and the friction pair that resists it
    int force = -1;
    PloughCurve curve;
};
struct SensorLaw {
    int mass = -1;
    int bias = -1, noise = -1, stuck = -1, dropout = -1, missing_teeth = -1;
};

// Constants of heated clutches and of pick-ups for the loops over all of them (device_loops.h says what they are), in
// whole panels.
struct HeatNumbers {
    std::vector<double> e11, e12, e21, e22, f1, f2, warn, fail;
    std::vector<int> pair;
};
struct PickupNumbers {
    std::vector<double> teeth, pitch, directional, drop_out_speed;
    std::vector<int> mass;
};

struct ModelData {
    Description description;
    BuildOptions options;
    Structure structure;
    Kernel kernel;

    // z = [ω; φ]; f = [pairs; bearing friction of meshes; external torques; ∓kδ of flanks].
    int masses = 0, twists = 0, pairs = 0, meshes = 0;
    int states = 0, states_padded = 0;
    int forces = 0;             // m
    int first_external = 0;     // where bearing friction ends in f
    int first_flank_force = 0;  // where external torques end in f
    int plain_shafts = 0;       // without play; those with it follow
    int columns = 0;            // states + m, at most what an operator multiplies
    // What a view shows: slips of forces, motions of meshes; from `law_rows` on what losses of meshes, shafts and dampers
    // act on; from `power_rows` on z.
    // Both are whole panels, so that the first part alone (force laws), or the first two (powers), are products too.
    int law_rows = 0, power_rows = 0, seen = 0;
    int torques = 0;                                 // unknowns: pairs, meshes, losses of stuck meshes
    int auxiliary = 0;                               // tyre slips, engine torque and boost
    int contact_bytes = 0;                           // pairs, meshes, flanks
    int first_flank = 0;                             // contact byte: pairs + meshes
    int maximum_events = 0, maximum_parts = 0;       // of a step, as described or as flanks and friction need
    std::vector<std::array<Link, 2>> force_columns;  // how f_k acts *out of* the masses (SDM sign)
    // Slips and twist rates for the step: the housing is there mass 0 with factor 0, which needs no branch.
    std::vector<std::array<Link, 2>> pair_slip, mesh_motion, mesh_loss, shaft_rate, damper_rate, force_on;
    std::vector<std::array<Link, 3>> mesh_slip;
    std::vector<unsigned char> lossy;  // per mesh
    std::vector<int> lossy_meshes, lossless_gears;
    // Torque at which the loss lines of both directions cross, moving forward [Nm].
    std::vector<double> loss_kink;
    bool depends_on_time = false;     // waveforms: forces are no function of state and inputs alone
    std::vector<int> bearing_force;   // per mesh, −1: none
    std::vector<int> external_force;  // per mass, −1: none
    double drag_speed_limit = 0;      // of open clutches [rad/s]
    double noteworthy_torque =
        0;  // 1 % of the weakest clutch or brake, less is idling; 0: there is none [Nm]
    std::vector<double> root_inertia;  // √J
    // For the loops over all devices, so many zeros longer that whole registers can be read:
    std::vector<double> energy_factor;                   // by state: J/2, then k/2
    std::vector<double> static_factor, sliding_at_rest;  // per pair: of its load [1]
    std::vector<double> shaft_stiffness;                 // per twist
    std::vector<double> swing_damping;                   // of shafts, then dampers
    // Per force: 1 where its power is lost in a pair or bearing, where it comes from outside.
    std::vector<double> power_lost, power_given;
    bool loses_in_fields = false;  // there are tyres or converters
    int swings = 0;                // shafts and dampers
    int ledger_levels = 0;  // of ever shorter parts that the ledger may need where dampers act (ledger.h)
    std::vector<int> translating, translating_force;  // masses
    std::unique_ptr<TreeTopology> tree;               // of the engine for long chains; none: dense modes
    std::string engine_reason;                        // why so, in words

    std::vector<PairLaw> pair_laws;
    std::array<int, connector_kinds>
        first_pair{};                // by place in the list of connectors.h: pairs of one kind stand side
                                     // by side, in the order of the description; −1: none
    bool rare_forces = false;        // there are tabled or one-way pairs, bearing friction, or backlashes
    std::vector<int> one_way_pairs;  // those with a weak sense
    std::vector<int> tabled_pairs;   // whose friction factor is a table
    std::vector<BacklashLaw> backlashes;
    std::vector<int> hydraulic_pairs, pedal_pairs, waveform_pairs;  // by what actuates them
    std::vector<int> heated_pairs;
    int actuated_pairs =
        0;  // pairs before those that are loaded by nature (rolling, resistance, engine, rated)
    std::vector<TyreLaw> tyres;
    std::vector<ConverterLaw> converters;
    std::vector<EngineLaw> engines;
    std::vector<SourceLaw> sources;
    std::vector<int> road_mass, road_force;  // per road
    std::vector<PloughLaw> ploughs;
    std::vector<SensorLaw> sensors;
    HeatNumbers heat;
    PickupNumbers pickups;
    std::vector<double> breakpoints;  // of all waveforms, sorted [s]

    std::vector<Signal> inputs, outputs;
    std::map<std::string, int, std::less<>> input_index, output_index;
    std::vector<std::string> device_names;  // friction pairs, meshes, backlashes, engines
    int throttle = -1, brake = -1, grade = -1, draft = -1, oil_temperature = -1;
    StateLayout layout;
};

}  // namespace shiftrig::plant::detail
