// A CAN bus inside the program: two or more ends, simulated time, the same frames at the same times in
// every run. One thread drives all ends.
//
// With bit_rate 0 the bus is ideal: what one end sends the others may receive at once. With a bit rate a
// frame takes its exact number of bits; while the bus is busy frames wait, each end's in the order it sent
// them, and of those at the heads of the queues the lowest identifier goes next, as arbitration has it.
// Frames handed over at the same instant compete with each other. Not modelled: error frames, retransmission.
#pragma once

#include <memory>
#include <vector>

#include "io/archive.h"
#include "io/can/port.h"
#include "io/can/ring.h"

namespace shiftrig::io::can {

struct InProcessOptions {
    double bit_rate = 0;              // [bit/s], 0: ideal bus
    double data_bit_rate = 0;         // [bit/s] of FD frames that switch; 0: bit_rate
    std::size_t queue_frames = 1024;  // per end and direction; beyond it frames are dropped and counted
};

class InProcessBus {
  public:
    explicit InProcessBus(int ends = 2, const InProcessOptions& options = {});
    ~InProcessBus();
    InProcessBus(const InProcessBus&) = delete;
    InProcessBus& operator=(const InProcessBus&) = delete;

    // Valid as long as the bus is.
    CanPort& end(int index);
    // Time the bus has been occupied so far [ns]; load = busy / elapsed. 0 on an ideal bus.
    std::int64_t busy_ns() const noexcept { return busy_ns_; }

    // Everything on the wire and in the queues.
    void archive(Archive& archive);

  private:
    class End;
    void run_to(std::int64_t now_ns) SHIFTRIG_REALTIME;
    void deliver(const End& from, const Frame& frame) SHIFTRIG_REALTIME;

    InProcessOptions options_;
    std::vector<std::unique_ptr<End>> ends_;
    std::int64_t free_at_ns_ = 0;  // when the frame on the wire ends
    std::int64_t busy_ns_ = 0;
};

}  // namespace shiftrig::io::can
