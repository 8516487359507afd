// What a user wrote about his machine, as plain data in SI units: masses, the connectors between them (each kind has
// its header in plant/connectors/), fluids, sensors. io/ fills it from YAML, tests fill it by hand, and Model::build()
// (plant.h) turns it into something that steps or names what is wrong with it.
//
// Links are mass names. An empty second link means the housing (where a device allows it).
// Signs follow [Algin]: a device's torque M_k is the torque on its first link; positive M_k is passed
// from the first mass into the device.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "plant/connectors/backlash.h"
#include "plant/connectors/clutch.h"
#include "plant/connectors/converter.h"
#include "plant/connectors/damper.h"
#include "plant/connectors/engine.h"
#include "plant/connectors/freewheel.h"
#include "plant/connectors/gear.h"
#include "plant/connectors/planetary.h"
#include "plant/connectors/plough.h"
#include "plant/connectors/road.h"
#include "plant/connectors/shaft.h"
#include "plant/connectors/source.h"
#include "plant/connectors/tyre.h"

namespace shiftrig::plant {

struct Mass {
    std::string name;
    double inertia = 0;  // [kg m²], or [kg] where translating
    Motion motion = Motion::rotating;
    double initial_speed = 0;  // [rad/s] or [m/s]
};

// ---- fluids, sensors ------------------------------------------------------------------------------------

struct Oil {
    double viscosity_at_zero = 0;     // [Pa s] at 0 °C
    double viscosity_decay = 0;       // η = viscosity_at_zero·exp(−decay·T) [1/°C]
    double initial_temperature = 90;  // [°C], input `environment.oil_temperature`
    double drag_speed_limit = 60;     // open-clutch drag is linear up to this slip [rad/s]
    double cold_temperature = -10;    // [°C] where the two factors below hold; ln-viscosity between
    double warm_temperature = 90;
    double cold_dead_time_factor = 4;
    double cold_valve_frequency_factor = 0.4;
    double fill_viscosity = 0.1;  // fill flow ÷ (1 + η/fill_viscosity) [Pa s]
    double pump_flow = 0;         // shared by all clutches [m³/s]; 0: unlimited
};

// A speed pick-up. Ideal sensors copy the speed.
struct SpeedSensor {
    std::string name, mass;
    bool ideal = true;
    int teeth = 0;
    bool directional = false;   // false: unsigned
    double drop_out_speed = 0;  // below it the sensor reads 0 [rad/s]
};

// ---- the machine -------------------------------------------------------------------------------------------

enum class Transition { next_step, localised };
enum class Method { automatic, etd3, ark3 };

// A named way to close the driveline: the gear table of `check`, the ratio definition of the scorecard.
struct GearPath {
    std::string name;                 // "F2"
    std::vector<std::string> closed;  // clutches and brakes closed in it
};

struct Description {
    std::string name;
    std::vector<Mass> masses;
    std::vector<Shaft> shafts;
    std::vector<Backlash> backlashes;
    std::vector<Damper> dampers;
    std::vector<Clutch> clutches;  // clutches, brakes, Coulomb wheel contacts
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
    static constexpr std::size_t most_selectors = 256;  // clutches that these name in all
    std::string input_mass, output_mass;                // of the gear table's ratio and of statics
    double gravity = 9.80665;                           // [m/s²]

    Transition transition = Transition::localised;
    Method method = Method::automatic;
    int maximum_events = 4;  // K: located in a step that is taken whole; one in n parts has room for n K
    // A step is taken in up to this many parts where shafts swing or forces change too fast for one; 1: never.
    // Both together bound the cost of a step, and are bounded for it. Where they are too few for the machine its model has more
    // (bound_step() in model_decisions.cpp): parts, if they are not 1, up to 256 for friction that changes too steeply over the
    // slip, up to 16384 for flanks that swing too fast; of events each backlash adds 2 and 2 for every 3 rad of ωh.
    int maximum_parts = 16;
    static constexpr int most_events = 64, most_parts = 256;
};

}  // namespace shiftrig::plant
