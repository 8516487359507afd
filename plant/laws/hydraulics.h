// Hydraulic actuation of a wet clutch: command → dead time → slew limit → second-order valve → piston,
// chamber pressure.
//
//     dead time   u_d(t) = u(t − d): commands are held over steps, so u_d changes at most once inside a step
//     slew        ṙ = ± slew towards u_d
//     valve       p̈ = ω² (r − p) − 2 ζ ω ṗ
//     spring      p_s(x) = preload + (p_return − preload) x/stroke, preload ≤ p_return
//     piston      x follows x_eq (where p_s(x_eq) = p, within 0…stroke) at no more than ± stroke · Q/V
//     chamber     p_c = p where x = x_eq, p_s(x) while x moves
//
//   u     pressure command                          Pa, limited to 0…maximum_pressure
//   r     slewed command (state)                    Pa
//   p, ṗ  valve outlet pressure (states)            Pa, Pa/s
//   x     piston stroke (state)                     m; capacity begins at full stroke, the kiss point
//   p_c   chamber pressure                          Pa: what presses the plates above p_return
//   Q     flow into the piston                      m³/s: fill_flow by oil viscosity and share of the pump
//   V     fill volume                               m³
//
// r is linear between the few instants at which the target changes or is reached, and over such a piece the
// valve is advanced exactly (particular solution r − 2ζṙ/ω, homogeneous part by its exponential): p is exact
// at the middle and the end of the step, whatever h. The chamber pressure jumps where the piston arrives at
// full stroke with p > p_return; HydraulicStep says when, so that the engine can split its step there. All
// else is continuous, p with two derivatives.
// Source: usual electro-hydraulic clutch model; figures are estimates (config/tractor.yaml).
// Does not model: flow forces, leakage, compressibility, a different emptying; p may swing below 0: harmless suction.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

#include "plant/description.h"
#include "plant/laws/oil.h"
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

inline bool has_piston(const ActuationHydraulic& p) noexcept {
    return p.stroke > 0 && p.fill_volume > 0 && p.fill_flow > 0;
}

inline double spring_pressure(const ActuationHydraulic& p, double return_pressure, double piston) noexcept {
    return p.preload_pressure + (return_pressure - p.preload_pressure) * (piston / p.stroke);
}

// Stroke at which the spring balances the valve.
inline double balanced_stroke(const ActuationHydraulic& p, double return_pressure, double valve) noexcept {
    if (valve >= return_pressure) return p.stroke;
    if (valve <= p.preload_pressure) return 0;
    return p.stroke * (valve - p.preload_pressure) / (return_pressure - p.preload_pressure);
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

// Chamber pressure over one step.
struct HydraulicStep {
    StepValues valve;  // p
    double filled_from =
        0;  // fraction of the step from which the piston is at full stroke; > 1: not in this step
    double spring_begin = 0, spring_end = 0;  // p_s before that

    // The right limit at filled_from itself.
    double chamber(double s) const noexcept {
        return s >= filled_from ? valve.at(s) : spring_begin + (spring_end - spring_begin) * s;
    }
    bool jumps() const noexcept { return filled_from > 0 && filled_from <= 1; }
    // The same pressure all the time.
    bool rests() const noexcept {
        return valve.begin == valve.end && valve.begin == valve.middle &&
               (filled_from <= 0 || (filled_from > 1 && spring_begin == spring_end));
    }
};

// Flow that this piston wants at the start of the step [m³/s]; the pump's share is min(1, pump_flow/Σ
// demand).
inline double fill_demand(const ActuationHydraulic& p, const HydraulicOperator& op, double return_pressure,
                          const HydraulicState& state) noexcept {
    return has_piston(p) && state.piston < balanced_stroke(p, return_pressure, state.valve) ? op.fill_flow
                                                                                            : 0;
}

namespace detail {

inline void advance_valve(const HydraulicOperator& op, double zeta, HydraulicState& state, double dt,
                          double slope) noexcept {
    const double end = state.slewed + slope * dt;
    if (op.omega > 0) {
        const double lag = op.two_zeta_over_omega * slope;
        const ValveOperator phi = dt == op.half.duration ? op.half : valve_operator(op.omega, zeta, dt);
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

inline void advance_piston(const ActuationHydraulic& p, const HydraulicOperator& op, double return_pressure,
                           double pump_share, HydraulicState& state, HydraulicStep& step) noexcept {
    if (!has_piston(p)) {
        step.filled_from = 0;
        state.chamber = state.valve;
        return;
    }
    const double x0 = state.piston;
    const double spring0 = spring_pressure(p, return_pressure, x0);
    const double goal = balanced_stroke(p, return_pressure, step.valve.end);
    const double speed = p.stroke * op.fill_flow * pump_share / p.fill_volume;
    // A piston that rests on its stop starts when the valve passes the spring line inside the step.
    double from = 0;
    if (goal > x0 && step.valve.begin < spring0)
        from = (spring0 - step.valve.begin) / (step.valve.end - step.valve.begin);
    const double reach = speed * op.h * (1 - from);
    double x1 = goal;
    if (goal > x0 + reach) x1 = x0 + reach;
    if (goal < x0 - reach) x1 = x0 - reach;
    step.filled_from = 2;
    if (x0 >= p.stroke) {
        step.filled_from = 0;
    } else if (x1 >= p.stroke) {
        const double at = from + (p.stroke - x0) / (speed * op.h);
        step.filled_from = at < 1 ? at : 1;
    }
    state.piston = x1;
    step.spring_begin =
        x0 == balanced_stroke(p, return_pressure, step.valve.begin) ? step.valve.begin : spring0;
    state.chamber = x1 == goal ? state.valve : spring_pressure(p, return_pressure, x1);
    step.spring_end = step.filled_from <= 1 ? return_pressure : state.chamber;
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

// One step with the pressure command `command` held over it. `valve_held`: the valve sticks and keeps its
// outlet pressure.
inline HydraulicStep advance_hydraulics(const ActuationHydraulic& p, const HydraulicOperator& op,
                                        double return_pressure, HydraulicState& state,
                                        std::span<double> delay_line, double command, double pump_share,
                                        bool valve_held = false) noexcept {
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

    HydraulicStep step;
    step.valve.begin = state.valve;
    if (early == late && detail::valve_rests(state, late)) {
        state.valve = late;
        state.valve_rate = 0;
        step.valve.middle = step.valve.end = state.valve;
        detail::advance_piston(p, op, return_pressure, pump_share, state, step);
        return step;
    }
    if (valve_held) {
        state.slewed = state.valve;
        state.valve_rate = 0;
        step.valve.middle = state.valve;
    } else if (early == late) {
        detail::drive_valve(p, op, state, 0.5 * op.h, late);
        step.valve.middle = state.valve;
        detail::drive_valve(p, op, state, 0.5 * op.h, late);
    } else {
        const double half = 0.5 * op.h;
        const double first = change < half ? change : half;
        detail::drive_valve(p, op, state, first, early);
        detail::drive_valve(p, op, state, half - first, late);
        step.valve.middle = state.valve;
        const double second = change > half ? change - half : 0;
        detail::drive_valve(p, op, state, second, early);
        detail::drive_valve(p, op, state, half - second, late);
    }
    step.valve.end = state.valve;
    detail::advance_piston(p, op, return_pressure, pump_share, state, step);
    return step;
}

}  // namespace shiftrig::plant
