// What a scenario sets, and when: values that jump, or run linearly, to where they shall be.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "io/archive.h"
#include "io/scenario_file.h"
#include "io/signals.h"
#include "plant/realtime.h"

namespace shiftrig::rig {

// The index of a signal a scenario may set: `settable` tells by index. Throws InputError naming file, line and rule.
int find_settable(const io::SignalTable& signals, const std::vector<bool>& settable, const std::string& path,
                  const io::NamedQuantity& quantity);

// The lever stands in a gear, and in none between two: a signal that takes whole numbers, at once.
bool takes_whole_numbers(const std::string& signal);
// Throws InputError where the scenario has it otherwise.
void check_whole_numbers(const io::ScenarioFile& scenario);

class Timeline {
  public:
    // One entry of the scenario and how far it has come; plain data, so that a snapshot is a copy.
    struct Entry {
        std::int64_t at, over;  // [ns]
        int signal;
        double value;
        double from = 0;  // the signal's value when it began
        bool done = false;
    };

    Timeline() = default;
    Timeline(const io::ScenarioFile& scenario, const io::SignalTable& signals,
             const std::vector<bool>& settable);

    // Sets what is due at `time_ns`: an entry at s acts from the first tick with t ≥ s on.
    void apply(std::int64_t time_ns, io::SignalTable& signals) SHIFTRIG_REALTIME;
    // The entries that the last apply() began.
    std::span<const Entry> begun() const noexcept {
        return std::span(entries_).subspan(begun_, next_ - begun_);
    }

    void archive(io::Archive& a) { a(entries_, begun_, next_, oldest_); }

  private:
    std::vector<Entry> entries_;  // by time
    std::size_t begun_ = 0;       // first entry that the last apply() began
    std::size_t next_ = 0;        // first entry not yet begun
    std::size_t oldest_ = 0;      // first entry that may still be running
};

}  // namespace shiftrig::rig
