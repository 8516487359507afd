// What the sequence numbers of one channel tell: losses, repetitions, a sender that began again.
#pragma once

#include <cstdint>

#include "io/lcm/link.h"
#include "plant/realtime.h"

namespace shiftrig::io::lcm {

class Sequence {
  public:
    // True if the message is new. `silent`: nothing has come for so long that any number is a new beginning.
    bool accept(std::int64_t seq, bool silent, ChannelReport& report) SHIFTRIG_REALTIME {
        // A sender that has just started counts from 0; one that starts while its first messages are lost is
        // known by a long step back.
        constexpr std::int64_t long_step_back = 64;
        if (next_ >= 0 && seq < next_) {
            if (!silent && seq != 0 && next_ - seq < long_step_back) {
                ++report.stale;
                return false;
            }
            ++report.restarts;
        } else if (next_ >= 0) {
            report.lost += static_cast<std::uint64_t>(seq - next_);
        }
        next_ = seq + 1;
        return true;
    }

  private:
    std::int64_t next_ = -1;
};

}  // namespace shiftrig::io::lcm
