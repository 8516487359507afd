// ns per complete step (inputs, valves, forces, stages, internal torques, checks, ledger, outputs, certificate)
// of the machines in config/, locked and shifting, on each kernel this processor has; the bare products of
// the method beside it, so that a busy machine can be told from a slow program.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include "io/model_file.h"
#include "plant/kernels.h"
#include "plant/ledger.h"
#include "plant/plant.h"

namespace shiftrig::plant {
namespace {

struct Machine {
    Machine(const std::string& file, KernelKind kernel)
        : model(Model::build(io::read_model(std::string(SHIFTRIG_CONFIG "/") + file).description,
                             {1e-3, kernel})),
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

    Model model;
    Operators operators;
    State state;
    Scratch scratch;
    Inputs inputs;
    Outputs outputs;
};

// Steps from a snapshot, `steps` at a time, so that every repetition does the same work. The fastest of them tells a
// busy machine from a slow program.
void repeat(benchmark::State& bench, Machine& machine, int steps) {
    const std::vector<std::byte> snapshot(machine.state.bytes().begin(), machine.state.bytes().end());
    long events = 0;
    double fastest = 1e300;
    while (bench.KeepRunningBatch(steps)) {  // the time reported is that of one step
        machine.state.restore(snapshot);
        const auto begin = std::chrono::steady_clock::now();
        for (int n = 0; n < steps; ++n) {
            machine.step();
            events += machine.outputs.certificate.events;
        }
        const std::chrono::duration<double, std::nano> taken = std::chrono::steady_clock::now() - begin;
        fastest = std::min(fastest, taken.count() / steps);
    }
    bench.counters["fastest_ns"] = fastest;
    bench.counters["events_per_step"] = static_cast<double>(events) / static_cast<double>(bench.iterations());
    bench.SetLabel(std::string(machine.model.kernel()));
}

void two_mass(benchmark::State& bench, KernelKind kernel) {
    Machine machine("two_mass.yaml", kernel);
    repeat(bench, machine, 1000);
}

// Third gear of [Algin] Table 2, 100 Nm through; shifting, its brake C3 slips under a tenth of what it can.
void wt_gearbox(benchmark::State& bench, KernelKind kernel, bool shifting) {
    Machine machine("wt_gearbox.yaml", kernel);
    for (const char* closed : {"clutch.C1.engagement", "clutch.C3.engagement"}) machine.set(closed, 1);
    machine.set("source.input.torque", 100);
    machine.set("source.output.torque", -150);
    start(machine.model, machine.state, {{"C1", "C3"}, {{"input", 150}}}, machine.inputs);
    for (int n = 0; n < 200; ++n) machine.step();
    if (shifting) {
        machine.set("clutch.C3.engagement", 0.005);
        for (int n = 0; n < 100; ++n) machine.step();
    }
    repeat(bench, machine, shifting ? 100 : 1000);
}

// So many steps of a tractor under the plough, in F2.
void plough(Machine& machine, int steps) {
    machine.set("driver.throttle", 0.73);
    machine.set("environment.draft", 1);
    machine.set("clutch.F2.pressure_command", 18e5);
    start(machine.model, machine.state, {{"Fc", "F2"}, {{"engine", 188.6}}}, machine.inputs);
    for (int n = 0; n < steps; ++n) machine.step();
}

// Ploughing in F2; with `shifting`, F2 and F3 slip against each other all the time.
void tractor(benchmark::State& bench, const std::string& file, KernelKind kernel, bool shifting) {
    Machine machine(file, kernel);
    plough(machine, 3000);
    if (shifting) {
        machine.set("clutch.F2.pressure_command", 3e5);
        machine.set("clutch.F3.pressure_command", 5e5);
        for (int n = 0; n < 300; ++n) machine.step();
    }
    repeat(bench, machine, shifting ? 500 : 1000);
}

// What the ledger has in a step of the tractor: the last step's account, booked over and over.
void ledger(benchmark::State& bench, KernelKind kernel) {
    Machine machine("tractor.yaml", kernel);
    plough(machine, 1000);
    const detail::ModelData& m = machine.model.data();
    detail::OperatorsData& operators = machine.operators.data();
    detail::ScratchData& scratch = machine.scratch.data();
    double* block = machine.state.block.data();
    auto* contact = reinterpret_cast<unsigned char*>(block + m.layout.contact);
    detail::Work work{m,   operators, block, block, machine.outputs, scratch, contact, machine.state.time(),
                      1e-3};
    std::swap(scratch.first, scratch.last);  // the step left its end where the next one begins
    const detail::Mode& mode = detail::find_mode(m, operators, contact, scratch);
    double fastest = 1e300;
    constexpr int batch = 1000;
    while (bench.KeepRunningBatch(batch)) {
        const auto begin = std::chrono::steady_clock::now();
        for (int i = 0; i < batch; ++i) {
            detail::book(work, mode);
            benchmark::ClobberMemory();
        }
        const std::chrono::duration<double, std::nano> taken = std::chrono::steady_clock::now() - begin;
        fastest = std::min(fastest, taken.count() / batch);
    }
    bench.counters["fastest_ns"] = fastest;
    bench.SetLabel(std::string(machine.model.kernel()));
}

// The dearest step of a shift F2 to F3 under the plough, new modes included: of each step the fastest of 20 repeats, of
// those the slowest.
void worst_step(benchmark::State& bench, KernelKind kernel) {
    Machine machine("tractor.yaml", kernel);
    plough(machine, 1000);
    const std::vector<std::byte> snapshot(machine.state.bytes().begin(), machine.state.bytes().end());
    constexpr int steps = 1500, repeats = 20;
    std::vector<double> fastest(steps, 1e300);
    long misses = 0, events = 0;
    while (bench.KeepRunningBatch(steps * repeats)) {
        for (int repeat = 0; repeat < repeats; ++repeat) {
            machine.state.restore(snapshot);
            machine.operators.drop();
            machine.set("clutch.F2.pressure_command", 18e5);
            machine.step();  // the mode it starts in was built when the run began
            misses = events = 0;
            for (int n = 0; n < steps; ++n) {
                if (n == 100) machine.set("clutch.F3.pressure_command", 2e5);
                if (n == 220) machine.set("clutch.F3.pressure_command", 11.5e5);
                if (n == 300) machine.set("clutch.F2.pressure_command", 0);
                const auto begin = std::chrono::steady_clock::now();
                machine.step();
                const std::chrono::duration<double, std::nano> taken =
                    std::chrono::steady_clock::now() - begin;
                auto& least = fastest[static_cast<std::size_t>(n)];
                least = std::min(least, taken.count());
                misses += machine.outputs.certificate.mode_misses;
                events += machine.outputs.certificate.events;
            }
            machine.set("clutch.F3.pressure_command", 0);
        }
    }
    bench.counters["fastest_ns"] = *std::max_element(fastest.begin(), fastest.end());
    bench.counters["modes_built"] = static_cast<double>(misses);
    bench.counters["events"] = static_cast<double>(events);
    bench.SetLabel(std::string(machine.model.kernel()));
}

// The products of one exponential step for n states, m forces and r active rows (numerics: [P_h Q_h], P, Q_1,
// the three combined, R).
void bare_products(benchmark::State& bench, KernelKind kind) {
    const detail::Kernel kernel = detail::choose_kernel(kind);
    const int n = 17, m = 13, r = 9, rows = detail::padded(n);
    std::vector<double> panel(static_cast<std::size_t>(detail::panel_size(n, 3 * (n + m))), 0.01), v(64, 1.),
        y(64), z(64);
    double fastest = 1e300;
    constexpr int batch = 100;
    while (bench.KeepRunningBatch(batch)) {
        const auto begin = std::chrono::steady_clock::now();
        for (int i = 0; i < batch; ++i) {
            kernel.multiply(panel.data(), rows, n + m, v.data(), nullptr, y.data());
            kernel.multiply(panel.data(), rows, n, v.data(), nullptr, z.data());
            kernel.multiply(panel.data(), rows, m, v.data(), z.data(), y.data());
            kernel.multiply(panel.data(), rows, 3 * m, v.data(), z.data(), y.data());
            kernel.multiply(panel.data(), detail::padded(r), n + m, v.data(), nullptr, y.data());
            benchmark::DoNotOptimize(y.data());
            benchmark::ClobberMemory();
        }
        const std::chrono::duration<double, std::nano> taken = std::chrono::steady_clock::now() - begin;
        fastest = std::min(fastest, taken.count() / batch);
    }
    bench.counters["fastest_ns"] = fastest;
    bench.SetLabel(kernel.name);
}

void add(KernelKind kernel, const std::string& name) {
    try {
        detail::choose_kernel(kernel);
    } catch (const ModelError&) {
        return;
    }
    const auto in = [&name](const char* what) { return std::string(what) + "/" + name; };
    benchmark::RegisterBenchmark(in("bare_products").c_str(), bare_products, kernel);
    benchmark::RegisterBenchmark(in("two_mass").c_str(), two_mass, kernel);
    benchmark::RegisterBenchmark(in("tractor_ledger").c_str(), ledger, kernel);
    benchmark::RegisterBenchmark(in("worst_step").c_str(), worst_step, kernel);
    benchmark::RegisterBenchmark(in("wt_gearbox_locked").c_str(), wt_gearbox, kernel, false);
    benchmark::RegisterBenchmark(in("wt_gearbox_shifting").c_str(), wt_gearbox, kernel, true);
    for (const char* file : {"article_tractor.yaml", "tractor.yaml"}) {
        const std::string machine = std::string(file).substr(0, std::string(file).find('.'));
        benchmark::RegisterBenchmark((machine + "_locked/" + name).c_str(), tractor, file, kernel, false);
        benchmark::RegisterBenchmark((machine + "_shifting/" + name).c_str(), tractor, file, kernel, true);
    }
}

}  // namespace
}  // namespace shiftrig::plant

int main(int argc, char** argv) {
    using shiftrig::plant::KernelKind;
    shiftrig::plant::add(KernelKind::portable, "portable");
    shiftrig::plant::add(KernelKind::avx2, "avx2");
    shiftrig::plant::add(KernelKind::avx512, "avx512");
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
    benchmark::RunSpecifiedBenchmarks();
    return 0;
}
