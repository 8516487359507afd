// Where things are in the State block, in doubles. The block is plain numbers, so its bytes are a snapshot.
//
//   steps (an int64), masses, twists (int64 each), h          header, 4 slots
//   ω                     speeds in description order         [rad/s] or [m/s]
//   φ                     twists of the shafts                [rad]
//   distance              of translating masses               [m]
//   auxiliary             κ per tyre [1]; torque [Nm] and boost [1] per engine
//   contact               one byte per pair, mesh and shaft with play (contact.h)
//   actuators             per clutch as its actuation needs
//   heat                  per friction pair, since start      [J]
//   temperature           surfaces of heated clutches, then their bulks, in whole panels (kernels.h) each   [°C]
//   energy                input, dissipated, stored at start  [J]
//   engine                mode, cranking time [s], last start input
//   sensor                positions, times since the last tooth, readings, outputs (laws/sensor.h), whole panels each
//   tie-up                1 while a torque split is not unique
//   loops                 of each friction pair 1 while that is told of it
//   drive side            of each mesh as last told: x, 0 never
//   resting               of each mesh 1 while it is told to be stuck
#pragma once

#include <cstdint>
#include <cstring>

#include "plant/kernels.h"
#include "plant/laws/hydraulics.h"

namespace shiftrig::plant::detail {

struct StateLayout {
    static constexpr int header = 4;
    int speeds = 0, twists = 0, distances = 0, auxiliary = 0, contact = 0, actuators = 0, heat = 0,
        temperatures = 0, energy = 0, engines = 0, sensors = 0, tie_up = 0, loops = 0, drive_sides = 0,
        resting = 0, size = 0;
    int bulk_temperature = 0;  // from a clutch's surface to its bulk
};

inline std::int64_t read_integer(const double* slot) noexcept {
    std::int64_t value;
    std::memcpy(&value, slot, sizeof value);
    return value;
}
inline void write_integer(double* slot, std::int64_t value) noexcept {
    std::memcpy(slot, &value, sizeof value);
}

// What all pick-ups remember, side by side.
template <typename Number>
struct SensorSlotsOf {
    Number *position, *since_edge, *reading, *output;
};
using SensorSlots = SensorSlotsOf<double>;
template <typename Number>
SensorSlotsOf<Number> sensor_slots(const StateLayout& layout, std::size_t sensors, Number* block) noexcept {
    const int panel = whole_panels(static_cast<int>(sensors));
    Number* const at = block + layout.sensors;
    return {at, at + panel, at + 2 * panel, at + 3 * panel};
}

// A hydraulic actuator: its state, then the delay line.
constexpr int hydraulic_slots = 8, head_slot = 1, chamber_slot = 6, steady_slot = 7;
inline HydraulicState read_hydraulic(const double* at) noexcept {
    return {at[0], at[1], at[2], at[3], at[4], at[5], at[6], at[7]};
}
inline void write_hydraulic(double* at, const HydraulicState& s) noexcept {
    const double values[hydraulic_slots] = {s.play,       s.head,   s.slewed,  s.valve,
                                            s.valve_rate, s.piston, s.chamber, s.steady};
    for (int i = 0; i < hydraulic_slots; ++i) at[i] = values[i];
}

}  // namespace shiftrig::plant::detail
