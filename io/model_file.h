// The model file: a machine written in YAML, read into plant::Description and into what the bench
// itself must know about the machine (safe command, lever, bus).
//
// Everything wrong in it becomes one InputError naming file, line, column, device, key, value and rule:
// `config/tractor.yaml:31:5: clutch "F2": friction_radius_m = -0.09; must be > 0`.
#pragma once

#include <yaml-cpp/yaml.h>

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "io/input_error.h"
#include "plant/description.h"
#include "plant/plant.h"

namespace shiftrig::io {

// What a clutch's command becomes when the controller has been silent for too long.
struct SafeCommand {
    std::string clutch;
    std::string signal;  // the command input it drives: `clutch.F1.pressure_command`
    double value = 0;    // in the signal's unit
    double within = 0;   // reached linearly within this time from the last command [s]
};

struct LeverPosition {
    int lever = 0;          // value of `driver.lever`
    std::string gear_path;  // name in Description::gear_paths; empty: neutral
};

// How the machine meets its controller and its driver.
struct ControllerSide {
    double command_timeout = 0.1;            // [s] without a valid command until the safe command acts
    std::vector<SafeCommand> safe_commands;  // one per commanded clutch
    std::vector<LeverPosition> lever;        // what each position asks for
    std::string pedal_clutch;                // released by `driver.clutch_pedal`; empty: none
};

// Where in the file a device and its keys stand, for errors found after reading.
struct Place {
    std::string kind, device,
        key;              // "gear", "P1", "efficiency"; key empty: the device itself; no device: the file
    std::string written;  // the value as it stands there
    int line = 0, column = 0;
};

struct ModelFile {
    std::string path;  // as given
    std::string text;  // the whole file, verbatim, for the recording
    plant::Description description;
    ControllerSide controller;
    // The stanza `can:`, undefined if there is none; its format is io/can's.
    YAML::Node can{YAML::NodeType::Undefined};
    std::vector<Place> places;
};

// To assign over a file that has a stanza `can:` would write into that very node, and so into all copies of it.
inline void replace(ModelFile& file, ModelFile by) {
    file.can.reset();
    file = std::move(by);
}

// Throws InputError.
ModelFile read_model(const std::string& path);
ModelFile parse_model(const std::string& text, const std::string& path);

// The line for an error that plant/ found in the file's description.
InputError located(const ModelFile& file, const plant::ModelError& error);

// plant::Model::build with its errors located.
plant::Model build_model(const ModelFile& file, const plant::BuildOptions& options = {});

// Puts a gear's named option in use, such as range "M" of gear "range"; throws std::invalid_argument
// naming the options there are.
void select_option(plant::Description& description, const std::string& gear, const std::string& option);

// JSON Schema (draft 7) of a model file, made from the same field lists that read it.
nlohmann::ordered_json model_schema();

}  // namespace shiftrig::io
