// Runs made of formulas instead of a simulation, of a small machine with gears A (ratio 4), B (ratio 3) and
// R (ratio −4) behind a main clutch Fc: what the scorecard has to say about them is known by calculation.
//
//   engine –Fc– input –A|B|R– gears – output –axle– wheels (–Fw– vehicle)
#pragma once

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "analysis/run.h"

namespace shiftrig::analysis {

inline plant::Description small_machine() {
    plant::Description machine;
    machine.name = "small machine";
    for (const char* name : {"engine", "input", "pinion_a", "pinion_b", "pinion_r", "output", "wheels"}) {
        machine.masses.push_back({.name = name, .inertia = 1});
    }
    machine.masses.push_back({.name = "vehicle", .inertia = 1000, .motion = plant::Motion::translating});
    machine.shafts.push_back({.name = "axle", .a = "output", .b = "wheels", .stiffness = 1e6});
    const auto clutch = [&](const char* name, const char* a, const char* b, plant::Actuation actuation) {
        plant::Clutch result;
        result.name = name;
        result.a = a;
        result.b = b;
        plant::DryFriction friction;
        friction.sliding_capacity = 2000;
        result.friction = friction;
        result.actuation = std::move(actuation);
        machine.clutches.push_back(result);
    };
    clutch("Fc", "engine", "input", plant::ActuationRelease{});
    clutch("A", "input", "pinion_a", plant::ActuationDirect{});
    clutch("B", "input", "pinion_b", plant::ActuationDirect{});
    clutch("R", "input", "pinion_r", plant::ActuationDirect{});
    clutch("Fw", "wheels", "vehicle", plant::ActuationConstant{});
    machine.clutches.back().radius = 0.8;
    const auto gear = [&](const char* name, const char* pinion, double ratio) {
        plant::Gear result;
        result.name = name;
        result.a = pinion;
        result.b = "output";
        result.ratio = ratio;
        machine.gears.push_back(result);
    };
    gear("a", "pinion_a", 4);
    gear("b", "pinion_b", 3);
    gear("r", "pinion_r", -4);
    plant::Engine engine;
    engine.name = "engine";
    engine.mass = "engine";
    engine.full_load = {{80, 700}, {220, 600}};
    engine.governor_slope = 100;
    engine.low_idle = 90;
    engine.high_idle = 230;
    machine.engines.push_back(engine);
    machine.gear_paths = {{"A", {"Fc", "A"}}, {"B", {"Fc", "B"}}, {"R", {"Fc", "R"}}};
    machine.input_mass = "engine";
    machine.output_mass = "wheels";
    return machine;
}

using Formula = std::function<double(double time)>;

class SyntheticRun {
  public:
    explicit SyntheticRun(double duration = 10, double interval = 1e-3) {
        run.machine = small_machine();
        const auto rows = static_cast<std::size_t>(std::llround(duration / interval)) + 1;
        for (std::size_t i = 0; i < rows; ++i) run.time.push_back(static_cast<double>(i) * interval);
    }
    SyntheticRun& set(const std::string& name, const Formula& formula) {
        for (Column& column : run.columns) {
            if (column.signal.name == name) {
                for (std::size_t i = 0; i < run.time.size(); ++i) column.value[i] = formula(run.time[i]);
                return *this;
            }
        }
        Column column;
        column.signal.name = name;
        column.value.resize(run.time.size());
        run.columns.push_back(std::move(column));
        return set(name, formula);
    }
    SyntheticRun& set(const std::string& name, double value) {
        return set(name, [value](double) { return value; });
    }
    // Of the input, and of the engine behind the closed main clutch.
    SyntheticRun& set_input_speed(const Formula& formula) {
        return set("mass.input.speed", formula).set("mass.engine.speed", formula);
    }
    Run run;
};

constexpr double locked = 0, slipping = 1, open = 2;

// from before `at`, to after it.
inline Formula step(double at, double from, double to) {
    return [=](double t) { return t < at - 1e-9 ? from : to; };
}
// Linear from (t0, from) to (t1, to), constant outside.
inline Formula ramp(double t0, double t1, double from, double to) {
    return [=](double t) {
        return t <= t0 ? from : t >= t1 ? to : from + (to - from) * (t - t0) / (t1 - t0);
    };
}

// Gear A, output turning at 30 rad/s, input 120, everything still: the base of what follows.
inline SyntheticRun driving_in_a(double duration = 10) {
    SyntheticRun synthetic(duration);
    synthetic.set("driver.lever", 1).set("engine.engine.torque", 500);
    synthetic.set("mass.engine.speed", 120).set("mass.input.speed", 120).set("mass.output.speed", 30);
    synthetic.set("mass.wheels.speed", 30).set("mass.vehicle.speed", 2).set("body.vehicle.acceleration", 0);
    synthetic.set("shaft.axle.torque", 2000);
    for (const char* name : {"A", "B", "R"}) {
        const std::string clutch = std::string("clutch.") + name;
        const bool in = *name == 'A';
        synthetic.set(clutch + ".engagement", in).set(clutch + ".state", in ? locked : open);
        synthetic.set(clutch + ".capacity", in ? 2000 : 0).set(clutch + ".torque", in ? 500 : 0);
        synthetic.set(clutch + ".slip", 0).set(clutch + ".heat", 0).set(clutch + ".heat_power", 0);
    }
    for (const char* name : {"Fc", "Fw"}) {
        const std::string clutch = std::string("clutch.") + name;
        synthetic.set(clutch + ".state", locked).set(clutch + ".slip", 0).set(clutch + ".heat", 0);
    }
    return synthetic;
}

// Upshift A → B: lever at 5.0 s, B commanded at 5.1, kiss at 5.2, A off at 5.3, the input's speed falls from 120 to
// 90 rad/s between 5.3 and 5.7 s while the output keeps 30: 2 % above 90 are reached at 91.8, that is at 5.676 s.
inline SyntheticRun upshift() {
    SyntheticRun synthetic = driving_in_a();
    synthetic.set("driver.lever", step(5.0, 1, 2));
    synthetic.set("clutch.B.engagement", step(5.1, 0, 1)).set("clutch.B.capacity", step(5.2, 0, 1000));
    synthetic.set("clutch.A.engagement", step(5.25, 1, 0)).set("clutch.A.capacity", step(5.3, 2000, 0));
    const Formula input = ramp(5.3, 5.7, 120, 90);
    synthetic.set_input_speed(input);
    synthetic.set("clutch.A.slip", [input](double t) { return input(t) - 120; });
    synthetic.set("clutch.B.slip", [input](double t) { return input(t) - 90; });
    synthetic.set("clutch.A.state", step(5.3, locked, open));
    synthetic.set("clutch.B.state", [](double t) {
        return t < 5.2 - 1e-9 ? open : t < 5.7 - 1e-9 ? slipping : locked;
    });
    return synthetic;
}

}  // namespace shiftrig::analysis
