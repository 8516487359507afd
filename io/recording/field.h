// Recordings of a real machine: its commands drive the plant, its measured speeds are what the plant is held against.
#pragma once

#include <string>
#include <vector>

#include "plant/plant.h"

namespace shiftrig::io {

struct FieldColumn {
    std::string written;        // as the header has it: "sensor.output.speed_rpm"
    std::string signal;         // "sensor.output.speed"
    double factor = 1;          // SI = factor · written value
    std::vector<double> value;  // SI
};

struct FieldRecording {
    std::string path;
    std::vector<double> time;  // [s], rising
    std::vector<FieldColumn> columns;
};

// CSV with commas, semicolons or tabs; first column time_s, the others signals with their unit's suffix. Throws
// InputError naming file, line and column of what cannot be read.
FieldRecording read_field_csv(const std::string& path);

struct Fit {
    std::string written;  // the measured column
    plant::Unit unit{};
    double rms = 0, worst = 0;           // of simulated − measured, in the signal's SI unit
    double worst_time = 0;               // [s]
    double simulated = 0, measured = 0;  // then
};

struct FieldFit {
    std::vector<Fit> fits;
    std::vector<std::string> driven;   // columns used as inputs
    std::vector<std::string> ignored;  // columns that the model has no signal for
};

// Steps the plant from the first to the last row. It starts with `locked` devices locked and the masses at their
// measured speeds (`mass.<m>.speed`, or a sensor's). Inputs with a unit are interpolated between rows, those without
// (commands 0…1, flags) are held.
FieldFit replay_field(const FieldRecording& recording, const plant::Model& model,
                      const std::vector<std::string>& locked);

}  // namespace shiftrig::io
