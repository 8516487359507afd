// Writes a recording: an LCM event log (docs/recording.md) with everything needed to prove the run again.
//
//     RecordingWriter writer("shift.lcmlog");        // throws RecordingError: cannot be created
//     writer.begin(manifest);                        // before the first tick; allocates everything
//     for (...) { …step…; writer.tick(record); }     // copies into a preallocated queue, never waits
//     auto summary = writer.end();                   // waits until all is on its way to the disk
//
// A log thread encodes and writes. What a tick() took is handed to the kernel at most flush_bound later
// (and survives kill -9 of the rig from then on). Where the log thread cannot follow, ticks are lost, and
// the log says which; paces that can wait (lockstep, free) call wait_for_room() before each tick and lose
// none. A path ending in .zst is compressed (`zstd -d` gives back the plain log).
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "io/recording/manifest.h"
#include "plant/plant.h"
#include "plant/realtime.h"

namespace shiftrig::io {

// One tick as the rig hands it over; everything is copied.
struct TickRecord {
    std::int64_t tick = 0;                 // number of this tick, consecutive, first: manifest.first_tick
    std::int64_t sim_time_ns = 0;          // at the end of the tick
    std::span<const double> inputs;        // plant::Inputs::value, as held during the tick
    std::span<const double> outputs;       // plant::Outputs::value at its end
    std::span<const double> rig;           // the rig's own signals, in manifest order
    std::span<const plant::Event> events;  // of all substeps, at most plant::Outputs::event_capacity kept
    int events_not_kept = 0;
    plant::Certificate certificate;  // worst residuals, sums of counts over the substeps
    std::span<const std::byte>
        state;                       // plant::State::bytes() at the end of the tick; copied at keyframes only
    std::int64_t overruns = 0;       // since start
    std::int64_t messages_lost = 0;  // on all buses, since start
    // Wall clock, kept if manifest.wall_clock [ns]: start of the tick since start of the run, its lateness,
    // compute time.
    std::int64_t wall_ns = 0, lateness_ns = 0, compute_ns = 0;
};

struct RecordingOptions {
    std::size_t queue_bytes = 32u << 20;           // of the queue to the log thread
    std::chrono::milliseconds flush_interval{50};  // the log thread's rhythm
    int keyframe_interval = 1000;                  // ticks between full states
};

struct RecordingSummary {
    std::int64_t ticks = 0;  // kept
    std::int64_t lost = 0;   // not kept: the log thread fell behind
    std::int64_t bytes = 0;  // written
    std::string error;       // empty, or why the log is cut short ("… No space left on device")
};

class RecordingWriter {
  public:
    // Nothing that tick() took is older than this when the process is killed [ms].
    static constexpr std::chrono::milliseconds flush_bound{200};

    explicit RecordingWriter(const std::string& path, const RecordingOptions& options = {});
    ~RecordingWriter();  // as end(), if end() was not called
    RecordingWriter(const RecordingWriter&) = delete;
    RecordingWriter& operator=(const RecordingWriter&) = delete;

    // Once: a log holds one run. Throws RecordingError if the manifest cannot be written, std::logic_error the second time.
    void begin(const Manifest& manifest);
    // False: the tick was lost (counted and marked in the log), or the disk has failed.
    bool tick(const TickRecord& record) SHIFTRIG_REALTIME;
    // Blocks until a tick fits the queue. For paces without a wall clock.
    void wait_for_room();
    std::int64_t lost() const noexcept;
    // What the run came to, in a word ("completed", "stopped"), to be told before the closing record. Not called: nothing
    // is told.
    void came_to(const std::string& outcome);
    RecordingSummary end();

  private:
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

}  // namespace shiftrig::io
