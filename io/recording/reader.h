// Reads a recording tick by tick and trusts nothing in it: frames, numbers, times, layouts and checksums
// are all checked, so that one flipped bit anywhere is found.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "io/recording/event_log.h"
#include "io/recording/manifest.h"
#include "io/recording/records.h"
#include "plant/plant.h"

namespace shiftrig::io {

enum class Table : std::int16_t { inputs = 0, outputs = 1, rig = 2 };

// A value that is not what the writer wrote: its record's checksum is right again with this one bit flipped
// back. The reader goes on with what was written.
struct Damage {
    std::int64_t tick = 0;
    Table table{};
    std::size_t signal = 0;  // index within the table
    double found = 0, written = 0;
};

struct RecordedTick {
    std::int64_t tick = 0, sim_time_ns = 0;
    std::vector<double> inputs, outputs, rig;  // all of them, changed in this tick or not
    std::vector<plant::Event> events;
    record_tick_t closing{};
    std::optional<record_timing_t> timing;
    std::vector<std::byte> state;  // plant::State::bytes() at the end of the tick; mostly empty
    std::int64_t lost_before = 0;  // ticks missing just before this one
    std::vector<Damage> damages;
};

enum class Ending {
    complete,   // the closing record is there
    cut_short,  // the run or the file was cut; all ticks before are sound
    damaged,    // something cannot be believed
};

class RecordingReader {
  public:
    // Reads the manifest, the texts and the initial state. Throws RecordingError: one line naming the file and
    // what is wrong with it (empty, foreign, cut before the first tick, another format, damaged).
    explicit RecordingReader(const std::string& path);
    ~RecordingReader();
    RecordingReader(RecordingReader&&) noexcept;

    const Manifest& manifest() const noexcept;
    const std::string& path() const noexcept;
    // False at the end; then ending() and complaint() say why.
    bool next(RecordedTick& tick);
    Ending ending() const noexcept;
    // One line naming the file for any ending but complete, otherwise empty.
    const std::string& complaint() const noexcept;

    // At the end of a complete recording: what its run came to ("completed", "stopped", "too_far_behind", …); empty: it does
    // not say, it is of an earlier version.
    const std::string& outcome() const noexcept;
    // One line naming the file if the run did not come to its end, otherwise empty.
    std::string unfinished() const;

    // At the end of a complete recording: ticks lost behind the last one that was kept.
    std::int64_t lost_at_end() const noexcept;

    const plant::Signal& signal(Table table, std::size_t index) const;

  private:
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

// Whether the file begins as an LCM event log or zstd frame, without further trust.
bool looks_like_recording(const std::string& path);

}  // namespace shiftrig::io
