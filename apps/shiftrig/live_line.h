// One line on a terminal that tells how the run goes: time, gear, engine speed, speed, slip, load of the loop.
#pragma once

#include <cstdint>
#include <string>

#include "apps/rig/rig.h"
#include "rt/latest_value.h"

namespace shiftrig::cli {

class LiveLine {
  public:
    // Silent unless the standard error output is a terminal.
    explicit LiveLine(const rig::Rig& rig);

    bool shown() const noexcept { return shown_; }
    void take(const rig::Rig& rig) SHIFTRIG_REALTIME;  // in the loop
    void show();                                       // elsewhere, a few times a second
    void end();                                        // leaves the last line standing

  private:
    struct Values {
        double time = 0, gear = 0, engine = 0, vehicle = 0, slip = 0, load = 0, safe = 0;
    };
    bool shown_;
    int gear_, engine_, vehicle_, slip_;  // signals, −1: the machine has none
    const rig::RigSignals own_;
    std::int64_t taken_ = 0;
    rt::LatestValue<Values> latest_;
};

}  // namespace shiftrig::cli
