// The rig's side of its buses, and the built-in controller on the other end of the in-process one.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/bus/bus.h"
#include "apps/tcu/node.h"
#include "io/model_file.h"
#include "io/signals.h"

namespace shiftrig::rig {

// The built-in controller is dead: it hears and says nothing, and begins anew afterwards.
struct Silence {
    std::int64_t from_ns = 0, until_ns = INT64_MAX;
};

struct BusSetup {
    std::vector<std::string> names;            // as the user gives them; see apps/bus/bus.h
    std::optional<tcu::Calibration> built_in;  // the reference controller on `inprocess`
    std::string calibration_path;              // where that was read from
    std::string calibration_text;              // and what stood there: a snapshot holds it
    std::vector<Silence> silences;             // of the built-in controller
    bool lockstep = false;
    std::string can_log, can_replay;  // of the first CAN bus; see bus::Options
    YAML::Node faults;                // of every CAN bus (io/can/faults.h); null: none
    std::string faults_file;          // where they are written
    std::uint64_t seed = 1;           // of those that draw and name no other
};

class Buses {
  public:
    Buses(const BusSetup& setup, const io::ModelFile& model, std::int64_t tick_ns, io::SignalTable& signals);

    void receive(std::int64_t now_ns, io::SignalTable& signals) SHIFTRIG_REALTIME;
    // What the rig has to say at `now_ns`; then the built-in controller takes its turn.
    void send(std::int64_t now_ns, const io::SignalTable& signals) SHIFTRIG_REALTIME;

    // The built-in controller's calibration, if there is one.
    void recalibrate(const tcu::Calibration& calibration) {
        if (node_) node_->recalibrate(calibration);
    }

    void archive(io::Archive& a) {
        if (wire_) wire_->archive(a);
        for (auto& each : buses_) each.archive(a);
        if (node_) node_->archive(a);
        a(silent_);
    }

    bool any() const noexcept { return !buses_.empty(); }
    // A command is heard on at least one bus; true where there is no bus at all.
    bool command_valid() const SHIFTRIG_REALTIME;
    // Lockstep: waits until no bus awaits an answer any more.
    bool wait_for_answer(std::int64_t now_ns, io::SignalTable& signals, std::int64_t timeout_ns);

    // See bus::Bus; of any bus.
    bool next_command_latency(std::int64_t& latency_ns) SHIFTRIG_REALTIME;

    // After the run: closes the logs of frames; false if one is not whole, as summary() tells.
    bool end_logs();
    std::uint64_t messages_lost() const SHIFTRIG_REALTIME;
    std::vector<std::string> warnings() const;
    std::vector<std::string> summary() const;
    const tcu::Node* built_in() const noexcept { return node_.get(); }
    // The controller's end of the in-process bus, for whoever embeds the rig with a controller of his own; nullptr if
    // the built-in one sits there, or there is no such bus.
    io::can::CanPort* far_end() noexcept { return wire_ && !node_ ? &wire_->end(1) : nullptr; }

  private:
    bool silent_at(std::int64_t now_ns) const SHIFTRIG_REALTIME;

    std::optional<io::can::Mapping> mapping_;
    std::optional<io::can::FaultPlan> faults_;
    std::unique_ptr<io::can::InProcessBus> wire_;  // ends: 0 the rig, 1 the built-in controller
    std::vector<bus::Bus> buses_;
    std::unique_ptr<tcu::Node> node_;
    std::vector<int> fault_signals_;  // `bus.fault.<n>.status`: 1 while it acts
    std::vector<Silence> silences_;
    bool silent_ = false;
};

}  // namespace shiftrig::rig
