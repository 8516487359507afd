// What benchmarks of complete steps share: a machine, its steps from a snapshot over and over, one step with an event, and
// what the ledger has of each. The fastest of all repeats tells a busy machine from a slow program.
#pragma once

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include "plant/ledger.h"
#include "plant/plant.h"

namespace shiftrig::plant {

struct Machine {
    Machine(const Description& description, KernelKind kernel)
        : model(Model::build(description, {1e-3, kernel})),
          operators(model),
          state(model),
          scratch(model),
          inputs(model),
          outputs(model) {}
    void set(const std::string& name, double value) {
        const int index = model.input(name);
        if (index >= 0) inputs.value[static_cast<std::size_t>(index)] = value;
    }
    void step() { plant::step(model, operators, state, inputs, outputs, scratch); }
    void step(int times) {
        for (int n = 0; n < times; ++n) step();
    }
    std::vector<std::byte> snapshot() const { return {state.bytes().begin(), state.bytes().end()}; }

    Model model;
    Operators operators;
    State state;
    Scratch scratch;
    Inputs inputs;
    Outputs outputs;
};

class Stopwatch {
  public:
    double nanoseconds() const {
        return std::chrono::duration<double, std::nano>(Clock::now() - begin_).count();
    }

  private:
    using Clock = std::chrono::steady_clock;
    Clock::time_point begin_ = Clock::now();
};

// The ledger cannot be switched off, but the account of the part of a step that was last taken can be booked again: the
// time of one booking. A step with an event has two, one in parts has one for each.
inline double fastest_booking(Machine& machine) {
    const detail::ModelData& m = machine.model.data();
    detail::OperatorsData& operators = machine.operators.data();
    detail::ScratchData& scratch = machine.scratch.data();
    double* block = machine.state.block.data();
    auto* contact = reinterpret_cast<unsigned char*>(block + m.layout.contact);
    detail::Work work{m,   operators, block, block, machine.outputs, scratch, contact, machine.state.time(),
                      1e-3};
    std::swap(scratch.first, scratch.last);  // the step left its end where the next one begins
    const detail::Mode& mode = detail::find_mode(m, operators, contact, scratch);
    constexpr int batches = 100, batch = 100;
    double fastest = 1e300;
    for (int k = 0; k < batches; ++k) {
        const Stopwatch watch;
        for (int i = 0; i < batch; ++i) {
            detail::book(work, mode);
            benchmark::ClobberMemory();
        }
        fastest = std::min(fastest, watch.nanoseconds() / batch);
    }
    return fastest;
}

inline void report(benchmark::State& bench, Machine& machine, double fastest, double events_per_step) {
    bench.counters["fastest_ns"] = fastest;
    bench.counters["events_per_step"] = events_per_step;
    bench.counters["ledger_ns"] = fastest_booking(machine) * (1 + events_per_step);
    bench.SetLabel(std::string(machine.model.engine()) + " " + std::string(machine.model.kernel()));
}

// So many steps at a time, each time from the same snapshot: every repeat does the same work.
template <class Before>
void repeat(benchmark::State& bench, Machine& machine, int steps, Before&& before_step) {
    const std::vector<std::byte> snapshot = machine.snapshot();
    long events = 0;
    double fastest = 1e300;
    while (bench.KeepRunningBatch(steps)) {  // the time reported is that of one step
        machine.state.restore(machine.model, snapshot);
        const Stopwatch watch;
        for (int n = 0; n < steps; ++n) {
            before_step(n);
            machine.step();
            events += machine.outputs.certificate.events;
        }
        fastest = std::min(fastest, watch.nanoseconds() / steps);
    }
    report(bench, machine, fastest, static_cast<double>(events) / static_cast<double>(bench.iterations()));
}
inline void repeat(benchmark::State& bench, Machine& machine, int steps) {
    repeat(bench, machine, steps, [](int) {});
}

// The next step with one located change in it, its modes known, over and over; each time after the step before it, as in a run.
// `forgetful`: all modes are forgotten before that one, so that the mode it changes to is new.
inline void repeat_event(benchmark::State& bench, Machine& machine, bool forgetful = false) {
    constexpr int most = 5000;
    std::vector<std::byte> snapshot = machine.snapshot(), next = snapshot;
    for (int n = 0; machine.outputs.certificate.events != 1 || n < 2; ++n) {
        if (n == most) return bench.SkipWithError("no step with one event");
        snapshot = std::exchange(next, machine.snapshot());
        machine.step();
    }
    double fastest = 1e300, reading = 1e300;  // of which so much is reading the clock
    for (auto _ : bench) {
        machine.state.restore(machine.model, snapshot);
        if (forgetful) machine.operators.drop();
        machine.step();
        const Stopwatch nothing;
        reading = std::min(reading, nothing.nanoseconds());
        const Stopwatch watch;
        machine.step();
        fastest = std::min(fastest, watch.nanoseconds());
        bench.SetIterationTime(1e-9 * watch.nanoseconds());
    }
    const auto misses = machine.outputs.certificate.mode_misses;
    if (forgetful) bench.counters["modes_built"] = static_cast<double>(misses);
    if (!forgetful && misses > 0) return bench.SkipWithError("modes were not kept");
    report(bench, machine, fastest - reading, machine.outputs.certificate.events);
}

}  // namespace shiftrig::plant
