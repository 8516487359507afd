// Snapshots of a rig: taken between two ticks, written as a file, and a rig made from one that goes on as if nothing
// had happened. What stands behind real buses (a controller of its own) is not in it: it goes on from where it is.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "analysis/run.h"
#include "apps/rig/rig.h"
#include "io/recording/manifest.h"
#include "rt/loop.h"

namespace shiftrig::rig {

// Takes a copy once the rig's time has come. Allocates beforehand, so that offer() may be called from the loop.
class SnapshotTaker {
  public:
    SnapshotTaker(Rig& rig, double at_s);
    void offer(Rig& rig);  // after every tick
    bool taken() const noexcept { return tick_ >= 0; }
    // After the run. `run` gives the history that a judgement of a shift in progress needs. Throws RecordingError.
    void write(const std::string& path, const Rig& rig, const rt::LoopSettings& loop,
               const analysis::Run& run) const;

  private:
    std::int64_t at_ns_;
    std::int64_t tick_ = -1;  // ticks done when it was taken
    std::vector<std::byte> assembly_, state_;
};

// The set-up that a snapshot was made with: model, scenario and calibration as they were, the same buses. Throws
// InputError.
Setup setup_of(const io::Manifest& snapshot);
// Brings a rig of that set-up to where the snapshot was taken. Throws InputError if it does not fit.
void resume(Rig& rig, const io::Manifest& snapshot);

// The run before the snapshot, as far as it was kept (the signals of the scorecard, the last second or so).
analysis::Run history_of(const io::Manifest& snapshot);

}  // namespace shiftrig::rig
