// LCM against the table of signals, with the shape of can::CanLink: receive() before the step, send()
// after it. Fields meet signals by a fixed convention (docs/lcm.md): arrays stand in the model's order of
// clutches, sensors, masses and shafts, and plant_info_t names them.
//
// The same class serves both ends: the rig answers with speeds to commands, the controller the other way
// round. A controller learns the machine from plant_info_t.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "io/lcm/endpoint.h"
#include "io/signals.h"
#include "plant/realtime.h"

namespace shiftrig::io::lcm {

enum class Role : std::uint8_t { rig, controller };

struct LinkOptions {
    Role role = Role::rig;
    std::string model_name;                         // rig: for plant_info_t
    std::int64_t tick_ns = 1'000'000;               // rig: for plant_info_t
    bool lockstep = false;                          // rig: for plant_info_t
    std::int64_t speeds_period_ns = 1'000'000;      // rig: cycle of speeds_t; the tick, if that is longer
    std::int64_t state_period_ns = 10'000'000;      // rig: cycle of plant_state_t and driver_input_t
    std::int64_t info_period_ns = 1'000'000'000;    // rig: cycle of plant_info_t
    std::int64_t status_period_ns = 10'000'000;     // controller: of engine_request_t, transmission_status_t
    std::int64_t command_timeout_ns = 100'000'000;  // rig: without a command for so long, none is valid
    std::int64_t find_rig_ns = 5'000'000'000;  // controller: how long the constructor waits for plant_info_t
};

// How a received channel fares, also as signal `bus.<message>.status` (as can::MessageStatus: 0 never seen,
// 1 alive, 3 lost).
struct ChannelReport {
    std::string channel;
    std::uint64_t good = 0;         // believed
    std::uint64_t lost = 0;         // by gaps in seq
    std::uint64_t stale = 0;        // repeated or overtaken, ignored
    std::uint64_t implausible = 0;  // not finite, counts out of range; ignored whole
    std::uint64_t restarts = 0;     // the sender began again
};

class LcmLink {
  public:
    // rig: `signals` holds the machine; adds `bus.<message>.status` of received messages,
    // `bus.command_valid`, and `controller.*` (what transmission_status_t says). controller: waits for
    // plant_info_t and adds what it names: the inputs of a controller, and the commands it gives. Throws
    // EndpointError.
    LcmLink(const std::string& url, SignalTable& signals, const LinkOptions& options = {});
    ~LcmLink();
    LcmLink(LcmLink&&) noexcept;

    void receive(std::int64_t now_ns, SignalTable& signals) SHIFTRIG_REALTIME;
    void send(std::int64_t now_ns, const SignalTable& signals) SHIFTRIG_REALTIME;

    // rig: a command has come within its timeout (true for one timeout of grace at the start).
    bool command_valid() const SHIFTRIG_REALTIME;
    // rig, lockstep: true from sending speeds_t until a clutch_command_t that answers it was received.
    bool awaiting_answer() const SHIFTRIG_REALTIME;
    // controller: a speeds_t has come that no clutch_command_t of ours has answered; send() answers it.
    bool question_pending() const SHIFTRIG_REALTIME;
    // Blocks until something can be received; false: nothing within `timeout_ns` of wall time. A rig in
    // lockstep repeats its question every 100 ms meanwhile.
    bool wait(std::int64_t timeout_ns) noexcept;

    // rig, lockstep: says plant_info_t and the last speeds_t again, with their old seq: for a controller that
    // came late, and against a lost question or answer (the controller then repeats its answer, and neither
    // side counts anything twice).
    void repeat_question() noexcept;

    // rig: from the arrival of a command to the sending of the first message that reflects it [ns], one not yet taken;
    // false if there is none.
    bool next_command_latency(std::int64_t& latency_ns) SHIFTRIG_REALTIME;

    // controller: simulated time of the newest speeds_t [ns].
    std::int64_t rig_time_ns() const SHIFTRIG_REALTIME;
    std::uint64_t messages_lost() const SHIFTRIG_REALTIME;  // all channels: gaps, dropped, failed to send
    std::vector<ChannelReport> report() const;
    EndpointCounters counters() const SHIFTRIG_REALTIME;
    // One line each, for the user, at start: clutches beyond 16 …
    const std::vector<std::string>& warnings() const noexcept;

  private:
    struct Data;
    std::unique_ptr<Data> data_;
};

}  // namespace shiftrig::io::lcm
