// Which signals stand at which place of the LCM messages' arrays.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "io/signals.h"
#include "shiftrig/plant_info_t.hpp"

namespace shiftrig::io::lcm {

inline constexpr std::size_t array_length = 16, mass_array_length = 32;

enum class CommandKind : std::int8_t { none = 0, pressure = 1, current = 2, fraction = 3 };

struct ClutchSignals {
    std::string name;
    CommandKind kind = CommandKind::none;
    // Indices into the table, −1 where it has no such signal.
    int command = -1, pressure = -1, torque = -1, slip = -1, capacity = -1, temperature = -1, state = -1;
};

struct NamedSignal {
    std::string name;
    int index = -1;
};

// The machine as LCM's messages see it.
struct Names {
    std::vector<ClutchSignals> clutches;
    std::vector<NamedSignal> sensors, masses, shafts;  // .speed, .speed, .torque
    std::string engine;                                // the first engine; empty: none
    int engine_load = -1, engine_torque = -1;
    int speed_request_enable = -1, speed_request = -1, torque_limit = -1, fuel_cut = -1;
    int oil_temperature = -1, acceleration = -1, distance = -1, draft = -1;
    int throttle = -1, brake = -1, clutch_pedal = -1, lever = -1, automatic = -1, parking_brake = -1;
    int safe_command = -1, overruns = -1, tick_load = -1;
    int selected_gear = -1, current_gear = -1, shift_in_process = -1, limp = -1;
};

int find_or_add(SignalTable& signals, const std::string& name, plant::Unit unit = plant::Unit::one);

// The rig: from the signals that the table has. What exceeds the arrays is left out, with a warning each.
Names names_of_rig(SignalTable& signals, std::vector<std::string>& warnings);
// The controller: from what the rig says of itself; adds to the table what it lacks.
Names names_of_controller(const plant_info_t& info, SignalTable& signals);
// Fills names, counts and kinds of commands.
void describe(const Names& names, plant_info_t& info);

}  // namespace shiftrig::io::lcm
