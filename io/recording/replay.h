// Steps the plant again with the recorded inputs and holds every tick against the recording.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "io/recording/reader.h"
#include "plant/plant.h"

namespace shiftrig::io {

struct Difference {
    std::int64_t tick = 0;
    double time = 0;                 // [s]
    std::string signal;              // as column_name(); "state" and "event" for those
    std::string recorded, replayed;  // in digits that tell the two apart
    bool damaged = false;  // the log does not hold what was written: its checksum tells the true value
};

// How far one signal goes apart over the whole run.
struct Deviation {
    plant::Signal signal;
    double worst = 0;  // largest |replayed − recorded|, in the signal's unit
    std::int64_t worst_tick = -1;
    double recorded = 0, replayed = 0;  // then
    double sum_of_squares = 0;
    std::int64_t count = 0;
};

struct ReplayResult {
    std::int64_t ticks = 0;     // read
    std::int64_t compared = 0;  // held against the plant
    std::int64_t lost = 0;      // missing in the recording
    std::optional<Difference> first;
    std::vector<Deviation> deviations;  // outputs that both sides have, in recorded order
    // Every tick of the run was kept and compared, and none differs. What was lost proves nothing; a run that was stopped
    // before its first tick has nothing to prove.
    bool agrees() const { return !first && lost == 0 && compared == ticks; }
};

struct ReplayOptions {
    // 0: bit for bit. Otherwise |replayed − recorded| ≤ tolerance · max(1, |recorded|) agrees, and events and
    // states, which may then fall into another tick, are not compared.
    double tolerance = 0;
    // false: go on after the first difference, for `deviations` over the whole run.
    bool stop_at_first = true;
};

// `model` from rebuild_model(); or another machine with the same structure of state ("what would the new
// parameters have done"), then with stop_at_first = false. Signals meet by name. Throws RecordingError
// (without a path) if the recorded initial state does not fit the model. How the recording ended is the
// reader's to say.
ReplayResult replay(RecordingReader& reader, const plant::Model& model, const ReplayOptions& options = {});

}  // namespace shiftrig::io
