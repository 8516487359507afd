// A recording as a run in memory.
#pragma once

#include <string>
#include <vector>

#include "analysis/run.h"

namespace shiftrig::analysis {

// All signals, or only those named (names that the recording lacks are left out, like those of a model
// without that device). Changes of state in words, and the rig's own: safe command, states of messages.
// Throws io::InputError: the recording cannot be read. One that is cut short is loaded as far as it goes,
// and identity says so ("incomplete" → the reader's complaint); of a whole one it tells the outcome of its run ("unknown" in
// recordings of earlier versions).
Run load_run(const std::string& path, const std::vector<std::string>& signals = {});

}  // namespace shiftrig::analysis
