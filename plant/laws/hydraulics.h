// Hydraulic actuation of a wet clutch: command → dead time → slew limit → second-order valve → piston,
// chamber pressure.
//
//     dead time   u_d(t) = u(t − d): commands are held over steps, so u_d changes at most once inside a step
//     slew        ṙ = ± slew towards u_d
//     valve       p̈ = ω² (r − p) − 2 ζ ω ṗ
//     piston      x follows x_eq, where its spring p_s(x_eq) = p, as fast as its flow allows (piston.h)
//     chamber     p_c = p where x = x_eq, p_s(x) while x moves
//
//   u     pressure command                          Pa, limited to 0…maximum_pressure
//   r     slewed command (state)                    Pa
//   p, ṗ  valve outlet pressure (states)            Pa, Pa/s
//   x     piston stroke (state)                     m; capacity begins at full stroke, the kiss point
//   p_c   chamber pressure                          Pa: what presses the plates above p_return
//
// r is linear between the few instants at which the target changes or is reached, and over such a piece the
// valve is advanced exactly (particular solution r − 2ζṙ/ω, homogeneous part by its exponential): p is exact
// at the middle and the end of the step, whatever h. The chamber pressure jumps where the piston arrives at
// full stroke with p > p_return; HydraulicStep says when, so that the engine can split its step there. All
// else is continuous, p with two derivatives.
// Source: usual electro-hydraulic clutch model; figures are estimates (config/tractor.yaml).
// Does not model: flow forces, leakage, compressibility; p may swing below 0: harmless suction.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

#include "plant/description.h"
#include "plant/laws/oil.h"
#include "plant/laws/piston.h"
#include "plant/laws/step_values.h"
#include "plant/math/elementary.h"
#include "plant/math/table.h"

