// The piston of a wet clutch over one step: when it fills, turns back, empties.
//
//     spring      p_s(x) = preload + (p_return − preload) x/stroke, preload ≤ p_return
//     balance     x_eq: p_s(x_eq) = p, within 0…stroke
//     piston      x follows x_eq, filling at no more than stroke · Q s/V, emptying at no more than stroke · Q/V
//     pump        s = min(1, pump flow/Σ Q of the pistons that fill)
//
//   x     piston stroke (state)                     m; capacity begins at full stroke, the kiss point
//   p     valve outlet pressure                     Pa, over a step the parabola through its beginning, middle and end
//   Q     flow into the piston                      m³/s: fill_flow by oil viscosity
//   V     fill volume                               m³
//   s     share of what they ask for that the pump gives to the pistons that fill   1
//
// A piston fills while its spring is behind the valve (p > p_s), empties while the valve is behind the spring, and stands
// at its stops. Where they balance it follows, as long as that takes no more than its flow; what follows asks the pump for
// nothing. Between two changes of such motions, of any piston at the pump, s is constant, p_s linear in time and p a
// parabola: the next change is the root of a linear or quadratic equation, and pistons at one pump go from change to
// change together. The times of changes are therefore as good as the parabola, of third order where p crosses p_s.
// Emptying takes nothing from the pump and is not slowed by what others take.
// Does not model: leakage, compressibility, a different flow out of the piston than into it, a pump that gives one piston
// more than another.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

#include "plant/description.h"
#include "plant/laws/step_values.h"

namespace shiftrig::plant {

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

enum class PistonMotion : unsigned char { rests_empty, rests_full, follows, fills, empties };

// A piston on its way through a step. Fractions are of the step; rates per step.
struct PistonCourse {
    const ActuationHydraulic* description = nullptr;
    double return_pressure = 0;      // [Pa]
    StepValues valve;                // p [Pa]
    double slope = 0, bend = 0;      // p = p_begin + slope s + bend s² [Pa]
    double stiffness = 0;            // dp_s/dx [Pa/m]
    double flow = 0;                 // Q [m³/s]
    double full_rate = 0, rate = 0;  // |dx| at Q, and filling at its share of the pump [m]
    double begin = 0;                // x at the beginning of the step [m]

    double since = 0;   // from here its motion is what it is, and so is the share
    double piston = 0;  // x there [m]
    double excess = 0;  // p − p_s there, 0 where it is in balance [Pa]
    PistonMotion motion = PistonMotion::rests_empty, next_motion = PistonMotion::rests_empty;
    double next = 2;  // where its motion changes unless the share does before; > 1: not in this step

