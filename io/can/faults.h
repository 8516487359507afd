// A bus that misbehaves on purpose: a decorator over any port that drops, delays, doubles, corrupts … frames by
// simulated time and from a seed, so that a run with faults is as repeatable as one without.
//
//     bus_faults:                       # of a scenario; or the list alone
//       seed: 7                         # [the scenario's]
//       bit_rate: 250000                # the in-process bus with arbitration and the true length of frames
//       faults:
//         - {fault: drop, message: ClutchCommandA, from_s: 2, until_s: 2.5, probability: 0.3}
//         - {fault: delay, from_s: 3, by_ms: 20}                        # every message, both ways, to the end
//         - {fault: jitter, message: EEC1, direction: sent, by_ms: 5}   # up to 5 ms late
//         - {fault: corrupt, bits: 2, probability: 0.01}                # flips two bits
//         - {fault: freeze, message: ShaftSpeedsB, signal: Wheels, from_s: 1}
//         - {fault: wrong_counter | wrong_checksum | duplicate | reorder, message: …}
//         - {fault: babble, rate_hz: 1500, id: 0x0, from_s: 4, until_s: 5}
//         - {fault: bus_off, from_s: 6, until_s: 6.3}
//
// `direction` is seen from the port's owner: received, sent, both (the default).
#pragma once

#include <yaml-cpp/yaml.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "io/can/codec.h"
#include "io/can/link.h"
#include "io/can/open_port.h"
#include "io/can/port.h"
#include "io/can/ring.h"

namespace shiftrig::io::can {

enum class FaultKind : std::uint8_t {
    drop,
    delay,   // by `by_ns`
    jitter,  // by 0 … `by_ns`, so that frames may overtake each other
    duplicate,
    reorder,        // comes after the frame that follows it
    corrupt,        // `bits` random bits of the data flipped
    freeze,         // a signal stays at its value; checksum and counter stay right
    wrong_counter,  // the counter stands still; the checksum stays right
    wrong_checksum,
    babble,   // somebody sends frames of identifier `id` at `rate_hz`
    bus_off,  // nothing goes out or comes in
};

struct BusFault {
    FaultKind kind = FaultKind::drop;
    std::string message, signal;  // message empty: every frame
    bool on_received = true, on_sent = true;
    std::int64_t from_ns = 0, until_ns = INT64_MAX;
    double probability = 1;
    std::int64_t by_ns = 0;
    int bits = 1;
    double rate_hz = 0;
    std::uint32_t id = 0;
};

struct FaultPlan {
    std::uint64_t seed = 1;
    double bit_rate =
        0;  // [bit/s] of an in-process bus that takes its time, with arbitration; 0: it takes none
    std::vector<BusFault> faults;
};

// Throws InputError naming file, line, column and rule; messages and signals must exist in the mapping's DBC.
// `seed` is the plan's where the faults name none.
FaultPlan parse_faults(const YAML::Node& node, const std::string& file, const Mapping& mapping,
                       std::uint64_t seed = 1);

// One line for events: `drop ClutchCommandA`.
std::string describe(const BusFault& fault);

struct FaultEvent {
    std::int64_t time_ns = 0;
    int fault = 0;  // index in the plan
    bool begins = true;
    std::uint64_t frames = 0;  // touched so far
};

class FaultyPort final : public CanPort {
  public:
    // `port` must outlive it.
    FaultyPort(CanPort& port, const FaultPlan& plan, const Mapping& mapping);
    ~FaultyPort() override;

    bool send(std::int64_t now_ns, const Frame& frame) SHIFTRIG_REALTIME override;
    std::size_t receive(std::int64_t now_ns, std::span<Frame> frames) SHIFTRIG_REALTIME override;
    PortState state() const SHIFTRIG_REALTIME override;
    PortCounters counters() const SHIFTRIG_REALTIME override;
    bool wait(std::int64_t timeout_ns) noexcept override { return port_.wait(timeout_ns); }
    const std::string& description() const noexcept override { return port_.description(); }

    // Beginnings and ends of faults since the last call.
    bool next_event(FaultEvent& event) SHIFTRIG_REALTIME;
    const FaultPlan& plan() const noexcept { return plan_; }
    void archive(Archive& archive);

  private:
    struct Active;  // a fault with its descriptors and its state
    struct Waiting {
        std::int64_t due_ns;
        std::uint64_t order;
        Frame frame;
        // The earliest due, first come first served among equals, is on top of the heap.
        bool operator<(const Waiting& other) const noexcept {
            return due_ns != other.due_ns ? due_ns > other.due_ns : order > other.order;
        }
    };
    enum class Way : std::uint8_t { received, sent };

    void advance(std::int64_t now_ns) SHIFTRIG_REALTIME;
    void pass(const Frame& frame, std::int64_t now_ns, Way way) SHIFTRIG_REALTIME;
    void enqueue(const Frame& frame, std::int64_t due_ns, Way way) SHIFTRIG_REALTIME;
    bool take(std::int64_t now_ns, Way way, Frame& frame) SHIFTRIG_REALTIME;

    CanPort& port_;
    FaultPlan plan_;
    std::vector<Active> faults_;
    std::vector<Waiting> waiting_[2];  // heaps, by Way
    std::uint64_t order_ = 0;
    std::uint64_t dropped_sending_ = 0, dropped_receiving_ = 0;
    bool off_ = false;
    std::uint64_t bus_offs_ = 0;
    Ring<FaultEvent> events_{64};
    std::array<Frame, 64> buffer_;
};

}  // namespace shiftrig::io::can
