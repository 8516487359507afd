// A bus by the name a user gives it, whatever it is made of: signals go in and out, between ticks.
//
//     inprocess                          inside this program (InProcess below)
//     can:vcan0                          SocketCAN
//     udpcan:239.74.163.2:43113          python-can's udp_multicast
//     lcm:udpm://239.255.76.67:7667?ttl=0
//
// Both ends use it: the rig, and a controller that is a program of its own.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "io/can/candump.h"
#include "io/can/faults.h"
#include "io/can/inprocess.h"
#include "io/can/link.h"
#include "io/can/mapping.h"
#include "io/lcm/link.h"
#include "io/signals.h"

namespace shiftrig::bus {

enum class Role : std::uint8_t { rig, controller };

struct Options {
    Role role = Role::rig;
    std::int64_t tick_ns = 1'000'000;  // how often receive() and send() are called
    bool lockstep = false;
    std::string model_name;        // for who asks on LCM
    double command_timeout = 0.1;  // [s] LCM; on CAN the mapping says
    std::string can_log;           // candump log to write; empty: none
    std::string can_replay;        // candump log whose frames arrive as if from the bus; empty: none
    const io::can::FaultPlan* can_faults = nullptr;  // how the bus misbehaves; looked at while it is opened
};

class Bus {
  public:
    // `mapping` gives CAN frames their meaning; nullptr only for LCM. Throws InputError and the like: one clear line.
    Bus(const std::string& name, const io::can::Mapping* mapping, io::SignalTable& signals,
        const Options& options);
    // One end of a bus inside the program; `port` must outlive it.
    Bus(const std::string& name, io::can::CanPort& port, const io::can::Mapping& mapping,
        io::SignalTable& signals, const Options& options);

    void receive(std::int64_t now_ns, io::SignalTable& signals) SHIFTRIG_REALTIME {
        can_ ? can_->receive(now_ns, signals) : lcm_->receive(now_ns, signals);
    }
    void send(std::int64_t now_ns, const io::SignalTable& signals) SHIFTRIG_REALTIME {
        can_ ? can_->send(now_ns, signals) : lcm_->send(now_ns, signals);
    }
    // The rig's side: commands are heard. Lockstep: a question is open; the controller's side: has one to answer.
    bool command_valid() const SHIFTRIG_REALTIME {
        return can_ ? can_->command_valid() : lcm_->command_valid();
    }
    bool awaiting_answer() const SHIFTRIG_REALTIME {
        return can_ ? can_->awaiting_answer() : lcm_->awaiting_answer();
    }
    bool question_pending() const SHIFTRIG_REALTIME {
        return can_ ? can_->question_pending() : lcm_->question_pending();
    }
    // Blocks up to `timeout_ns` of wall time until something may be received.
    bool wait(std::int64_t timeout_ns) noexcept {
        return can_ ? port_->wait(timeout_ns) : lcm_->wait(timeout_ns);
    }

    // The controller's side: the rig's simulated time, where the bus tells it (LCM).
    std::optional<std::int64_t> rig_time_ns() const SHIFTRIG_REALTIME {
        return lcm_ ? std::optional(lcm_->rig_time_ns()) : std::nullopt;
    }

    // On a real wire: from the arrival of a command to the sending of the first message that reflects it [ns], one not
    // yet taken; false if there is none.
    bool next_command_latency(std::int64_t& latency_ns) SHIFTRIG_REALTIME {
        if (lcm_) return lcm_->next_command_latency(latency_ns);
        return wire_ && wire_->next_command_latency(latency_ns);
    }

    // A fault of the bus that began or ended since the last call.
    bool next_fault(io::can::FaultEvent& event) SHIFTRIG_REALTIME {
        return faulty_ && faulty_->next_event(event);
    }

    // For snapshots: the link of an in-process bus. What stands behind other buses is the world's, which has no snapshot.
    void archive(io::Archive& a) {
        if (!can_ || name_ != "inprocess") return;
        can_->archive(a);
        if (faulty_) faulty_->archive(a);
    }

    // Closes the log of frames; false if some of them are not in it, as summary() tells.
    bool end_log();

    const std::string& name() const noexcept { return name_; }
    std::uint64_t messages_lost() const SHIFTRIG_REALTIME;  // known to be lost, either way
    std::vector<std::string> warnings() const;              // at start
    std::vector<std::string> summary() const;  // at the end, one line per message or channel that fared ill
    io::can::CanLink* can() noexcept { return can_ ? &*can_ : nullptr; }

  private:
    void join_can(io::can::CanPort& wire, const io::can::Mapping& mapping, io::SignalTable& signals,
                  const Options& options, io::can::AddressClaim claim);

    std::string name_;
    // Port upon port: the wire (unless it is an end of the in-process bus), its faults, a log replayed, a log written.
    std::vector<std::unique_ptr<io::can::CanPort>> owned_;
    io::can::CanPort* wire_ = nullptr;       // the innermost, if it is a real one
    io::can::CanPort* port_ = nullptr;       // the outermost; null: LCM
    io::can::FaultyPort* faulty_ = nullptr;  // one of them, if there are faults
    io::can::CandumpLogger* log_ = nullptr;  // the outermost, if a log is written
    std::optional<io::can::CanLink> can_;
    std::optional<io::lcm::LcmLink> lcm_;
};

}  // namespace shiftrig::bus
