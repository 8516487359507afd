// Keeps a run in memory, tick by tick, for the judgement at its end. Room is taken beforehand, so that take() may be
// called from the loop; what does not fit any more is left out, and said.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "analysis/run.h"
#include "apps/rig/rig.h"

namespace shiftrig::rig {

struct CollectorOptions {
    std::size_t most_bytes = std::size_t{256} << 20;
    bool by_the_clock =
        true;  // take() has a deadline: memory is in place, columns wait. false: what takes least in all
    std::size_t most_events = 100'000;
    std::vector<std::string> only;  // keep these signals only; empty: all
};

class Collector {
  public:
    // For `ticks` ticks. Where all signals would not fit, only those that the judgement of shifts needs are kept.
    Collector(const Rig& rig, std::int64_t ticks, const CollectorOptions& options = {});

    void take(const Rig& rig) SHIFTRIG_REALTIME;

    // Everything taken so far, events in words; to be called once, after the run.
    analysis::Run finish(const Rig& rig);
    std::int64_t ticks_left_out() const noexcept { return left_out_; }
    // Of the plant and of the rig, whether a tick had no room for them or the collector.
    std::int64_t events_left_out() const noexcept { return events_left_out_; }

  private:
    void make_room(std::size_t ticks);   // in the columns
    void turn_over() SHIFTRIG_REALTIME;  // rows into columns

    std::vector<int> signals_;
    std::vector<plant::Event> plant_events_;
    std::vector<RigEvent> rig_events_;
    analysis::Run run_;
    // Time and signals, tick by tick: few cache lines in the loop. Of the whole run where a clock runs, otherwise of a batch.
    std::unique_ptr<double[]> rows_;
    std::size_t row_room_ = 0, row_count_ = 0;  // ticks
    std::size_t capacity_ = 0, count_ = 0;      // ticks
    std::int64_t left_out_ = 0, events_left_out_ = 0;
};

}  // namespace shiftrig::rig
