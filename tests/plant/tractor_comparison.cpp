#include "tests/plant/tractor_comparison.h"

#include <cmath>
#include <cstdio>
#include <ctime>

namespace shiftrig {
namespace {

using namespace plant;
using cases::TractorShift;

constexpr std::array<const char*, 5> masses = {"engine", "input", "output", "wheels", "vehicle"};
constexpr std::array<const char*, 3> shafts = {"damper", "pinion_shaft", "axle"};
constexpr std::array<const char*, 3> clutches = {"Fc", "F2", "F3"};

double cpu_time() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

struct Rig {
    Rig(const Description& description, double step_size, KernelKind kernel)
        : model(Model::build(description, {.step_size = step_size, .kernel = kernel})),
          operators(model),
          state(model),
          inputs(model),
          outputs(model),
          scratch(model) {}
    void set(const char* name, double value) {
        const int index = model.input(name);
        if (index >= 0) inputs.value[static_cast<std::size_t>(index)] = value;
    }
    double get(const std::string& name) const {
        return outputs.value.at(static_cast<std::size_t>(model.output(name)));
    }
    void advance() { step(model, operators, state, inputs, outputs, scratch); }

    Model model;
    Operators operators;
    State state;
    Inputs inputs;
    Outputs outputs;
    Scratch scratch;
};

void begin(Rig& rig, const TractorShift& shift) {
    rig.set("driver.throttle", shift.throttle);
    rig.set("environment.draft", 1);
    rig.set("clutch.F2.pressure_command", 18e5);
    start(rig.model, rig.state, {shift.start_locked, shift.start_speeds}, rig.inputs);
}

}  // namespace

TraceError error(const ShiftTrace& trace, const ShiftTrace& truth) {
    TraceError result;
    const std::size_t n = std::min(trace.rows.size(), truth.rows.size());
    for (std::size_t i = 0; i < 11; ++i) {
        double mean = 0, spread = 0, difference = 0;
        for (std::size_t k = 0; k < n; ++k) mean += truth.rows[k][i] / static_cast<double>(n);
        for (std::size_t k = 0; k < n; ++k) {
            spread += std::pow(truth.rows[k][i] - mean, 2);
            difference += std::pow(truth.rows[k][i] - trace.rows[k][i], 2);
        }
        result.relative[i] = std::sqrt(difference / spread);
        if (!(result.relative[i] <= result.worst)) {
            result.worst = result.relative[i];
            result.signal = shift_signals[i];
        }
    }
    return result;
}

reference::Vector start_speeds(const TractorShift& shift) {
    Rig rig(shift.description, 1e-3, KernelKind::portable);
    begin(rig, shift);
    const auto speeds = rig.state.speeds();
    return Eigen::Map<const reference::Vector>(speeds.data(), static_cast<Eigen::Index>(speeds.size()));
}

ShiftTrace run_plant(const TractorShift& shift, int steps_per_millisecond,
                     const std::function<void(Description&)>& change, KernelKind kernel) {
    Description description = shift.description;
    if (change) change(description);
    Rig rig(description, 1e-3 / steps_per_millisecond, kernel);
    begin(rig, shift);
    const auto f2 = static_cast<std::size_t>(rig.model.input("clutch.F2.pressure_command"));
    const auto f3 = static_cast<std::size_t>(rig.model.input("clutch.F3.pressure_command"));
    const long warm_up = std::lround(shift.warm_up * 1000) * steps_per_millisecond;
    for (long k = 0; k < warm_up; ++k) rig.advance();
    ShiftTrace trace;
    std::array<std::size_t, 11> index{};
    std::size_t i = 0;
    for (const char* m : masses)
        index[i++] = static_cast<std::size_t>(rig.model.output(std::string("mass.") + m + ".speed"));
    for (const char* s : shafts)
        index[i++] = static_cast<std::size_t>(rig.model.output(std::string("shaft.") + s + ".torque"));
    for (const char* c : clutches)
        index[i++] = static_cast<std::size_t>(rig.model.output(std::string("clutch.") + c + ".torque"));
    const auto record = [&] {
        std::array<double, 11> row;
        for (std::size_t s = 0; s < 11; ++s) row[s] = rig.outputs.value[index[s]];
        trace.rows.push_back(row);
    };
    record();
    const double defect = rig.get("energy.defect"), dissipated = rig.get("energy.dissipated");
    const double heat = rig.get("clutch.F2.heat") + rig.get("clutch.F3.heat");
    const long milliseconds = std::lround(shift.duration * 1000);
    for (long k = 0; k < milliseconds; ++k) {
        const auto command = shift.command(k);
        rig.inputs.value[f2] = command[0];
        rig.inputs.value[f3] = command[1];
        const double from = cpu_time();
        for (int j = 0; j < steps_per_millisecond; ++j) {
            rig.advance();
            trace.fall_backs += rig.outputs.certificate.fall_backs;
            trace.localised += rig.outputs.certificate.events;
            for (int e = 0; e < std::min(rig.outputs.event_count, Outputs::event_capacity); ++e)
                trace.events.push_back(explain(rig.model, rig.outputs.events[static_cast<std::size_t>(e)]));
        }
        trace.seconds += cpu_time() - from;
        record();
    }
    trace.energy_defect = rig.get("energy.defect") - defect;
    trace.dissipated = rig.get("energy.dissipated") - dissipated;
    trace.clutch_heat = rig.get("clutch.F2.heat") + rig.get("clutch.F3.heat") - heat;
    return trace;
}

std::array<double, 11> shift_row(const reference::System& system, const reference::Sample& sample) {
    std::array<double, 11> row{};
    std::size_t i = 0;
    for (const char* m : masses) row[i++] = sample.z[system.mass(m)];
    for (int e = 0; e < 3; ++e) {
        const auto column = system.shaft_columns.col(e);
        row[i++] = system.stiffness[e] * sample.z[system.masses + e] +
                   system.damping[e] * column.dot(sample.z.head(system.masses));
    }
    for (const char* c : clutches)
        for (std::size_t f = 0; f < system.frictions.size(); ++f)
            if (system.frictions[f].name == c)
                row[i] = sample.friction_torque[static_cast<Eigen::Index>(f)], ++i;
    return row;
}

ShiftTrace run_reference(const TractorShift& shift, double step) {
    const reference::System system = cases::tractor_system(shift, start_speeds(shift));
    reference::Solver solver(system);
    const reference::Result before = solver.run(shift.warm_up, {.step = 2e-5, .resolution = 1});
    ShiftTrace trace;
    trace.rows.push_back(shift_row(system, before.samples.back()));
    const double from = cpu_time();
    const reference::Result result =
        solver.run(shift.warm_up + shift.duration, {.step = step, .resolution = 1});
    trace.seconds = cpu_time() - from;
    for (const auto& sample : result.samples) trace.rows.push_back(shift_row(system, sample));
    for (const auto& change : result.changes) {
        char line[120];
        std::snprintf(line, sizeof line, "%.7f %s %s", change.time - shift.warm_up, change.device.c_str(),
                      change.what.c_str());
        if (change.time > shift.warm_up) trace.events.push_back(line);
    }
    trace.dissipated = result.samples.back().dissipated - before.samples.back().dissipated;
    trace.fall_backs = result.unresolved + 1000 * result.gave_up;
    return trace;
}

}  // namespace shiftrig
