// The assembly: plant, scenario, buses and controller, one tick at a time. Used by `run`, `serve`, `test`, `fork`.
//
// One tick from t to t + T:
//
//     receive    bytes → bus → signals: the controller's commands, as they have arrived by t
//     decide     the scenario's driver and faults at t, changes asked for from outside, the safe command if the
//                controller is silent, limits → the plant's inputs, held over the tick
//     step       the plant, `substeps` times
//     send       signals → bus → bytes at t + T; then the built-in controller on its own end of the in-process bus
//
// and whoever records or shows the run reads the rig between two ticks.
//
//     Rig rig(setup);
//     while (…) { rig.tick(); collector.take(rig); }
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "apps/rig/buses.h"
#include "apps/rig/certificate.h"
#include "apps/rig/events.h"
#include "apps/rig/safe_command.h"
#include "apps/rig/timeline.h"
#include "io/model_file.h"
#include "io/scenario_file.h"
#include "io/signals.h"
#include "plant/plant.h"
#include "rt/queue.h"

namespace shiftrig::rig {

// Everything that is decided before the first tick.
struct Setup {
    io::ModelFile model;
    std::optional<io::ScenarioFile> scenario;
    std::int64_t tick_ns = 1'000'000;  // T [ns]
    int substeps = 1;                  // plant steps per tick
    plant::KernelKind kernel = plant::KernelKind::automatic;
    BusSetup buses;
    bool resumes = false;  // a snapshot follows: the scenario's start and settling are left out
};

// The rig's own signals in the table, by index.
struct RigSignals {
    int lever, clutch_pedal, parking_brake, automatic;      // driver's
    int safe_command, overruns, tick_load, limited_inputs;  // the rig's
};

class Rig {
  public:
    // Builds everything and brings the plant to the scenario's start. Throws InputError and its like.
    explicit Rig(Setup setup);
    ~Rig();
    Rig(const Rig&) = delete;
    Rig& operator=(const Rig&) = delete;

    // One tick. Never throws, allocates or blocks.
    void tick() SHIFTRIG_REALTIME;

    // Lockstep: blocks up to `timeout_ns` of wall time until the controller has answered the last tick's question;
    // false if it did not. True at once where nothing is awaited.
    bool wait_for_answer(std::int64_t timeout_ns);

    std::int64_t ticks() const noexcept { return ticks_; }  // done
    std::int64_t sim_time_ns() const noexcept {
        return ticks_ * setup_.tick_ns;
    }  // at the end of the last tick
    double sim_time() const noexcept { return static_cast<double>(sim_time_ns()) * 1e-9; }

    // The plant's inputs, its outputs and the rig's own signals, in this order. value() gives inputs as applied, which is
    // not always as somebody wants them: the safe command, the pedal and the inputs' ranges come between.
    const io::SignalTable& signals() const noexcept { return signals_; }
    double value(int signal) const noexcept {
        const auto i = static_cast<std::size_t>(signal);
        return i < inputs_.value.size() ? inputs_.value[i] : signals_.value[i];
    }
    std::span<const double> input_values() const noexcept { return inputs_.value; }
    std::span<const double> output_values() const noexcept { return outputs_.value; }
    std::span<const double> rig_values() const
        SHIFTRIG_REALTIME;                           // everything in the table behind inputs and outputs
    std::vector<plant::Signal> rig_signals() const;  // the same, by name

    const plant::Model& model() const noexcept { return model_; }
    const Setup& setup() const noexcept { return setup_; }
    const RigSignals& own() const noexcept { return own_; }
    const plant::State& state() const noexcept { return state_; }

    // Of the last tick.
    std::span<const plant::Event> plant_events() const noexcept { return {events_.data(), event_count_}; }
    int plant_events_not_kept() const noexcept { return events_not_kept_; }
    std::span<const RigEvent> rig_events() const noexcept { return {rig_events_.data(), rig_event_count_}; }
    int rig_events_not_kept() const noexcept { return rig_events_not_kept_; }
    const plant::Certificate& certificate() const noexcept {
        return certificate_;
    }  // worst and sums over the substeps

    bool is_settable(int signal) const noexcept { return settable_[static_cast<std::size_t>(signal)]; }
    // A change of an input or of a driver's signal from another thread, taken at the next tick; false if `signal` may
    // not be set or too many are waiting. One thread only.
    bool request(int signal, double value) noexcept;
    // The same machine with other parameters, from the next tick on; not while the loop runs. Throws InputError, and
    // std::invalid_argument where the parameter changes what the state is made of (a dead time).
    void change_machine(io::ModelFile model);
    // Throws what change_machine() would throw, and changes nothing; also while the loop runs.
    void check_machine(io::ModelFile model) const;
    // The modes that a rig of the same machine and step size has met are this one's too; not while the loop runs. Changes no
    // bit of what follows but the count of modes built.
    void take_modes_of(Rig& twin) noexcept { std::swap(operators_, twin.operators_); }
    // From the loop: how late the last tick was (overruns so far), and its compute time over the period.
    void report_timing(std::int64_t overruns, double load) SHIFTRIG_REALTIME;

    Buses& buses() noexcept { return buses_; }
    const Buses& buses() const noexcept { return buses_; }

    // Everything that a tick depends on and changes: saved and restored into a rig of the same set-up, the run goes on
    // as if nothing had happened, bit for bit.
    void archive(io::Archive& a);

  private:
    struct Request {
        int signal;
        double value;
    };
    plant::Model build_changed(Setup& changed, io::ModelFile model) const;
    void begin();
    void start_plant(const plant::Start& start, const io::ScenarioFile& scenario);
    void settle(double seconds);
    void take_requests() SHIFTRIG_REALTIME;
    void copy_inputs() SHIFTRIG_REALTIME;
    double limited(int signal, const std::pair<double, double>& range, double last) SHIFTRIG_REALTIME;
    void watch_the_controller(std::int64_t now_ns) SHIFTRIG_REALTIME;
    void step_plant() SHIFTRIG_REALTIME;
    void publish() SHIFTRIG_REALTIME;
    void note(RigEventKind kind, int signal, double value) SHIFTRIG_REALTIME;

    Setup setup_;
    plant::Model model_;
    plant::Operators operators_;
    plant::State state_;
    plant::Inputs inputs_;  // as applied
    plant::Outputs outputs_;
    plant::Scratch scratch_;
    RigSignals own_{};
    io::SignalTable signals_;
    std::vector<bool> settable_;                     // by signal
    std::vector<std::pair<double, double>> ranges_;  // of the inputs, then of what is the driver's
    std::array<double, 4> driver_{};                 // his signals as they act, in the order of RigSignals
    int pedal_release_ = -1, service_brake_ = -1;    // inputs
    Timeline timeline_;
    Buses buses_;
    SafeCommands safe_commands_;
    rt::Queue<Request> requests_{256};

    std::int64_t ticks_ = 0;
    std::array<plant::Event, plant::Outputs::event_capacity> events_;
    std::size_t event_count_ = 0;
    int events_not_kept_ = 0;
    std::array<RigEvent, 256> rig_events_;  // more than a scenario does at once, or all messages of a bus
    std::size_t rig_event_count_ = 0;
    int rig_events_not_kept_ = 0;
    plant::Certificate certificate_;
    std::vector<int> statuses_;  // signals `bus.<message>.status`
    std::vector<double> last_status_;
};

}  // namespace shiftrig::rig
