// Machines with loops, which no tree engine runs: stretches of twenty masses, each a gearbox of four clutches in parallel, a
// planetary row whose ring is braked, and an axle of shafts. ns of a quiet step, of a step in which a clutch locks (modes
// known), and of the same step where the mode that it locks into has to be built.
#include <benchmark/benchmark.h>

#include <string>

#include "bench/stepping.h"

namespace shiftrig::plant {
namespace {

enum class Contact { quiet, event, new_mode };

struct Line {
    Description d;
    int masses = 0;

    std::string mass(double inertia, double speed) {
        Mass mass;
        mass.name = "m" + std::to_string(masses++);
        mass.inertia = inertia;
        mass.initial_speed = speed;
        d.masses.push_back(mass);
        return mass.name;
    }
    void shaft(const std::string& a, const std::string& b, double stiffness, double damping) {
        d.shafts.push_back({"s" + b, a, b, stiffness, damping, 0});
    }
    void clutch(const std::string& a, const std::string& b, double capacity, bool locked) {
        Clutch c;
        c.name = "c" + std::to_string(d.clutches.size());
        c.a = a;
        c.b = b;
        DryFriction friction;
        friction.sliding_capacity = capacity;
        friction.static_ratio = 1.1;
        c.friction = friction;
        c.actuation = ActuationConstant{};
        c.initially_locked = locked;
        d.clutches.push_back(c);
    }
};

// `closing`: the clutch of the second gear slips and will lock.
std::string add_gearbox(Line& line, const std::string& before, double& speed, bool closing) {
    const std::string input = line.mass(0.2, speed);
    if (!before.empty()) line.shaft(before, input, 5e4, 5);
    const double ratios[] = {1.6, 1.05, 0.8, 0.6}, second = ratios[1];
    std::string driven[4];
    for (int i = 0; i < 4; ++i) {
        driven[i] = line.mass(0.03 + 0.01 * i, speed / ratios[i]);
        Gear gear;
        gear.name = "g" + driven[i];
        gear.a = input;
        gear.b = driven[i];
        gear.ratio = ratios[i];
        gear.efficiency = i == 1 ? 0.98 : 1;  // idle ones change their driving side all the time
        line.d.gears.push_back(gear);
    }
    speed = speed / second - (closing ? 8 : 0);
    const std::string output = line.mass(0.15, speed);
    for (int i = 0; i < 4; ++i)
        line.clutch(driven[i], output, i == 1 ? (closing ? 300 : 1e6) : 1e-3, i == 1 && !closing);
    return output;
}

// In at the sun and out at the carrier, or the other way round.
std::string add_row(Line& line, const std::string& before, double& speed, bool reduces) {
    constexpr double ratio = -2.5;  // ω_sun = (1 − u) ω_carrier while the ring stands
    const std::string in = line.mass(0.1, speed), ring = line.mass(0.1, 0);
    speed *= reduces ? 1 / (1 - ratio) : 1 - ratio;
    const std::string out = line.mass(0.2, speed);
    line.shaft(before, in, 1e5, 10);
    Planetary row;
    row.name = "r" + in;
    row.sun = reduces ? in : out;
    row.ring = ring;
    row.carrier = reduces ? out : in;
    row.ratio = ratio;
    row.efficiency = 0.985;
    line.d.planetaries.push_back(row);
    line.clutch(ring, "", 1e6, true);
    return out;
}

Description machine_of(int masses, bool closing) {
    Line line;
    line.d.name = "gearboxes";
    double speed = 150;
    std::string last;
    const int stretches = masses / 20;
    for (int stretch = 0; stretch < stretches; ++stretch) {
        last = add_gearbox(line, last, speed, closing && stretch == stretches / 2);
        last = add_row(line, last, speed, stretch % 2 == 0);
        while (line.masses < 20 * (stretch + 1)) {
            const std::string next = line.mass(0.1 + 0.05 * (line.masses % 7), speed);
            line.shaft(last, next, 8e4, 8);
            last = next;
        }
    }
    line.d.dampers.push_back({"load", last, "", 0.5});
    TorqueSource source;
    source.name = "drive";
    source.mass = "m0";
    source.input = true;
    line.d.sources = {source};
    return line.d;
}

void step_gearboxes(benchmark::State& bench, Contact contact) {
    Machine machine(machine_of(static_cast<int>(bench.range(0)), contact != Contact::quiet),
                    KernelKind::automatic);
    machine.set("source.drive.torque", 150);
    if (contact != Contact::quiet) return repeat_event(bench, machine, contact == Contact::new_mode);
    machine.step(2000);
    repeat(bench, machine, 100);
}

void all_sizes(benchmark::internal::Benchmark* bench) {
    for (const int masses : {20, 40, 60, 80, 160}) bench->Arg(masses);
}

BENCHMARK_CAPTURE(step_gearboxes, quiet, Contact::quiet)->Apply(all_sizes);
BENCHMARK_CAPTURE(step_gearboxes, event, Contact::event)->UseManualTime()->Apply(all_sizes);
BENCHMARK_CAPTURE(step_gearboxes, new_mode, Contact::new_mode)->UseManualTime()->Apply(all_sizes);

}  // namespace
}  // namespace shiftrig::plant

BENCHMARK_MAIN();
