// Recordings and candump logs (io/can/candump.h), both ways: a recording told again as the frames of its machine's bus,
// and the log of a real machine's bus as a field recording.
#pragma once

#include <cstdint>
#include <string>

#include "io/can/mapping.h"
#include "io/recording/field.h"
#include "io/recording/reader.h"

namespace shiftrig::io {

// What rig and controller would have sent for the recorded signals, at the cycle times of the mapping that the recorded
// model names: `T` what the rig sends, `R` the commands as they acted. (The frames that really passed: `run --can-log`.)
// Returns the number of ticks. Throws RecordingError if the file cannot be written, InputError if the model has no
// stanza `can:` or its mapping cannot be read.
std::int64_t export_candump(RecordingReader& reader, const std::string& path);

// Whether the file begins as a candump log: `(seconds.micros) …`.
bool looks_like_candump(const std::string& path);

// Every signal that the mapping knows in the log's frames, whoever sent them, decoded with the same mistrust as on the
// bus, at rows 10 ms apart: signals with a unit interpolated between their frames, plain numbers held. Time begins with
// the log. Throws InputError naming the line of what cannot be read.
FieldRecording read_field_candump(const std::string& path, const can::Mapping& mapping);

}  // namespace shiftrig::io
