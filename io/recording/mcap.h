// A recording as an MCAP file (https://mcap.dev/spec) with JSON messages and JSON Schemas, for Foxglove,
// PlotJuggler and whatever else reads MCAP. One topic per device (`/clutch/F1`), its quantities as fields
// with their units (`pressure_pa`, schema: "unit": "Pa"), one message a tick; changes of state on
// `/events`; the model and the scenario as metadata. Chunks are compressed with zstd and indexed.
#pragma once

#include <cstdint>
#include <string>

#include "io/recording/reader.h"

namespace shiftrig::io {

// Returns the number of ticks written; "-" is standard output. Throws RecordingError if the file cannot be written.
std::int64_t export_mcap(RecordingReader& reader, const std::string& path);

}  // namespace shiftrig::io
