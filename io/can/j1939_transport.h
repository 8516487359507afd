// J1939 transport protocol [J1939-21] for messages of 9 to 252 bytes: announced to everybody (BAM, a packet every
// 50 ms) or in a conversation with one receiver (RTS, CTS, packets, end of message). Time is the caller's.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "io/can/port.h"
#include "io/can/ring.h"

namespace shiftrig::io::can::j1939 {

constexpr std::uint8_t kEverybody = 0xFF, kNoAddress = 0xFE;

struct LongMessage {
    static constexpr std::size_t kLongest = 252;
    std::uint32_t pgn = 0;
    std::uint8_t source = 0, destination = kEverybody;
    std::uint16_t length = 0;
    std::array<std::uint8_t, kLongest> data{};
    int packets() const noexcept { return (length + 6) / 7; }
};

class Transport {
  public:
    // Queues a message; false if eight are waiting already.
    bool send(const LongMessage& message) SHIFTRIG_REALTIME { return waiting_.push(message); }
    bool full() const SHIFTRIG_REALTIME { return waiting_.full(); }
    // A message of this node to everybody is waiting or being sent.
    bool announces(std::uint8_t source) const SHIFTRIG_REALTIME {
        const auto announced = [source](const LongMessage& message) SHIFTRIG_REALTIME {
            return message.source == source && message.destination == kEverybody;
        };
        return (phase_ != Phase::idle && announced(sending_)) || waiting_.any(announced);
    }
    // A frame of PGN 60416 or 60160. `ours` says whether an address is one we play.
    template <class Ours>
    void take(const Frame& frame, std::int64_t now_ns, CanPort& port, Ours ours) SHIFTRIG_REALTIME {
        const auto destination = static_cast<std::uint8_t>(frame.id >> 8);
        if (destination == kEverybody || ours(destination)) take(frame, now_ns, port);
    }
    // Sends what is due: at most one packet a call.
    void run(std::int64_t now_ns, CanPort& port) SHIFTRIG_REALTIME;
    // Messages that have arrived whole.
    bool next(LongMessage& message) SHIFTRIG_REALTIME;
    void archive(Archive& a) {
        waiting_.archive(a);
        arrived_.archive(a);
        a(arrivals_, phase_, sending_, next_packet_, clear_until_, due_ns_, deadline_ns_);
    }

  private:
    enum class Phase : std::uint8_t { idle, announce, packets, wait_clear, wait_end };
    struct Arrival {
        bool active = false;
        LongMessage message;
        int next_packet = 1;
        std::int64_t heard_ns = 0;
    };
    void take(const Frame& frame, std::int64_t now_ns, CanPort& port) SHIFTRIG_REALTIME;
    void manage(const Frame& frame, std::int64_t now_ns, CanPort& port) SHIFTRIG_REALTIME;
    void packet(const Frame& frame, std::int64_t now_ns, CanPort& port) SHIFTRIG_REALTIME;
    Arrival* arrival_from(std::uint8_t source, std::uint8_t destination) SHIFTRIG_REALTIME;

    Ring<LongMessage> waiting_{8}, arrived_{8};
    std::array<Arrival, 4> arrivals_;  // one a sender and destination

    Phase phase_ = Phase::idle;
    LongMessage sending_;
    int next_packet_ = 1, clear_until_ = 0;
    std::int64_t due_ns_ = 0, deadline_ns_ = 0;
};

}  // namespace shiftrig::io::can::j1939
