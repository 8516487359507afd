// Chains of N masses on shafts with a clutch at every fifth joint: ns per step by length, engine and contact state.
// The whole step: laws, stages, internal torques, checks, ledger, outputs, certificate; without the ledger fastest_ns −
// ledger_ns.
#include <benchmark/benchmark.h>

#include <string>

#include "bench/stepping.h"

namespace shiftrig::plant {
namespace {

// Swinging: locked, the torque turns round, hard with 20 times as much, so that steps are taken in parts. Event: the clutch in
// the middle slips and locks.
enum class Contact { locked, slipping, alternating, swinging, swinging_hard, event };

Description chain(int n, Contact contact) {
    Description d;
    d.name = "chain";
    const int middle = (n - 2) / 5 / 2;  // of the clutches, but one between two masses
    int clutches = 0;
    double speed = 100;
    for (int j = 0; j < n; ++j) {
        const std::string b = "m" + std::to_string(j), a = "m" + std::to_string(j - 1);
        Mass mass;
        mass.name = b;
        mass.inertia = 1 + 0.1 * (j % 7);
        const bool some_slip = contact == Contact::slipping || contact == Contact::alternating;
        if (j > 0 && (j % 5 == 0 || n == 2)) {
            const bool closes = contact == Contact::event && clutches == middle;
            const bool slips = contact == Contact::slipping || closes ||
                               (contact == Contact::alternating && clutches % 2 == 1);
            Clutch c;
            c.name = "c" + b;
            c.a = a;
            c.b = b;
            DryFriction friction;
            // Slipping clutches are too weak to close while the benchmark runs.
            friction.sliding_capacity = closes ? 300 : slips ? 1e-3 : 1e6;
            friction.static_ratio = 1.1;
            c.friction = friction;
            c.actuation = ActuationConstant{};
            c.initially_locked = !slips;
            d.clutches.push_back(c);
            ++clutches;
            if (some_slip || closes) speed -= 2;
        } else if (j > 0) {
            d.shafts.push_back({"s" + b, a, b, 2e4, 10, 0});
        }
        mass.initial_speed = speed;
        d.masses.push_back(mass);
    }
    TorqueSource source;
    source.name = "drive";
    source.mass = "m0";
    source.input = true;
    d.sources = {source};
    return d;
}

void step_chain(benchmark::State& bench, Contact contact, Method method) {
    Description d = chain(static_cast<int>(bench.range(0)), contact);
    d.method = method;
    Machine machine(d, KernelKind::automatic);
    const double torque = contact == Contact::swinging_hard ? 1000 : 50;
    machine.set("source.drive.torque", torque);
    if (contact == Contact::event) return repeat_event(bench, machine);
    const bool turns = contact == Contact::swinging || contact == Contact::swinging_hard;
    const auto turn = [&](int n) {
        if (turns && n % 16 == 0) machine.set("source.drive.torque", n % 32 == 0 ? torque : -torque);
    };
    constexpr int steps = 320;
    for (int n = 0; n < steps; ++n) {
        turn(n);
        machine.step();
    }
    repeat(bench, machine, steps, turn);
    bench.counters["fall_backs"] = machine.outputs.certificate.fall_backs;
}

void all_lengths(benchmark::internal::Benchmark* bench) {
    for (const int masses : {2, 10, 50, 100, 200, 500, 1000}) bench->Arg(masses);
}

BENCHMARK_CAPTURE(step_chain, locked, Contact::locked, Method::automatic)->Apply(all_lengths);
BENCHMARK_CAPTURE(step_chain, slipping, Contact::slipping, Method::automatic)->Apply(all_lengths);
BENCHMARK_CAPTURE(step_chain, alternating, Contact::alternating, Method::automatic)
    ->Arg(2)
    ->Arg(10)
    ->Arg(50)
    ->Arg(200)
    ->Arg(1000);
BENCHMARK_CAPTURE(step_chain, event, Contact::event, Method::automatic)->UseManualTime()->Apply(all_lengths);
BENCHMARK_CAPTURE(step_chain, swinging, Contact::swinging, Method::automatic)->Arg(50)->Arg(200)->Arg(1000);
BENCHMARK_CAPTURE(step_chain, swinging_hard, Contact::swinging_hard, Method::automatic)
    ->Arg(50)
    ->Arg(200)
    ->Arg(1000);
BENCHMARK_CAPTURE(step_chain, locked_ark3, Contact::locked, Method::ark3)->Arg(2)->Arg(10)->Arg(20);
BENCHMARK_CAPTURE(step_chain, locked_etd3, Contact::locked, Method::etd3)->Arg(20)->Arg(50);

}  // namespace
}  // namespace shiftrig::plant

BENCHMARK_MAIN();