    double full_until = 0;   // it is at full stroke from the beginning until here
    double filled_from = 2;  // and from here on; > 1: not in this step
};

namespace detail {

constexpr double not_in_step = 2;         // in this step
constexpr double no_part_of_step = 1e-9;  // what happens so near its ends happens there

// Where e + a u + b u², e ≥ 0, gets below 0, u ≥ 0. Which side it leaves a zero to is known: a zero at u = 0 is none.
inline double falls_below(double e, double a, double b) noexcept {
    if (!(e > 0)) return a > 0 && b < 0 ? -a / b : not_in_step;
    const double square = a * a - 4 * b * e;
    if (!(square > 0)) return not_in_step;
    if (a <= 0) return 2 * e / (std::sqrt(square) - a);
    return b < 0 ? (a + std::sqrt(square)) / (-2 * b) : not_in_step;
}

inline double rise(const PistonCourse& c, double s) noexcept {
    return c.slope + 2 * c.bend * s;
}

// What follows from a balance of spring and valve is decided by how fast p moves.
inline PistonMotion motion_from_balance(const PistonCourse& c) noexcept {
    const double by = rise(c, c.since);
    if (c.piston >= c.description->stroke && (by > 0 || (by == 0 && c.bend >= 0)))
        return PistonMotion::rests_full;
    if (c.piston <= 0 && (by < 0 || (by == 0 && c.bend <= 0))) return PistonMotion::rests_empty;
    const double up = c.stiffness * c.rate, down = c.stiffness * -c.full_rate;
    if (by > up || (by == up && c.bend > 0)) return PistonMotion::fills;
    if (by < down || (by == down && c.bend < 0)) return PistonMotion::empties;
    return PistonMotion::follows;
}

// Finds the next change of motion.
inline void foresee(PistonCourse& c) noexcept {
    const double stroke = c.description->stroke, by = rise(c, c.since);
    double after = not_in_step;
    c.next_motion = PistonMotion::follows;  // if in balance; motion_from_balance() says
    const auto consider = [&](double u, PistonMotion motion) {
        if (u < after) {
            after = u;
            c.next_motion = motion;
        }
    };
    switch (c.motion) {
        case PistonMotion::rests_empty:
            after = falls_below(-c.excess, -by, -c.bend);
            break;
        case PistonMotion::rests_full:
            after = falls_below(c.excess, by, c.bend);
            break;
        case PistonMotion::fills:
            after = falls_below(c.excess, by - c.stiffness * c.rate, c.bend);
            if (c.rate > 0) consider((stroke - c.piston) / c.rate, PistonMotion::rests_full);
            break;
        case PistonMotion::empties:
            after = falls_below(-c.excess, -by - c.stiffness * c.full_rate, -c.bend);
            consider(c.piston / c.full_rate, PistonMotion::rests_empty);
            break;
        case PistonMotion::follows: {
            const double p = c.valve.at(c.since), up = c.stiffness * c.rate,
                         down = c.stiffness * -c.full_rate;
            if (c.bend > 0) consider((up - by) / (2 * c.bend), PistonMotion::fills);
            if (c.bend < 0) consider((down - by) / (2 * c.bend), PistonMotion::empties);
            consider(falls_below(c.return_pressure - p, -by, -c.bend), PistonMotion::rests_full);
            consider(falls_below(p - c.description->preload_pressure, by, c.bend), PistonMotion::rests_empty);
            break;
        }
    }
    c.next = c.since + std::max(after, 0.);
    if (std::fabs(c.next - 1) <= no_part_of_step) c.next = 1;
}

// On to the fraction s, without a change of motion.
inline void move_on(PistonCourse& c, double s) noexcept {
    const double u = s - c.since;
    if (!(u > 0)) return;
    double spring_rate = 0;
    if (c.motion == PistonMotion::fills) {
        c.piston += c.rate * u;
        spring_rate = c.stiffness * c.rate;
    } else if (c.motion == PistonMotion::empties) {
        c.piston -= c.full_rate * u;
        spring_rate = c.stiffness * -c.full_rate;
    }
    if (c.motion == PistonMotion::follows) {
        c.piston = balanced_stroke(*c.description, c.return_pressure, c.valve.at(s));
    } else {
        c.excess += u * (rise(c, c.since) - spring_rate + c.bend * u);
    }
    c.since = s;
}

// The change that was foreseen.
inline void change_motion(PistonCourse& c) noexcept {
    const bool was_full = c.motion == PistonMotion::rests_full;
    const bool in_balance = c.next_motion == PistonMotion::follows;
    move_on(c, c.next);
    c.motion = c.next_motion;
    if (in_balance) {
        c.excess = 0;
        c.motion = motion_from_balance(c);
    } else if (c.motion == PistonMotion::rests_full) {
        c.piston = c.description->stroke;
        c.excess = std::max(c.valve.at(c.since) - c.return_pressure, 0.);
    } else if (c.motion == PistonMotion::rests_empty) {
        c.piston = 0;
        c.excess = std::min(c.valve.at(c.since) - c.description->preload_pressure, 0.);
    } else {
        c.excess = 0;
    }
    const bool is_full = c.motion == PistonMotion::rests_full;
    if (was_full && !is_full && c.filled_from == 0) {
        c.full_until = c.since;
        c.filled_from = not_in_step;
    } else if (is_full && !was_full && c.filled_from > 1) {
        c.filled_from = c.since > no_part_of_step ? c.since : 0;
    }
    foresee(c);
}

// min(1, pump flow/Σ demand).
inline double pump_share(std::span<const PistonCourse> pistons, double pump_flow) noexcept {
    if (!(pump_flow > 0)) return 1;
    double demand = 0;
    for (const PistonCourse& c : pistons) {
        if (c.motion == PistonMotion::fills) demand += c.flow;
    }
    return demand > pump_flow ? pump_flow / demand : 1;
}

// From the fraction s on, by those that fill then. One that follows and cannot at its new share fills from now on, and
// asks for a share as well: once round for each piston is enough.
inline void share_pump(std::span<PistonCourse> pistons, double pump_flow, double s, double& share) noexcept {
    for (std::size_t rounds = 0; rounds <= pistons.size(); ++rounds) {
        const double now = pump_share(pistons, pump_flow);
        if (now == share) return;
        share = now;
        for (PistonCourse& c : pistons) {
            const bool feels_it = c.motion == PistonMotion::fills || c.motion == PistonMotion::follows;
            if (feels_it) move_on(c, s);
            c.rate = c.full_rate * share;
            if (!feels_it) continue;
            if (c.excess == 0 && c.stiffness > 0) c.motion = motion_from_balance(c);
            foresee(c);
        }
    }
}

}  // namespace detail

// It is where it is at the end of the step as well: a parabola lies between the least and the largest of its ends and the
// value that both end tangents have half way.
inline bool stays_at_stop(const ActuationHydraulic& p, double return_pressure, double piston,
                          const StepValues& valve) noexcept {
    const double between = 2 * valve.middle - 0.5 * (valve.begin + valve.end);
    if (piston >= p.stroke)
        return valve.begin >= return_pressure && between >= return_pressure && valve.end >= return_pressure;
    if (piston <= 0)
        return valve.begin <= p.preload_pressure && between <= p.preload_pressure &&
               valve.end <= p.preload_pressure && p.preload_pressure < return_pressure;
    return false;
}

// A step of h with the flow `flow`, as if it had the pump for itself.
inline PistonCourse begin_piston(const ActuationHydraulic& p, double return_pressure, double flow, double h,
                                 double piston, const StepValues& valve) noexcept {
    PistonCourse c;
    c.description = &p;
    c.return_pressure = return_pressure;
    c.valve = valve;
    c.slope = 4 * valve.middle - 3 * valve.begin - valve.end;
    c.bend = 2 * (valve.begin - 2 * valve.middle + valve.end);
    c.stiffness = (return_pressure - p.preload_pressure) / p.stroke;
    c.flow = flow;
    c.full_rate = c.rate = p.stroke * flow / p.fill_volume * h;
    c.begin = c.piston = piston;
    const double balance = balanced_stroke(p, return_pressure, valve.begin);
    const double excess = valve.begin - spring_pressure(p, return_pressure, piston);
    // A spring that does not stiffen balances the valve everywhere or nowhere: then its next pressure decides.
    const bool falls = c.slope < 0 || (c.slope == 0 && c.bend < 0);
    if (piston < balance && (excess > 0 || !falls)) {
        c.motion = PistonMotion::fills;
        c.excess = std::max(excess, 0.);
    } else if (piston != balance) {
        c.motion = PistonMotion::empties;
        c.excess = std::min(excess, 0.);
    } else if (valve.begin > return_pressure) {
        c.motion = PistonMotion::rests_full;
        c.excess = excess;
    } else if (valve.begin < p.preload_pressure) {
        c.motion = PistonMotion::rests_empty;
        c.excess = excess;
    } else {
        c.motion = detail::motion_from_balance(c);
    }
    if (piston >= p.stroke) {
        c.filled_from = c.motion == PistonMotion::rests_full ? 0 : detail::not_in_step;
    }
    detail::foresee(c);
    return c;
}

// Pistons at one pump (pump_flow 0: as much as they ask for) through the step.
inline void advance_pistons(std::span<PistonCourse> pistons, double pump_flow) noexcept {
    // A parabola meets a spring line twice at most, and each stop: more changes than these are rounding.
    constexpr std::size_t changes_of_one = 8;
    double share = 1;
    detail::share_pump(pistons, pump_flow, 0, share);
    for (std::size_t left = changes_of_one * pistons.size(); left > 0; --left) {
        PistonCourse* first = nullptr;
        for (PistonCourse& c : pistons) {
            if (c.next <= 1 && (first == nullptr || c.next < first->next)) first = &c;
        }
        if (first == nullptr) break;
        detail::change_motion(*first);
        detail::share_pump(pistons, pump_flow, first->since, share);
    }
    for (PistonCourse& c : pistons) {
        detail::move_on(c, 1);
        c.piston = std::clamp(c.piston, 0., c.description->stroke);
    }
}

}  // namespace shiftrig::plant
