// ns per complete step (inputs, valves, forces, stages, internal torques, checks, ledger, outputs, certificate)
// of the machines in config/, locked, slipping and in a step with one event, on each kernel this processor has; the bare
// products of the method beside it, so that a busy machine can be told from a slow program. Without the ledger a step takes
// fastest_ns − ledger_ns.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <string>
#include <vector>

#include "bench/stepping.h"
#include "io/model_file.h"
#include "plant/kernels.h"

namespace shiftrig::plant {
namespace {

enum class Contact { locked, slipping, event };

Machine machine_of(const std::string& file, KernelKind kernel) {
    return {io::read_model(std::string(SHIFTRIG_CONFIG "/") + file).description, kernel};
}

// Slips for 90 steps from its start, then locks.
void two_mass(benchmark::State& bench, KernelKind kernel, Contact contact) {
    Machine machine = machine_of("two_mass.yaml", kernel);
    if (contact == Contact::event) return repeat_event(bench, machine);
    if (contact == Contact::locked) machine.step(100);
    repeat(bench, machine, contact == Contact::slipping ? 80 : 1000);
}

// Third gear of [Algin] Table 2, 100 Nm through; slipping, its brake C3 has a tenth of what it can; it locks when it gets
// a little more than it needs.
void wt_gearbox(benchmark::State& bench, KernelKind kernel, Contact contact) {
    Machine machine = machine_of("wt_gearbox.yaml", kernel);
    for (const char* closed : {"clutch.C1.engagement", "clutch.C3.engagement"}) machine.set(closed, 1);
    machine.set("source.input.torque", 100);
    machine.set("source.output.torque", -150);
    start(machine.model, machine.state, {{"C1", "C3"}, {{"input", 150}}}, machine.inputs);
    machine.step(200);
    if (contact != Contact::locked) {
        machine.set("clutch.C3.engagement", 0.005);
        machine.step(100);
    }
    if (contact == Contact::event) {
        machine.set("clutch.C3.engagement", 0.1);
        return repeat_event(bench, machine);
    }
    repeat(bench, machine, contact == Contact::slipping ? 100 : 1000);
}

// So many steps of a tractor under the plough, in F2.
void plough(Machine& machine, int steps) {
    machine.set("driver.throttle", 0.73);
    machine.set("environment.draft", 1);
    machine.set("clutch.F2.pressure_command", 18e5);
    start(machine.model, machine.state, {{"Fc", "F2"}, {{"engine", 188.6}}}, machine.inputs);
    machine.step(steps);
}

// Ploughing in F2; slipping, F2 and F3 do so against each other all the time; F3 locks when it gets the pressure for it.
void tractor(benchmark::State& bench, const std::string& file, KernelKind kernel, Contact contact) {
    Machine machine = machine_of(file, kernel);
    plough(machine, 3000);
    if (contact != Contact::locked) {
        machine.set("clutch.F2.pressure_command", 3e5);
        machine.set("clutch.F3.pressure_command", 5e5);
        machine.step(300);
    }
    if (contact == Contact::event) {
        machine.set("clutch.F2.pressure_command", 0);
        machine.set("clutch.F3.pressure_command", 12e5);
        return repeat_event(bench, machine);
    }
    repeat(bench, machine, contact == Contact::slipping ? 500 : 1000);
}

// The dearest step of a shift F2 to F3 under the plough, new modes included: of each step the fastest of 20 repeats, of
// those the slowest.
void worst_step(benchmark::State& bench, KernelKind kernel) {
    Machine machine = machine_of("tractor.yaml", kernel);
    plough(machine, 1000);
    const std::vector<std::byte> snapshot = machine.snapshot();
    constexpr int steps = 1500, repeats = 20;
    std::vector<double> fastest(steps, 1e300);
    long misses = 0, events = 0;
    while (bench.KeepRunningBatch(steps * repeats)) {
        for (int repeat = 0; repeat < repeats; ++repeat) {
            machine.state.restore(machine.model, snapshot);
            machine.operators.drop();
            machine.set("clutch.F2.pressure_command", 18e5);
            machine.step();  // the mode it starts in was built when the run began
            misses = events = 0;
            for (int n = 0; n < steps; ++n) {
                if (n == 100) machine.set("clutch.F3.pressure_command", 2e5);
                if (n == 220) machine.set("clutch.F3.pressure_command", 11.5e5);
                if (n == 300) machine.set("clutch.F2.pressure_command", 0);
                auto& least = fastest[static_cast<std::size_t>(n)];
                const Stopwatch watch;
                machine.step();
                least = std::min(least, watch.nanoseconds());
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
        const Stopwatch watch;
        for (int i = 0; i < batch; ++i) {
            kernel.multiply(panel.data(), rows, n + m, v.data(), nullptr, y.data());
            kernel.multiply(panel.data(), rows, n, v.data(), nullptr, z.data());
            kernel.multiply(panel.data(), rows, m, v.data(), z.data(), y.data());
            kernel.multiply(panel.data(), rows, 3 * m, v.data(), z.data(), y.data());
            kernel.multiply(panel.data(), detail::padded(r), n + m, v.data(), nullptr, y.data());
            benchmark::DoNotOptimize(y.data());
            benchmark::ClobberMemory();
        }
        fastest = std::min(fastest, watch.nanoseconds() / batch);
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
    const auto in = [&name](const std::string& what) { return what + "/" + name; };
    benchmark::RegisterBenchmark(in("bare_products").c_str(), bare_products, kernel);
    benchmark::RegisterBenchmark(in("worst_step").c_str(), worst_step, kernel);
    for (const auto& [suffix, contact] :
         {std::pair{"_locked", Contact::locked}, std::pair{"_shifting", Contact::slipping},
          std::pair{"_event", Contact::event}}) {
        const auto add_one = [&, end = std::string(suffix)](const std::string& machine, auto... what) {
            auto* bench = benchmark::RegisterBenchmark(in(machine + end).c_str(), what..., contact);
            if (contact == Contact::event) bench->UseManualTime();
        };
        add_one("two_mass", two_mass, kernel);
        add_one("wt_gearbox", wt_gearbox, kernel);
        add_one("article_tractor", tractor, "article_tractor.yaml", kernel);
        add_one("tractor", tractor, "tractor.yaml", kernel);
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
