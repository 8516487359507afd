// A place where a program touches a bus: the one abstract interface of io/. The in-process bus, SocketCAN,
// python-can's UDP multicast, logs and faults all stand behind it, so a link cannot tell them apart.
//
// Time is the caller's: every call says what time it is (simulated time in the rig, never decreasing).
// Ports on real wires ignore it and stamp with the kernel's clock; in-process ones live by it.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "io/can/frame.h"
#include "plant/realtime.h"

namespace shiftrig::io::can {

enum class PortState : std::uint8_t {
    up,
    down,     // interface down or gone; the port keeps trying to come back
    bus_off,  // the controller has left the bus after too many errors
};

// Everything that could be lost is counted somewhere here. All since opening.
struct PortCounters {
    std::uint64_t sent = 0;
    std::uint64_t received = 0;
    std::uint64_t send_dropped = 0;     // refused: queue full, ENOBUFS, interface down, bus off
    std::uint64_t receive_dropped = 0;  // lost before we read them: our queue or the kernel's (SO_RXQ_OVFL)
    std::uint64_t malformed = 0;        // arrived, but not a CAN frame
    std::uint64_t error_frames = 0;     // reported by the controller
    std::uint64_t bus_off_events = 0;
    std::uint64_t reconnects = 0;
};

class CanPort {
  public:
    virtual ~CanPort() = default;

    // Queues one frame; false (and counted) if it cannot be taken. Never blocks.
    virtual bool send(std::int64_t now_ns, const Frame& frame) SHIFTRIG_REALTIME = 0;
    // Fills `frames` from the front with what has arrived by now, oldest first; returns how many. Never
    // blocks.
    virtual std::size_t receive(std::int64_t now_ns, std::span<Frame> frames) SHIFTRIG_REALTIME = 0;
    virtual PortState state() const SHIFTRIG_REALTIME = 0;
    virtual PortCounters counters() const SHIFTRIG_REALTIME = 0;

    // Blocks the caller up to `timeout_ns` of wall time until a frame can be received; false if none came.
    // For lockstep only. A port on which nothing can arrive while the caller waits says false at once.
    virtual bool wait(std::int64_t timeout_ns) noexcept {
        static_cast<void>(timeout_ns);
        return false;
    }
    // Of a real wire: from the arrival of a command to the sending of the first frame that reflects it (Frame::answers_ns)
    // [ns], one not yet taken; false if there is none.
    virtual bool next_command_latency(std::int64_t& latency_ns) SHIFTRIG_REALTIME {
        static_cast<void>(latency_ns);
        return false;
    }
    // The bus as the user names it: `inprocess`, `can:vcan0`.
    virtual const std::string& description() const noexcept = 0;
};

}  // namespace shiftrig::io::can
