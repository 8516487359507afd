// Between a CAN port and the table of signals: what arrives is matched, mistrusted, decoded and written
// into the table; what is due is encoded from the table and sent. Everything is decided at construction;
// afterwards a frame is a look-up, shifts and masks, and nothing allocates.
//
// The same class serves both ends of the wire. A message belongs to the node that the DBC file names as its
// transmitter; the mapping says which nodes the rig plays. What the rig sends, the controller receives.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "io/archive.h"
#include "io/can/port.h"
#include "io/signals.h"
#include "plant/realtime.h"

namespace shiftrig::io::can {

struct Mapping;  // mapping.h

enum class Role : std::uint8_t { rig, controller };

// Published as signal `bus.<message>.status`.
enum class MessageStatus : std::uint8_t {
    never_seen = 0,
    alive = 1,
    late = 2,     // older than 1.5 cycles
    lost = 3,     // older than its timeout
    corrupt = 4,  // frames do arrive, but not one to be trusted since the last good one
};

// How a message fares; for summaries and tests.
struct MessageReport {
    std::string name;
    bool sent_by_us = false;
    MessageStatus status = MessageStatus::never_seen;
    std::uint64_t good = 0;          // trusted and decoded, or sent
    std::uint64_t wrong_length = 0;  // shorter than the DBC says
    std::uint64_t wrong_checksum = 0;
    std::uint64_t wrong_counter = 0;  // repeated, or further on than `counter.max_step`
    std::uint64_t implausible = 0;    // a value outside its plausible range, or the sender's error indicator
    std::uint64_t missed = 0;         // frames that the counter says were lost in between
    std::uint64_t timeouts = 0;       // times it went from alive or late to lost
    std::uint64_t limited = 0;        // values that had to be limited to the signal's range before sending
    std::uint64_t send_dropped = 0;   // refused by the port
};

// A trouble code of ours [J1939-73].
struct TroubleReport {
    std::uint32_t spn = 0;
    unsigned fmi = 0;
    std::string node;          // whose it is
    unsigned occurrences = 0;  // since start, 126 at most
    bool active = false;       // now
};

// J1939 address claim of every source address this end plays.
enum class AddressClaim : std::uint8_t {
    off,
    settled,  // claimed before time 0 and still defended: runs that start in motion
    claim,    // claims at start (claim_addresses(), or with the first send()) and waits as [J1939-81] wants
};

struct LinkOptions {
    Role role = Role::rig;
    AddressClaim address_claim = AddressClaim::settled;
    std::int64_t tick_ns =
        1'000'000;  // how often send() is called: transmission phases are spread over ticks
};

class CanLink {
  public:
    // Checks the mapping against the table, and adds to the table `bus.<message>.status` of every received
    // message and `bus.command_valid`. A signal that the table lacks is an error for the rig; for the
    // controller it is added. Throws InputError naming file, line and rule. `port` must outlive the link.
    CanLink(const Mapping& mapping, CanPort& port, SignalTable& signals, const LinkOptions& options = {});
    ~CanLink();
    CanLink(CanLink&&) noexcept;

    // Drains the port and writes trusted values, statuses and `bus.command_valid`. Once a tick, before the
    // step.
    void receive(std::int64_t now_ns, SignalTable& signals) SHIFTRIG_REALTIME;
    // Sends what is due by now. Once a tick, after the step.
    void send(std::int64_t now_ns, const SignalTable& signals) SHIFTRIG_REALTIME;

    // True from the start for one timeout of grace; then while at least one message marked `command` in the mapping
    // arrives, and each of those heard since the last complete silence has been trusted within its timeout. Also
    // the signal `bus.command_valid`.
    bool command_valid() const SHIFTRIG_REALTIME;

    // Lockstep: the mapping names a question (clutch feedback A) and its answer (clutch command A), which
    // echoes the question's counter. True from sending a question until its answer has been received. The
    // controller's side has an answer to give (`question_pending`) from receiving a question until it has
    // sent the answer.
    bool awaiting_answer() const SHIFTRIG_REALTIME;
    bool question_pending() const SHIFTRIG_REALTIME;

    // With AddressClaim::claim: claims our addresses now, in wall time, and waits until they are ours or lost (at
    // most about 0.3 s), so that the first tick may speak. Not for the loop.
    void claim_addresses();

    std::vector<MessageReport> report() const;
    // The trouble codes that were active at least once, as DM1 told them.
    std::vector<TroubleReport> troubles() const;
    // Load of the bus by all mapped messages of both ends, worst-case stuffing [1]; > 1 cannot work.
    double bus_load() const noexcept;
    // One line each, for the user, at start: bus overloaded, messages without a cycle time, …
    const std::vector<std::string>& warnings() const noexcept;
    CanPort& port() noexcept;

    // What changes while the link runs; the port is not part of it.
    void archive(Archive& archive);

  private:
    struct Data;
    std::unique_ptr<Data> data_;
};

}  // namespace shiftrig::io::can
