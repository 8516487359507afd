// The piston of a wet clutch over one step: when it fills, turns back, empties.
//
//     spring      p_s(x) = preload + (p_return − preload) x/stroke, preload ≤ p_return
//     balance     x_eq: p_s(x_eq) = p, within 0…stroke
//     piston      x follows x_eq, filling at no more than stroke · Q s/V, emptying at no more than stroke · Q/V
//     pump        s = min(1, pump flow/Σ Q of the pistons that fill)
//
//   x     piston stroke (state)                     m; capacity begins at full stroke, the kiss point
//   p     valve outlet pressure                     Pa, over a part of a step the parabola through its beginning, middle and end
//   Q     flow into the piston                      m³/s: fill_flow by oil viscosity
//   V     fill volume                               m³
//   s     share of what they ask for that the pump gives to the pistons that fill   1
//
// A piston fills while its spring is behind the valve (p > p_s), empties while the valve is behind the spring, and stands
// at its stops. Where they balance it follows, as long as that takes no more than its flow; what follows asks the pump for
// nothing. Between two changes of such motions, of any piston at the pump, s is constant, p_s linear in time and p a
// parabola: the next change is the root of a linear or quadratic equation, and pistons at one pump go from change to
// change together. The times of changes are therefore as good as the parabola, of third order where p crosses p_s, of
// second where a piston begins to stay behind. One parabola over 1 ms of a valve of 150 rad/s on a slope of 800 bar/s is off by
// 60 Pa, and a piston then by up to 0.1 ms: a step in which a motion may change while its valve moves is taken in
// piston_parts parts.
// Emptying takes nothing from the pump and is not slowed by what others take.
// Does not model: leakage, compressibility, a different flow out of the piston than into it, a pump that gives one piston
// more than another.
#pragma once

#include <algorithm>
#include <array>
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

// Parts of a step in which a valve moves, and p at their ends and middles.
constexpr int piston_parts = 8;
using ValveSamples = std::array<double, 2 * piston_parts + 1>;

// A piston on its way through a step. Fractions and rates are of the part of the step that it is in, but for those told.
struct PistonCourse {
    const ActuationHydraulic* description = nullptr;
    double return_pressure = 0;  // [Pa]
    StepValues valve;            // p over the step [Pa]
    bool is_sampled = false;
    ValveSamples samples{};     // p [Pa], if it is
    double stiffness = 0;       // dp_s/dx [Pa/m]
    double flow = 0;            // Q [m³/s]
    double rate_over_step = 0;  // |dx| in a step at Q [m]
    double begin = 0;           // x at the beginning of the step [m]

    double from = 0, length = 1;     // the part, in fractions of the step
    StepValues pressure;             // p over the part [Pa]
    double slope = 0, bend = 0;      // p = p_begin + slope s + bend s² [Pa]
    double full_rate = 0, rate = 0;  // |dx| at Q, and filling at its share of the pump [m]

    double since = 0;   // from here its motion is what it is, and so is the share
    double piston = 0;  // x there [m]
    double excess = 0;  // p − p_s there, 0 where it is in balance [Pa]
    PistonMotion motion = PistonMotion::rests_empty, next_motion = PistonMotion::rests_empty;
    double next = 2;  // where its motion changes unless the share does before; > 1: not in this part

    // Of the step: it is at full stroke from the beginning until here, and from here on; > 1: not in this step.
    double full_until = 0, filled_from = 2;
};

namespace detail {

constexpr double not_in_step = 2;         // nor in this part of it
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
            const double p = c.pressure.at(c.since), up = c.stiffness * c.rate,
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
        c.piston = balanced_stroke(*c.description, c.return_pressure, c.pressure.at(s));
    } else {
        c.excess += u * (rise(c, c.since) - spring_rate + c.bend * u);
    }
    c.since = s;
}

// It was at full stroke until now, or is from now on.
inline void note_full(PistonCourse& c, bool was_full) noexcept {
    const bool is_full = c.motion == PistonMotion::rests_full;
    const double now = c.from + c.length * c.since;
    if (was_full && !is_full && c.filled_from == 0) {
        c.full_until = now;
        c.filled_from = not_in_step;
    } else if (is_full && !was_full && c.filled_from > 1) {
        c.filled_from = now > no_part_of_step ? now : 0;
    }
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
        c.excess = std::max(c.pressure.at(c.since) - c.return_pressure, 0.);
    } else if (c.motion == PistonMotion::rests_empty) {
        c.piston = 0;
        c.excess = std::min(c.pressure.at(c.since) - c.description->preload_pressure, 0.);
    } else {
        c.excess = 0;
    }
    note_full(c, was_full);
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

