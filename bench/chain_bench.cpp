// Chains of N masses on shafts with a clutch at every fifth joint: ns per step by length, engine and contact state.
// The whole step: laws, stages, internal torques, checks, ledger, outputs, certificate.
#include <benchmark/benchmark.h>

#include <string>

#include "plant/plant.h"

namespace shiftrig::plant {
namespace {

// The last two: locked, the torque turns round, and with 20 times as much, so that steps are taken in parts.
enum class Contact { locked, slipping, alternating, swinging, swinging_hard };

Description chain(int n, Contact contact) {
    Description d;
    d.name = "chain";
    int clutches = 0;
    for (int j = 0; j < n; ++j) {
        const std::string b = "m" + std::to_string(j), a = "m" + std::to_string(j - 1);
        Mass mass;
        mass.name = b;
        mass.inertia = 1 + 0.1 * (j % 7);
        // Slipping clutches are too weak to close while the benchmark runs.
        const bool slips =
            contact == Contact::slipping || (contact == Contact::alternating && clutches % 2 == 1);
        if (j > 0 && (j % 5 == 0 || n == 2)) {
            Clutch c;
            c.name = "c" + b;
            c.a = a;
            c.b = b;
            DryFriction friction;
            friction.sliding_capacity = slips ? 1e-3 : 1e6;
            friction.static_ratio = 1.1;
            c.friction = friction;
            c.actuation = ActuationConstant{};
            c.initially_locked = !slips;
            d.clutches.push_back(c);
            ++clutches;
        } else if (j > 0) {
            d.shafts.push_back({"s" + b, a, b, 2e4, 10, 0});
        }
        const bool together = contact != Contact::slipping && contact != Contact::alternating;
        mass.initial_speed = together ? 100 : 100 - 2 * clutches;
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
    const Model model = Model::build(d);
    Operators operators(model);
    State state(model);
    Inputs inputs(model);
    Outputs outputs(model);
    Scratch scratch(model);
    double& torque = inputs.value[static_cast<std::size_t>(model.input("source.drive.torque"))];
    torque = contact == Contact::swinging_hard ? 1000 : 50;
    const bool turns = contact == Contact::swinging || contact == Contact::swinging_hard;
    unsigned steps = 0;
    for (auto _ : bench) {
        if (turns && ++steps % 16 == 0) torque = -torque;
        step(model, operators, state, inputs, outputs, scratch);
    }
    bench.SetLabel(std::string(model.engine()) + " " + std::string(model.kernel()));
    bench.counters["fall_backs"] = outputs.certificate.fall_backs;
}

BENCHMARK_CAPTURE(step_chain, locked, Contact::locked, Method::automatic)
    ->Arg(2)
    ->Arg(10)
    ->Arg(50)
    ->Arg(100)
    ->Arg(200)
    ->Arg(500)
    ->Arg(1000);
BENCHMARK_CAPTURE(step_chain, slipping, Contact::slipping, Method::automatic)
    ->Arg(2)
    ->Arg(10)
    ->Arg(50)
    ->Arg(100)
    ->Arg(200)
    ->Arg(500)
    ->Arg(1000);
BENCHMARK_CAPTURE(step_chain, alternating, Contact::alternating, Method::automatic)
    ->Arg(2)
    ->Arg(10)
    ->Arg(50)
    ->Arg(200)
    ->Arg(1000);
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
