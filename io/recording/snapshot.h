// A snapshot is a recording without ticks whose manifest also holds the assembly's changing parts, so that a
// run can go on from it. It fits the program and the files (model, scenario) that it was made with.
#pragma once

#include <string>

#include "io/recording/manifest.h"

namespace shiftrig::io {

// `manifest` as for a recording that begins here, with `assembly` filled. Throws RecordingError.
void write_snapshot(const std::string& path, const Manifest& manifest);

// Throws RecordingError: one line naming the file; also if it is a recording and no snapshot.
Manifest read_snapshot(const std::string& path);

}  // namespace shiftrig::io