// As if it had the pump for itself. x is where the last part left it.
inline void begin_part(PistonCourse& c, int part, int parts) noexcept {
    const ActuationHydraulic& p = *c.description;
    const double return_pressure = c.return_pressure;
    c.length = 1. / parts;
    c.from = part * c.length;
    if (parts == 1) {
        c.pressure = c.valve;
    } else if (c.is_sampled) {
        const auto i = 2 * static_cast<std::size_t>(part);
        c.pressure = {c.samples[i], c.samples[i + 1], c.samples[i + 2]};
    } else {
        c.pressure = {c.valve.begin, c.valve.begin, c.valve.begin};
    }
    const StepValues& valve = c.pressure;
    c.slope = 4 * valve.middle - 3 * valve.begin - valve.end;
    c.bend = 2 * (valve.begin - 2 * valve.middle + valve.end);
    c.full_rate = c.rate = c.rate_over_step * c.length;
    c.since = 0;
    const bool was_full = part > 0 && c.motion == PistonMotion::rests_full;
    const double balance = balanced_stroke(p, return_pressure, valve.begin);
    const double excess = valve.begin - spring_pressure(p, return_pressure, c.piston);
    c.excess = 0;
    // A spring that does not stiffen balances the valve everywhere or nowhere: then its next pressure decides.
    const bool falls = c.slope < 0 || (c.slope == 0 && c.bend < 0);
    if (c.piston < balance && (excess > 0 || !falls)) {
        c.motion = PistonMotion::fills;
        c.excess = std::max(excess, 0.);
    } else if (c.piston != balance) {
        c.motion = PistonMotion::empties;
        c.excess = std::min(excess, 0.);
    } else if (valve.begin > return_pressure) {
        c.motion = PistonMotion::rests_full;
        c.excess = excess;
    } else if (valve.begin < p.preload_pressure) {
        c.motion = PistonMotion::rests_empty;
        c.excess = excess;
    } else {
        c.motion = motion_from_balance(c);
    }
    if (part > 0) {
        note_full(c, was_full);
    } else if (c.piston >= p.stroke) {
        c.filled_from = c.motion == PistonMotion::rests_full ? 0 : not_in_step;
    }
    foresee(c);
}

// Pistons at one pump through a part that they have begun.
inline void advance_part(std::span<PistonCourse> pistons, double pump_flow) noexcept {
    // A parabola meets a spring line twice at most, and each stop: more changes than these are rounding.
    constexpr std::size_t changes_of_one = 8;
    double share = 1;
    share_pump(pistons, pump_flow, 0, share);
    for (std::size_t left = changes_of_one * pistons.size(); left > 0; --left) {
        PistonCourse* first = nullptr;
        for (PistonCourse& c : pistons) {
            if (c.next <= 1 && (first == nullptr || c.next < first->next)) first = &c;
        }
        if (first == nullptr) break;
        change_motion(*first);
        share_pump(pistons, pump_flow, first->since, share);
    }
    for (PistonCourse& c : pistons) {
        move_on(c, 1);
        c.piston = std::clamp(c.piston, 0., c.description->stroke);
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
    c.stiffness = (return_pressure - p.preload_pressure) / p.stroke;
    c.flow = flow;
    c.rate_over_step = p.stroke * flow / p.fill_volume * h;
    c.begin = c.piston = piston;
    detail::begin_part(c, 0, 1);
    return c;
}

// Its motion lasts, whatever its share of the pump, or its valve stands still, so that the parabola says all: spring and valve are
// farther apart than the valve moves in the step.
inline bool needs_no_samples(const PistonCourse& c) noexcept {
    const StepValues& p = c.valve;
    const double between = 2 * p.middle - 0.5 * (p.begin + p.end);
    const auto [least, most] = std::minmax({p.begin, p.middle, p.end, between});
    const double moves = most - least;
    if (moves == 0) return true;
    const ActuationHydraulic& h = *c.description;
    const double up = c.piston + c.rate_over_step, down = c.piston - c.rate_over_step;
    if (c.motion == PistonMotion::fills)
        return up < h.stroke && least - moves > spring_pressure(h, c.return_pressure, up);
    if (c.motion == PistonMotion::empties)
        return down > 0 && most + moves < spring_pressure(h, c.return_pressure, down);
    return false;
}

// Pistons at one pump (pump_flow 0: as much as they ask for) through the step.
inline void advance_pistons(std::span<PistonCourse> pistons, double pump_flow) noexcept {
    const bool moves =
        std::any_of(pistons.begin(), pistons.end(), [](const PistonCourse& c) { return c.is_sampled; });
    if (!moves) return detail::advance_part(pistons, pump_flow);
    for (int part = 0; part < piston_parts; ++part) {
        for (PistonCourse& c : pistons) detail::begin_part(c, part, piston_parts);
        detail::advance_part(pistons, pump_flow);
    }
}

}  // namespace shiftrig::plant
