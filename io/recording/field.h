// Recordings of a real machine: its commands drive the plant, its measured speeds are what the plant is held against.
#pragma once

#include <string>
#include <vector>

#include "plant/plant.h"

namespace shiftrig::io {

struct FieldColumn {
    std::string written;        // as the header has it: "sensor.output.speed_rpm"
    std::string signal;         // "sensor.output.speed"
    plant::Unit unit{};         // that its suffix belongs to; none: no suffix
    double factor = 1;          // SI = factor · written value
    std::vector<double> value;  // SI
};

struct FieldRecording {
    std::string path;
    std::vector<double> time;  // [s], rising
    std::vector<FieldColumn> columns;
};

// A column of that name, without values.
FieldColumn field_column(const std::string& written);

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

// An input with values beyond its range, which the plant does not get.
struct LimitedColumn {
    std::string written;
    std::size_t rows = 0;
    std::string rule;  // "must be within 0 and 1"
};

struct FieldFit {
    std::vector<Fit> fits;
    std::vector<std::string> driven;  // columns used as inputs
    std::vector<LimitedColumn> limited;
    std::vector<std::string> ignored;  // columns that the model has no signal for
};

// Steps the plant from the first to the last row. It starts with `locked` devices locked and the masses at their
// measured speeds (`mass.<m>.speed`, or a sensor's). Inputs with a unit are interpolated between rows, those without
// (commands 0…1, flags) are held; values beyond an input's range are limited and counted. Throws InputError
// where a column of one of the model's signals is not written in that signal's unit, where two are of one signal, and
// where the recording lasts less than half a step.
FieldFit replay_field(const FieldRecording& recording, const plant::Model& model,
                      const std::vector<std::string>& locked);

}  // namespace shiftrig::io