namespace shiftrig::plant {

// ---- solenoid -----------------------------------------------------------------------------------

// Pressure command of a solenoid current. `play` (state) is the current at the centre of the hysteresis band:
// it moves only when the band of full width `hysteresis` is pushed (backlash operator).
inline double solenoid_pressure(const Solenoid& p, double& play, double current) noexcept {
    const double half = 0.5 * p.hysteresis;
    if (current - half > play) play = current - half;
    if (current + half < play) play = current + half;
    return interpolate(p.pressure_over_current, play);
}

// ---- valve --------------------------------------------------------------------------------------

// y(t + dt) = Φ y(t), y = (p − p_particular, ṗ − ṙ).
struct ValveOperator {
    double duration = 0;                    // dt [s]
    double pp = 1, pv = 0, vp = 0, vv = 1;  // Φ
};

inline ValveOperator valve_operator(double omega, double zeta, double dt) noexcept {
    const double decay = zeta * omega;
    const double square = omega * omega * (1 - zeta * zeta);  // β², negative where overdamped
    const double x2 = square * dt * dt;
    double c, s;  // e^(−decay·dt) cos βt, e^(−decay·dt) sin(βt)/β
    if (std::fabs(x2) < 1e-4) {
        const double e = exp(-decay * dt);
        c = e * (1 - x2 / 2 * (1 - x2 / 12));
        s = e * dt * (1 - x2 / 6 * (1 - x2 / 20));
    } else if (square > 0) {
        const double beta = std::sqrt(square), e = exp(-decay * dt);
        c = e * cos(beta * dt);
        s = e * sin(beta * dt) / beta;
    } else {
        const double beta = std::sqrt(-square);
        const double slow = exp((beta - decay) * dt), fast = exp((-beta - decay) * dt);
        c = 0.5 * (slow + fast);
        s = 0.5 * (slow - fast) / beta;
    }
    return {dt, c + decay * s, s, -omega * omega * s, c - decay * s};
}

// What follows from the step size and the oil temperature: a pure function of both.
struct HydraulicOperator {
    double h = 0;                    // [s]
    double dead_steps = 0;           // d/h
    double omega = 0;                // valve frequency at this oil [rad/s]
    double two_zeta_over_omega = 0;  // [s]
    ValveOperator half;              // over h/2
    ValveOperator piece;             // over half a part of a piston's course
    double fill_flow = 0;            // [m³/s] at this oil, full pump
};

inline HydraulicOperator hydraulic_operator(const ActuationHydraulic& p, const OilEffects& oil,
                                            double h) noexcept {
    HydraulicOperator op;
    op.h = h;
    op.dead_steps = p.dead_time * oil.dead_time_factor / h;
    op.omega = p.natural_frequency * oil.valve_frequency_factor;
    op.two_zeta_over_omega = op.omega > 0 ? 2 * p.damping_ratio / op.omega : 0;
    op.half = valve_operator(op.omega, p.damping_ratio, 0.5 * h);
    if (has_piston(p)) op.piece = valve_operator(op.omega, p.damping_ratio, 0.5 * h / piston_parts);
    op.fill_flow = p.fill_flow * oil.fill_flow_factor;
    return op;
}

// ---- state --------------------------------------------------------------------------------------

struct HydraulicState {
    double play = 0;        // solenoid hysteresis [A]
    double head = 0;        // slot of the delay line that takes the next command (a whole number)
    double slewed = 0;      // r [Pa]
    double valve = 0;       // p [Pa]
    double valve_rate = 0;  // [Pa/s]
    double piston = 0;      // x [m]
    double chamber = 0;     // p_c [Pa]
    double steady =
        0;  // steps for which the command has been the same, at most the slots of the delay line; one more: quiet
};

// Slots that the delay line needs for the longest dead time (coldest oil).
inline std::size_t delay_slots(const ActuationHydraulic& p, const Oil* oil, double h) noexcept {
    const double factor = oil != nullptr && oil->cold_dead_time_factor > 1 ? oil->cold_dead_time_factor : 1;
    return static_cast<std::size_t>(p.dead_time * factor / h) + 3;
}

// Everything at rest at a pressure held for long.
inline HydraulicState hydraulic_rest(const ActuationHydraulic& p, double return_pressure, double pressure,
                                     std::span<double> delay_line) noexcept {
    for (double& slot : delay_line) slot = pressure;
    HydraulicState state;
    state.slewed = state.valve = state.chamber = pressure;
    state.steady = static_cast<double>(delay_line.size());
    state.piston = has_piston(p) ? balanced_stroke(p, return_pressure, pressure) : p.stroke;
    return state;
}

// ---- step ---------------------------------------------------------------------------------------

// Chamber pressure over one step. A piston at full stroke passes on the valve's pressure; it is there until `full_until`
// and again from `filled_from`: all the time where that is 0, no more or not yet in this step where it is above 1.
struct HydraulicStep {
    StepValues valve;                         // p
    double full_until = 0, filled_from = 0;   // fractions of the step
    double spring_begin = 0, spring_end = 0;  // p_s else

