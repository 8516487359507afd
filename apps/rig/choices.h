// From what a user chose (files, buses, a controller in words) to a rig's Setup.
#pragma once

#include <string>
#include <vector>

#include "apps/rig/rig.h"

namespace shiftrig::rig {

struct Choices {
    std::string model, scenario;     // files; one of them may be empty: a scenario names its model
    double rate_hz = 1000;           // of the ticks, 1 to 1e5
    int substeps = 1;                // plant steps per tick, ≥ 1
    std::vector<std::string> buses;  // empty: inprocess, where the model says what frames mean
    std::string controller;       // "builtin[:FILE]", "none", a command to start; empty: the scenario's, else
                                  // builtin on the in-process bus and nobody elsewhere
    std::string kernel = "auto";  // auto, portable, avx2, avx512
    bool lockstep = false;
    std::string can_log, can_replay;  // candump logs: written, and heard as if from the bus
};

// Reads the files and settles what was left open. Throws InputError and std::invalid_argument: one clear line.
Setup make_setup(const Choices& choices);
// The same for a scenario in memory (choices.scenario is not looked at).
Setup make_setup(const Choices& choices, io::ScenarioFile scenario);

// What a scenario does to the buses: their faults, and when the built-in controller is silent. Part of make_setup. Throws
// InputError.
void follow_scenario(const io::ScenarioFile& scenario, BusSetup& buses);

// Puts the built-in controller on the in-process bus, with this calibration. Throws InputError.
void build_in(BusSetup& buses, const std::string& calibration_text, const std::string& calibration_path);

// The calibration of the built-in controller where nobody names another: a file.
std::string shipped_calibration();

// The command to be started as the controller; empty if it is none, or built in.
std::string controller_command(const Choices& choices);

}  // namespace shiftrig::rig
