// Valves and pistons of the tests of hydraulics, taken through steps as the engine takes them.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "plant/laws/hydraulics.h"

namespace shiftrig::plant {

constexpr double bar = 1e5;

inline ActuationHydraulic reference_valve(bool piston) {
    ActuationHydraulic p;
    p.dead_time = 0.015;
    p.natural_frequency = 60;
    p.damping_ratio = 0.8;
    p.slew = 150 * bar;
    p.maximum_pressure = 18 * bar;
    p.preload_pressure = 0.8 * bar;
    if (piston) {
        p.stroke = 2e-3;
        p.fill_volume = 30e-6;
        p.fill_flow = 20e-3 / 60;
    }
    return p;
}
constexpr double p_return = 1.2 * bar;

// A valve, and a piston behind it where it may move, through a step as the engine takes it: first the valve, ...
struct PistonStep {
    PistonCourse course;
    ValveBefore before;
};
inline PistonStep begin_step(const ActuationHydraulic& p, const HydraulicOperator& op, double return_pressure,
                             HydraulicState& state, std::span<double> delay_line, double command,
                             bool valve_held = false) {
    const ValveTargets targets = latch_command(p, op, state, delay_line, command);
    const ValveBefore before{state, targets};
    const StepValues valve = valve_over_step(p, op, state, targets, valve_held);
    return {begin_piston(p, return_pressure, op.fill_flow, op.h, state.piston, valve), before};
}
// ... then all pistons.
inline void advance(std::vector<PistonStep>& steps, const HydraulicOperator& op, double pump_flow) {
    std::vector<PistonCourse> courses;
    for (const PistonStep& step : steps) courses.push_back(step.course);
    if (!std::all_of(courses.begin(), courses.end(), needs_no_samples)) {
        for (std::size_t k = 0; k < steps.size(); ++k) {
            if (!is_constant(courses[k].valve)) sample_valve(op, steps[k].before, courses[k]);
        }
    }
    advance_pistons(courses, pump_flow);
    for (std::size_t k = 0; k < steps.size(); ++k) steps[k].course = courses[k];
}

// One step of an actuator that has the pump for itself (pump_flow 0: as much as it asks for).
inline HydraulicStep advance_hydraulics(const ActuationHydraulic& p, const HydraulicOperator& op,
                                        double return_pressure, HydraulicState& state,
                                        std::span<double> delay_line, double command, double pump_flow = 0,
                                        bool valve_held = false) {
    if (!has_piston(p)) {
        const StepValues valve = valve_over_step(p, op, state, delay_line, command, valve_held);
        return end_step(p, valve, state);
    }
    std::vector<PistonStep> steps = {
        begin_step(p, op, return_pressure, state, delay_line, command, valve_held)};
    const StepValues& valve = steps[0].course.valve;
    if (!needs_course(p, return_pressure, state.piston, valve)) return end_step(p, valve, state);
    advance(steps, op, pump_flow);
    return end_step(steps[0].course, state);
}

// Does the piston reach full stroke in this step?
inline bool fills(const HydraulicStep& step) {
    return step.filled_from > 0 && step.filled_from <= 1;
}

struct Rig {
    ActuationHydraulic p;
    HydraulicOperator op;
    std::vector<double> line;
    HydraulicState state;

    Rig(const ActuationHydraulic& parameters, double h, const OilEffects& oil = {}, double pressure = 0)
        : p(parameters),
          op(hydraulic_operator(parameters, oil, h)),
          line(delay_slots(parameters, nullptr, h) + 400) {
        state = hydraulic_rest(p, p_return, pressure, line);
    }
    HydraulicStep step(double command, double pump_flow = 0) {
        return advance_hydraulics(p, op, p_return, state, line, command, pump_flow);
    }
};

}  // namespace shiftrig::plant