    // The limit from inside a part of the step: from the left at its end.
    double chamber(double s, bool from_left) const noexcept {
        const bool full = s < full_until || s > filled_from || filled_from <= 0 ||
                          (from_left ? s == full_until && s > 0 : s == filled_from);
        return full ? valve.at(s) : spring_begin + (spring_end - spring_begin) * s;
    }
    // The right limit at filled_from itself.
    double chamber(double s) const noexcept { return chamber(s, false); }
    // The same pressure all the time.
    bool rests() const noexcept {
        return is_constant(valve) && (filled_from <= 0 || (filled_from > 1 && spring_begin == spring_end));
    }
};

namespace detail {

inline void advance_valve(const HydraulicOperator& op, double zeta, HydraulicState& state, double dt,
                          double slope) noexcept {
    const double end = state.slewed + slope * dt;
    if (op.omega > 0) {
        const double lag = op.two_zeta_over_omega * slope;
        const ValveOperator phi = dt == op.half.duration    ? op.half
                                  : dt == op.piece.duration ? op.piece
                                                            : valve_operator(op.omega, zeta, dt);
        const double y = state.valve - (state.slewed - lag), rate = state.valve_rate - slope;
        state.valve = end - lag + phi.pp * y + phi.pv * rate;
        state.valve_rate = slope + phi.vp * y + phi.vv * rate;
    } else {
        state.valve = end;
    }
    state.slewed = end;
}

// Slew and valve over dt with a constant target.
inline void drive_valve(const ActuationHydraulic& p, const HydraulicOperator& op, HydraulicState& state,
                        double dt, double target) noexcept {
    if (!(dt > 0)) return;
    const double gap = target - state.slewed;
    if (gap == 0 || !(p.slew > 0)) {
        state.slewed = target;
        return advance_valve(op, p.damping_ratio, state, dt, 0);
    }
    const double slope = gap > 0 ? p.slew : -p.slew;
    const double reach = gap / slope;
    if (reach >= dt) return advance_valve(op, p.damping_ratio, state, dt, slope);
    advance_valve(op, p.damping_ratio, state, reach, slope);
    state.slewed = target;
    advance_valve(op, p.damping_ratio, state, dt - reach, 0);
}

// Within a millionth of a pascal of what it is told to be: it stays where it is, rather than creep there for ever.
inline bool valve_rests(const HydraulicState& state, double target) noexcept {
    constexpr double nothing = 1e-6;  // [Pa]
    constexpr double no_rate = 1e-4;  // [Pa/s]
    return state.slewed == target && std::fabs(state.valve - target) <= nothing &&
           std::fabs(state.valve_rate) <= no_rate;
}

}  // namespace detail

inline double limited_command(const ActuationHydraulic& p, double command) noexcept {
    return command < 0 ? 0 : command > p.maximum_pressure ? p.maximum_pressure : command;
}

// Nothing will change in a step with the limited command `target`: the delay line holds nothing else, and valve and piston
// have arrived. Advancing the state would leave all but `head` as it is. Once found, `steady` says so, one more than the
// slots: it is then enough that the command is still where the chamber is.
inline bool is_quiet(const ActuationHydraulic& p, double return_pressure, const HydraulicState& state,
                     std::size_t slots, double target) noexcept {
    return state.chamber == target && state.slewed == target && state.valve == target &&
           state.valve_rate == 0 && state.steady >= static_cast<double>(slots) &&
           (!has_piston(p) || state.piston == balanced_stroke(p, return_pressure, target));
}

// What the valve is told over one step: early until `change` [s], late from then on.
struct ValveTargets {
    double early = 0, late = 0, change = 0;
};

// With the pressure command `command` held over the step.
inline ValveTargets latch_command(const ActuationHydraulic& p, const HydraulicOperator& op,
                                  HydraulicState& state, std::span<double> delay_line,
                                  double command) noexcept {
    const std::size_t slots = delay_line.size();
    const auto head = static_cast<std::size_t>(state.head);
    delay_line[head] = limited_command(p, command);
    const double before = delay_line[head > 0 ? head - 1 : slots - 1];
    state.steady = delay_line[head] != before ? 0 : std::min(state.steady + 1, static_cast<double>(slots));
    state.head = static_cast<double>(head + 1 < slots ? head + 1 : 0);
    auto whole = static_cast<std::size_t>(op.dead_steps);
    double change = (op.dead_steps - static_cast<double>(whole)) * op.h;  // u_d changes here
    if (whole + 2 > slots) {  // longer than the line was built for: the oldest command it holds
        whole = slots - 1;
        change = 0;
    }
    const std::size_t late_slot = head >= whole ? head - whole : head + slots - whole;
    const double late = delay_line[late_slot];
    const double early = change > 0 ? delay_line[late_slot > 0 ? late_slot - 1 : slots - 1] : late;
    return {early, late, change};
}

// On from the time `from` of the step, by dt.
inline void drive_valve(const ActuationHydraulic& p, const HydraulicOperator& op, HydraulicState& state,
                        double from, double dt, const ValveTargets& targets) noexcept {
    if (targets.early == targets.late) return detail::drive_valve(p, op, state, dt, targets.late);
    const double first = std::clamp(targets.change - from, 0., dt);
    detail::drive_valve(p, op, state, first, targets.early);
    detail::drive_valve(p, op, state, dt - first, targets.late);
}

// The valve's outlet pressure over one step. `valve_held`: the valve sticks and keeps its outlet pressure.
inline StepValues valve_over_step(const ActuationHydraulic& p, const HydraulicOperator& op,
                                  HydraulicState& state, const ValveTargets& targets,
                                  bool valve_held) noexcept {
    StepValues valve;
    valve.begin = state.valve;
    if (targets.early == targets.late && detail::valve_rests(state, targets.late)) {
        state.valve = targets.late;
        state.valve_rate = 0;
        valve.middle = valve.end = state.valve;
        return valve;
    }
    if (valve_held) {
        state.slewed = state.valve;
        state.valve_rate = 0;
        valve.middle = state.valve;
    } else {
        const double half = 0.5 * op.h;
        drive_valve(p, op, state, 0, half, targets);
        valve.middle = state.valve;
        drive_valve(p, op, state, half, half, targets);
    }
    valve.end = state.valve;
    return valve;
}

inline StepValues valve_over_step(const ActuationHydraulic& p, const HydraulicOperator& op,
                                  HydraulicState& state, std::span<double> delay_line, double command,
                                  bool valve_held) noexcept {
    const ValveTargets targets = latch_command(p, op, state, delay_line, command);
    return valve_over_step(p, op, state, targets, valve_held);
}

// What it takes to look at the valve within a step.
struct ValveBefore {
    HydraulicState state;  // at its beginning
    ValveTargets targets;
};

inline void sample_valve(const HydraulicOperator& op, const ValveBefore& before,
                         PistonCourse& course) noexcept {
    HydraulicState state = before.state;
    const double piece = op.piece.duration;
    ValveSamples& samples = course.samples;
    samples.front() = course.valve.begin;
    for (std::size_t i = 1; i < samples.size(); ++i) {
        drive_valve(*course.description, op, state, static_cast<double>(i - 1) * piece, piece,
                    before.targets);
        samples[i] = state.valve;
    }
    samples.back() = course.valve.end;  // but for rounding
    course.is_sampled = true;
}

// There is a piston and this step may move it.
inline bool needs_course(const ActuationHydraulic& p, double return_pressure, double piston,
                         const StepValues& valve) noexcept {
    return has_piston(p) && !stays_at_stop(p, return_pressure, piston, valve);
}

// Without a course: the valve's pressure.
inline HydraulicStep end_step(const ActuationHydraulic& p, const StepValues& valve,
                              HydraulicState& state) noexcept {
    state.chamber = state.valve;
    return {valve, 0, state.piston < p.stroke ? 2. : 0., valve.begin, valve.end};
}

inline HydraulicStep end_step(const PistonCourse& course, HydraulicState& state) noexcept {
    const ActuationHydraulic& p = *course.description;
    const double return_pressure = course.return_pressure;
    const bool lags = course.motion == PistonMotion::fills || course.motion == PistonMotion::empties;
    state.piston = course.piston;
    state.chamber = lags ? spring_pressure(p, return_pressure, course.piston) : state.valve;
    HydraulicStep step{course.valve, course.full_until, course.filled_from};
    const double balance = balanced_stroke(p, return_pressure, course.valve.begin);
    step.spring_begin = course.begin == balance ? std::min(course.valve.begin, return_pressure)
                                                : spring_pressure(p, return_pressure, course.begin);
    step.spring_end = step.filled_from <= 1 ? return_pressure : state.chamber;
    return step;
}

}  // namespace shiftrig::plant
