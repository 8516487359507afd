// From a command on the bus to the first signal that reflects it: stamps come from whoever takes a command off the wire,
// travel with the first message sent after a step that had the command as its input, and meet the clock again in the
// thread that has just put this message on the wire.
#pragma once

#include <readerwriterqueue/readerwriterqueue.h>

#include <cstdint>
#include <ctime>

#include "plant/realtime.h"

namespace shiftrig::io {

class CommandLatencies {
  public:
    // The sending thread: a message has gone out that is the first to reflect a command which arrived at `arrived_ns`
    // of CLOCK_REALTIME, the clock of the kernel's stamps. 0 is no command; a stamp of another clock (of a log that is
    // replayed, of a CAN controller) shows by its distance and is left out.
    void sent(std::int64_t arrived_ns) noexcept {
        if (arrived_ns == 0) return;
        timespec now;
        clock_gettime(CLOCK_REALTIME, &now);
        const std::int64_t latency = std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec - arrived_ns;
        if (0 <= latency && latency < longest_ns) latencies_.try_enqueue(latency);
    }

    // The loop: the next one not yet taken [ns]; false if there is none.
    SHIFTRIG_TRUSTED_BEGIN  // neither allocates nor locks
        bool
        next(std::int64_t& latency_ns) SHIFTRIG_REALTIME {
        return latencies_.try_dequeue(latency_ns);
    }
    SHIFTRIG_TRUSTED_END

  private:
    static constexpr std::int64_t longest_ns = 10'000'000'000;
    moodycamel::ReaderWriterQueue<std::int64_t> latencies_{1024};
};

}  // namespace shiftrig::io
