// Hydraulic actuation against closed forms and against a fine explicit integration of its equations.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "plant/laws/friction.h"
#include "plant/laws/heat.h"
#include "plant/laws/hydraulics.h"
#include "plant/laws/lag.h"

namespace shiftrig::plant {
namespace {

constexpr double bar = 1e5;

ActuationHydraulic reference_valve(bool piston) {
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
PistonStep begin_step(const ActuationHydraulic& p, const HydraulicOperator& op, double return_pressure,
                      HydraulicState& state, std::span<double> delay_line, double command,
                      bool valve_held = false) {
    const ValveTargets targets = latch_command(p, op, state, delay_line, command);
    const ValveBefore before{state, targets};
    const StepValues valve = valve_over_step(p, op, state, targets, valve_held);
    return {begin_piston(p, return_pressure, op.fill_flow, op.h, state.piston, valve), before};
}
// ... then all pistons.
void advance(std::vector<PistonStep>& steps, const HydraulicOperator& op, double pump_flow) {
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
HydraulicStep advance_hydraulics(const ActuationHydraulic& p, const HydraulicOperator& op,
                                 double return_pressure, HydraulicState& state, std::span<double> delay_line,
                                 double command, double pump_flow = 0, bool valve_held = false) {
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
bool fills(const HydraulicStep& step) {
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

// The command of the tests: steps up, part down, as a controller with 10 ms cycle would send.
double command_at(double t) {
    return t < 0.02 ? 0 : t < 0.09 ? 11 * bar : t < 0.13 ? 6 * bar : 0;
}

// Brute force: the equations at 1 µs, the command held over steps of h as the rig holds it.
std::vector<double> brute_force(const ActuationHydraulic& p, double dead_time, double omega, double h,
                                double until) {
    std::vector<double> samples;
    const double dt = 1e-6;
    double r = 0, x = 0, v = 0;
    const auto steps = static_cast<long>(std::lround(until / dt)),
               per = static_cast<long>(std::lround(h / 2 / dt));
    const auto held = [&](double t) { return t < 0 ? 0 : command_at(h * std::floor(t / h + 1e-9)); };
    for (long i = 0; i < steps; ++i) {
        if (i % per == 0) samples.push_back(x);
        const double target = held((static_cast<double>(i) + 0.5) * dt - dead_time);
        const double next = r + std::clamp(target - r, -p.slew * dt, p.slew * dt);
        const double middle = 0.5 * (r + next);
        const auto acceleration = [&](double px, double pv) {
            return omega * omega * (middle - px) - 2 * p.damping_ratio * omega * pv;
        };
        const double xm = x + 0.5 * dt * v, vm = v + 0.5 * dt * acceleration(x, v);
        x += dt * vm;
        v += dt * acceleration(xm, vm);
        r = next;
    }
    return samples;
}

class ValveAgainstBruteForce : public testing::TestWithParam<std::pair<double, double>> {};

TEST_P(ValveAgainstBruteForce, StartMiddleAndEndOfEveryStepAgree) {
    const auto [h, damping] = GetParam();
    ActuationHydraulic p = reference_valve(false);
    p.damping_ratio = damping;
    p.dead_time = 0.0153;  // not a multiple of any step
    Rig rig(p, h);
    const std::vector<double> reference = brute_force(p, p.dead_time, 60, h, 0.3);
    double worst = 0;
    for (std::size_t n = 0; 2 * n + 2 < reference.size(); ++n) {
        const HydraulicStep step = rig.step(command_at(h * static_cast<double>(n) + 1e-9));
        worst = std::max({worst, std::fabs(step.valve.begin - reference[2 * n]),
                          std::fabs(step.valve.middle - reference[2 * n + 1]),
                          std::fabs(step.valve.end - reference[2 * n + 2])});
    }
    // The brute force itself: a slew edge off by up to half of its 1 µs step, 75 Pa, at 150 bar/s.
    EXPECT_LT(worst, 100);
}

INSTANTIATE_TEST_SUITE_P(StepsAndDamping, ValveAgainstBruteForce,
                         testing::Values(std::pair{1e-3, 0.8}, std::pair{1e-4, 0.8}, std::pair{2e-3, 0.8},
                                         std::pair{1e-3, 1.0}, std::pair{1e-3, 1.7}));

TEST(Valve, StepResponseIsTheClosedForm) {
    ActuationHydraulic p = reference_valve(false);
    p.dead_time = 0;
    p.slew = 0;  // unlimited
    Rig rig(p, 1e-3);
    const double wd = 60 * std::sqrt(1 - 0.64);
    for (int n = 1; n <= 200; ++n) {
        const HydraulicStep step = rig.step(10 * bar);
        const double t = 1e-3 * n;
        const double exact =
            10 * bar * (1 - std::exp(-48 * t) * (std::cos(wd * t) + 48 / wd * std::sin(wd * t)));
        ASSERT_NEAR(step.valve.end, exact, 1e-6) << n;
    }
}

TEST(Valve, ColdOilDelaysFourTimesAndSlowsTheValve) {
    Oil oil;
    oil.viscosity_at_zero = 0.5;
    oil.viscosity_decay = 0.0414;
    const ActuationHydraulic p = reference_valve(false);
    const auto first_move = [&](double temperature) {
        Rig rig(p, 1e-3, oil_effects(oil, temperature));
        for (int n = 0; n < 200; ++n) {
            if (rig.step(10 * bar).valve.end > 1) return n;
        }
        return -1;
    };
    EXPECT_EQ(first_move(90), 15);
    EXPECT_EQ(first_move(-10), 60);
    EXPECT_NEAR(hydraulic_operator(p, oil_effects(oil, -10), 1e-3).omega, 24, 1e-12);
}

TEST(Valve, StuckValveKeepsItsPressure) {
    Rig rig(reference_valve(false), 1e-3, {}, 9 * bar);
    for (int n = 0; n < 100; ++n) {
        const HydraulicStep step =
            advance_hydraulics(rig.p, rig.op, p_return, rig.state, rig.line, 0, 0, true);
        ASSERT_EQ(step.valve.end, 9 * bar);
    }
    for (int n = 0; n < 300; ++n) rig.step(0);
    EXPECT_NEAR(rig.state.valve, 0, 100) << "and lets go when it is freed";
}

TEST(Valve, CommandIsLimitedToTheSupply) {
    Rig rig(reference_valve(false), 1e-3);
    for (int n = 0; n < 1000; ++n) rig.step(99 * bar);
    EXPECT_NEAR(rig.state.valve, 18 * bar, 1e-3);
    for (int n = 0; n < 1000; ++n) rig.step(-5 * bar);
    EXPECT_NEAR(rig.state.valve, 0, 1e-3);
}

// Dropped from full pressure, r falls at the slew rate s, p lags by 2ζs/ω and swings through: ṗ is the step response
// −s(1 − …), and where it vanishes p = −(s/ω) exp(−ζ(π − acos ζ)/√(1 − ζ²)). The gauge shows 0.09 bar of suction; above
// absolute zero that is possible, and neither plates nor piston feel it.
TEST(Valve, SuctionAfterADropIsThatOfTheClosedFormAndMovesNothing) {
    Rig rig(reference_valve(true), 1e-3, {}, 18 * bar);
    double least = 0;
    for (int n = 0; n < 500; ++n) {
        const HydraulicStep step = rig.step(0);
        for (const double p : {step.valve.middle, step.valve.end}) least = std::min(least, p);
        if (step.valve.begin < 0.8 * bar && step.valve.end < 0.8 * bar) {
            EXPECT_EQ(balanced_stroke(rig.p, p_return, step.valve.end), 0);
            EXPECT_LT(step.chamber(0.5), p_return) << "the plates are apart";
        }
    }
    const double zeta = 0.8;
    const double closed =
        -150 * bar / 60 * std::exp(-zeta * (std::acos(-1.0) - std::acos(zeta)) / std::sqrt(1 - zeta * zeta));
    EXPECT_NEAR(least, closed, 1e-2 * std::fabs(closed));  // the lag has been there for 7.2/ω
    EXPECT_GT(least, -0.1 * bar);
    FrictionLaw law;
    law.return_pressure = p_return;
    law.load_per_pascal = 1e-3;
    EXPECT_EQ(load_from_pressure(law, least), 0);
    EXPECT_NEAR(rig.state.valve, 0, 0.1) << "and it goes away";
}

// Filling ------------------------------------------------------------------------------------------------

double fill_time(double h, double share) {
    Rig rig(reference_valve(true), h);
    double started = -1;
    for (int n = 0; n < 100000; ++n) {
        const double before = rig.state.piston;
        const HydraulicStep step = rig.step(5 * bar, share * rig.op.fill_flow);
        const double t = h * n;
        if (started < 0 && rig.state.piston > before)
            started = t + h * (1 - (rig.state.piston - before) / (2e-3 / 0.09 * share * h));
        if (fills(step)) return t + h * step.filled_from - started;
    }
    return -1;
}

TEST(Piston, FillsInNinetyMillisecondsWhateverTheStep) {
    EXPECT_NEAR(fill_time(1e-3, 1), 0.09, 1e-9);
    EXPECT_NEAR(fill_time(1e-4, 1), 0.09, 1e-9);
    EXPECT_NEAR(fill_time(3.7e-4, 0.5), 0.18, 1e-9);
}

TEST(Piston, ChamberFollowsTheSpringLineAndJumpsAtTheKissPoint) {
    Rig rig(reference_valve(true), 1e-3);
    bool jumped = false;
    for (int n = 0; n < 300 && !jumped; ++n) {
        const HydraulicStep step = rig.step(5 * bar);
        jumped = fills(step);
        if (!jumped) {
            EXPECT_LE(step.chamber(1), p_return + 1e-6);
            EXPECT_NEAR(step.chamber(1), rig.state.chamber, 1e-6);
        } else {
            EXPECT_LE(step.chamber(step.filled_from - 1e-9), p_return + 1e-6);
            EXPECT_GT(step.chamber(step.filled_from), 4 * bar);
            EXPECT_NEAR(step.chamber(1), rig.state.valve, 1e-6);
        }
    }
    EXPECT_TRUE(jumped);
    const HydraulicStep after = rig.step(5 * bar);
    EXPECT_FALSE(fills(after));
    EXPECT_NEAR(after.chamber(0.5), after.valve.middle, 1e-6);
}

TEST(Piston, RestsWhereTheSpringBalancesAPartialPressure) {
    Rig rig(reference_valve(true), 1e-3);
    for (int n = 0; n < 1000; ++n) rig.step(1.0 * bar);
    EXPECT_NEAR(rig.state.piston, 1e-3, 1e-9);
    EXPECT_NEAR(rig.state.chamber, 1.0 * bar, 1e-3);
    for (int n = 0; n < 1000; ++n) rig.step(0);
    EXPECT_EQ(rig.state.piston, 0);
    EXPECT_NEAR(rig.state.chamber, 0, 1e-3);
}

// On a spring of no stiffness every place balances the return pressure: the pressure rests while the piston moves.
TEST(Piston, IsNotQuietWhileItMoves) {
    ActuationHydraulic p = reference_valve(true);
    p.preload_pressure = p_return;
    Rig rig(p, 1e-3, {}, p_return);
    rig.state.piston = 0;
    const std::size_t slots = rig.line.size();
    EXPECT_FALSE(is_quiet(p, p_return, rig.state, slots, p_return));
    rig.state.piston = p.stroke;
    EXPECT_TRUE(is_quiet(p, p_return, rig.state, slots, p_return));
}

TEST(Piston, EmptiesBeforeItCanFillAgain) {
    Rig rig(reference_valve(true), 1e-3, {}, 12 * bar);
    EXPECT_EQ(rig.state.piston, 2e-3);
    for (int n = 0; n < 140; ++n) rig.step(0);
    EXPECT_GT(rig.state.piston, 0);
    EXPECT_LT(rig.state.piston, 2e-3) << "half empty: a quick re-engagement needs less fill";
    EXPECT_NEAR(rig.state.chamber, spring_pressure(rig.p, p_return, rig.state.piston), 1e-6);
}

TEST(Piston, AsksThePumpOnlyWhileFilling) {
    Rig rig(reference_valve(true), 1e-3);
    const auto asks = [&] {
        const StepValues valve{rig.state.valve, rig.state.valve, rig.state.valve};
        const PistonCourse course =
            begin_piston(rig.p, p_return, rig.op.fill_flow, 1e-3, rig.state.piston, valve);
        return detail::pump_share({&course, 1}, 1e-12) < 1;
    };
    EXPECT_FALSE(asks());
    for (int n = 0; n < 60; ++n) rig.step(5 * bar);
    EXPECT_TRUE(asks());
    for (int n = 0; n < 300; ++n) rig.step(5 * bar);
    EXPECT_FALSE(asks());
    for (int n = 0; n < 100; ++n) rig.step(0);
    EXPECT_GT(rig.state.piston, 0);
    EXPECT_FALSE(asks()) << "emptying";
}

// Times at which pistons fill ----------------------------------------------------------------------------------

// Pressures told to one piston from times that are whole milliseconds.
struct Told {
    double pressure = 0;  // before
    std::vector<std::pair<double, double>> later;
    double at(double t) const {
        double now = pressure;
        for (const auto& [from, value] : later) {
            if (t > from - 1e-9) now = value;
        }
        return now;
    }
};

struct Course {
    std::vector<Told> pistons;
    double pump_flow = 0;  // [m³/s], 0: unlimited
    double dead_time = 0.015;
    double until = 0.6;
    double natural_frequency = 60, slew = 150 * bar;
};

ActuationHydraulic valve_of(const Course& course, bool piston) {
    ActuationHydraulic p = reference_valve(piston);
    p.dead_time = course.dead_time;
    p.natural_frequency = course.natural_frequency;
    p.slew = course.slew;
    return p;
}

constexpr double litres_per_minute = 1e-3 / 60;

// When pistons arrive at full stroke, piston by piston.
std::vector<double> filled_at(const Course& course, double h) {
    const ActuationHydraulic p = valve_of(course, true);
    std::vector<Rig> rigs;
    for (const Told& told : course.pistons) rigs.emplace_back(p, h, OilEffects{}, told.pressure);
    std::vector<std::vector<double>> times(rigs.size());
    const long steps = std::lround(course.until / h);
    for (long n = 0; n < steps; ++n) {
        const double t = h * static_cast<double>(n);
        std::vector<PistonStep> pistons;
        for (std::size_t k = 0; k < rigs.size(); ++k) {
            Rig& rig = rigs[k];
            pistons.push_back(begin_step(p, rig.op, p_return, rig.state, rig.line, course.pistons[k].at(t)));
        }
        advance(pistons, rigs[0].op, course.pump_flow);
        for (std::size_t k = 0; k < rigs.size(); ++k) {
            const HydraulicStep step = end_step(pistons[k].course, rigs[k].state);
            if (fills(step)) times[k].push_back(t + h * step.filled_from);
        }
    }
    std::vector<double> all;
    for (const auto& list : times) all.insert(all.end(), list.begin(), list.end());
    return all;
}

// The same by brute force: the valve alone, which is exact, looked at every 2 µs; pistons by what they do now.
std::vector<double> filled_by_brute_force(const Course& course) {
    const double h = 2e-6;
    const ActuationHydraulic p = valve_of(course, false), with = valve_of(course, true);
    std::vector<Rig> valves;
    std::vector<double> x;
    for (const Told& told : course.pistons) {
        valves.emplace_back(p, h, OilEffects{}, told.pressure);
        x.push_back(balanced_stroke(with, p_return, told.pressure));
    }
    std::vector<std::vector<double>> times(valves.size());
    const double most = with.stroke * with.fill_flow / with.fill_volume * h;
    const long steps = std::lround(course.until / h);
    for (long n = 0; n < steps; ++n) {
        const double t = h * static_cast<double>(n);
        double demand = 0;
        for (std::size_t k = 0; k < x.size(); ++k) {
            if (x[k] < balanced_stroke(with, p_return, valves[k].state.valve)) demand += with.fill_flow;
        }
        const double share =
            course.pump_flow > 0 && demand > course.pump_flow ? course.pump_flow / demand : 1;
        for (std::size_t k = 0; k < x.size(); ++k) {
            valves[k].step(course.pistons[k].at(t));
            const double before = x[k], goal = balanced_stroke(with, p_return, valves[k].state.valve);
            x[k] = std::clamp(goal, before - most, before + most * share);
            if (before < with.stroke && x[k] >= with.stroke) times[k].push_back(t + h);
        }
    }
    std::vector<double> all;
    for (const auto& list : times) all.insert(all.end(), list.begin(), list.end());
    return all;
}

struct FillCase {
    const char* name;
    std::vector<Course> courses;
};

// Dead times that are no whole number of steps put what happens anywhere within a step.
std::vector<FillCase> fill_cases() {
    const double full = 12 * bar, pump = 30 * litres_per_minute;
    std::vector<FillCase> cases = {{"first fill", {}},
                                   {"filled again before it is empty", {}},
                                   {"filled again while another fills", {}},
                                   {"two at one pump", {}},
                                   {"turned back while it fills", {}},
                                   {"left full stroke for a moment", {}}};
    for (int i = 0; i < 12; ++i) {
        const double dead_time = 0.015 + 0.83e-4 * i, ms = 1e-3;
        const double back = ms * (118 + 13 * (i % 5)), again = back + ms * (45 + 7 * i);
        const auto add = [&](std::size_t k, std::vector<Told> pistons, double flow) {
            cases[k].courses.push_back({std::move(pistons), flow, dead_time});
        };
        add(0, {{0, {{10 * ms, full}}}}, 0);
        add(1, {{0, {{10 * ms, full}, {back, 0}, {again, 0.7 * full}}}}, 0);
        add(2, {{0, {{60 * ms, full}}}, {10 * bar, {{10 * ms, 0}, {ms * (88 + 3 * i), full}}}}, pump);
        add(3, {{0, {{10 * ms, full}}}, {0, {{ms * (15 + 6 * i), full}}}}, pump);
        add(4, {{0, {{10 * ms, full}, {ms * (30 + i), 0.85 * bar}, {ms * (85 + 2 * i), full}}}}, 0);
        add(5, {{3 * bar, {{10 * ms, 0.6 * bar}, {ms * (49 + i), 3 * bar}}}}, 0);
    }
    return cases;
}

double worst_difference(const std::vector<double>& a, const std::vector<double>& b) {
    EXPECT_EQ(a.size(), b.size());
    double worst = 0;
    for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
        worst = std::max(worst, std::fabs(a[i] - b[i]));
    return worst;
}

// It looks every 2 µs, at the beginning of what ends at the arrival as well: 2.9 µs were seen.
TEST(FillTime, IsThatOfBruteForce) {
    for (const FillCase& fills : fill_cases()) {
        for (const Course& course : fills.courses) {
            const std::vector<double> reference = filled_by_brute_force(course);
            EXPECT_FALSE(reference.empty()) << fills.name;
            EXPECT_LT(worst_difference(filled_at(course, 1e-3), reference), 5e-6) << fills.name;
            EXPECT_LT(worst_difference(filled_at(course, 5e-4), reference), 5e-6) << fills.name;
        }
    }
}

// Where a piston that stands half way falls behind is where its valve has gathered speed: with one parabola over 1 ms it would
// arrive up to 29 µs off.
TEST(FillTime, OfFastValvesIsThatOfBruteForce) {
    std::vector<FillCase> cases = fill_cases();
    cases.push_back({"on from half way", {}});
    for (int i = 0; i < 12; ++i)
        cases.back().courses.push_back({{{0.9 * bar, {{10e-3, 12 * bar}}}}, 0, 0.015 + 0.83e-4 * i});
    for (FillCase& fills : cases) {
        for (Course& course : fills.courses) {
            course.natural_frequency = 150;
            course.slew = 800 * bar;
            const std::vector<double> reference = filled_by_brute_force(course);
            EXPECT_FALSE(reference.empty()) << fills.name;
            EXPECT_LT(worst_difference(filled_at(course, 1e-3), reference), 5e-6) << fills.name;
        }
    }
}

// The parabola makes errors of third order, the worst of them 0.3 µs at 1 ms. Which courses are worst changes from step to
// step, so orders are taken over three halvings: second order would be 64, third 512, 250 was seen.
TEST(FillTime, IsOfSecondOrderInTheStepOrBetter) {
    for (const FillCase& fills : fill_cases()) {
        double coarse = 0, fine = 0;
        for (const Course& course : fills.courses) {
            const std::vector<double> reference = filled_at(course, 1e-5);
            coarse = std::max(coarse, worst_difference(filled_at(course, 1e-3), reference));
            fine = std::max(fine, worst_difference(filled_at(course, 1.25e-4), reference));
        }
        EXPECT_LT(coarse, 1e-6) << fills.name;
        EXPECT_LT(fine, coarse / 64) << fills.name;
    }
}

StepValues parabola(double level, double bend, double first, double second) {
    const auto at = [&](double s) { return level + bend * (s - first) * (s - second); };
    return {at(0), at(0.5), at(1)};
}

// On a spring without stiffness a piston moves at its full rate wherever the valve is not at the return pressure.
TEST(Piston, TurnsWithTheValveWithinAStep) {
    ActuationHydraulic p = reference_valve(true);
    p.preload_pressure = p_return;
    const double h = 1e-3, rate = p.stroke * h / 0.09;
    PistonCourse course = begin_piston(p, p_return, p.fill_flow, h, 1e-3, parabola(p_return, bar, 0.3, 0.7));
    advance_pistons({&course, 1}, 0);
    EXPECT_NEAR(course.piston, 1e-3 + (0.3 - 0.4 + 0.3) * rate, 1e-15);
    course = begin_piston(p, p_return, p.fill_flow, h, 1e-3, parabola(p_return, -bar, 0.3, 0.7));
    advance_pistons({&course, 1}, 0);
    EXPECT_NEAR(course.piston, 1e-3 + (-0.3 + 0.4 - 0.3) * rate, 1e-15);
}

// A spring that does not stiffen, and a valve that is just falling through its pressure: the piston goes back, by 40 µm of 1 mm.
TEST(Piston, OnASpringOfOnePressureFollowsTheValvesNextOne) {
    ActuationHydraulic p;
    p.stroke = 2e-3;
    p.fill_volume = 2e-5;
    p.fill_flow = 4e-4;
    p.preload_pressure = 1.2e5;
    for (const double fall : {1., -1.}) {
        const StepValues valve{1.2e5, 1.2e5 - fall * 2e4, 1.2e5 - fall * 4e4};
        PistonCourse course = begin_piston(p, 1.2e5, p.fill_flow, 1e-3, 1e-3, valve);
        advance_pistons({&course, 1}, 0);
        EXPECT_NEAR(course.piston, 1e-3 - fall * 4e-5, 1e-12) << fall;
    }
}

TEST(Piston, ThatLeavesFullStrokeWithinAStepPressesAgainWhenItIsBack) {
    ActuationHydraulic p = reference_valve(true);
    p.preload_pressure = p_return;
    const StepValues valve = parabola(p_return, bar, 0.3, 0.5);
    PistonCourse course = begin_piston(p, p_return, p.fill_flow, 1e-3, p.stroke, valve);
    advance_pistons({&course, 1}, 0);
    EXPECT_EQ(course.piston, p.stroke);
    HydraulicState state;
    state.valve = valve.end;
    const HydraulicStep step = end_step(course, state);
    EXPECT_NEAR(step.full_until, 0.3, 1e-9);
    EXPECT_NEAR(step.filled_from, 0.7, 1e-9);
    EXPECT_EQ(step.chamber(0.2), valve.at(0.2));
    EXPECT_LE(step.chamber(0.6), p_return);
    EXPECT_EQ(step.chamber(0.8), valve.at(0.8));
    EXPECT_EQ(state.chamber, valve.end);
}

// One from empty, one from half way, at a pump with what one of them asks for: the second arrives after V/Q, when the
// first is half way and has the pump for itself.
TEST(Piston, OneOfTwoThatArrivesLeavesThePumpToTheOther) {
    const ActuationHydraulic p = reference_valve(true);
    const double h = 7e-4;
    const StepValues valve{5 * bar, 5 * bar, 5 * bar};
    double x[2] = {0, 0.5 * p.stroke}, arrived[2] = {};
    for (int n = 0; n < 300; ++n) {
        PistonCourse pistons[2];
        for (int k = 0; k < 2; ++k) pistons[k] = begin_piston(p, p_return, p.fill_flow, h, x[k], valve);
        advance_pistons(pistons, p.fill_flow);
        for (int k = 0; k < 2; ++k) {
            x[k] = pistons[k].piston;
            if (pistons[k].filled_from > 0 && pistons[k].filled_from <= 1)
                arrived[k] = h * (n + pistons[k].filled_from);
        }
    }
    EXPECT_NEAR(arrived[1], 0.09, 1e-13);
    EXPECT_NEAR(arrived[0], 0.135, 1e-13);
}

TEST(Piston, EmptiesNoSlowerWhileOthersFill) {
    const ActuationHydraulic p = reference_valve(true);
    const double h = 1e-3;
    PistonCourse pistons[2] = {begin_piston(p, p_return, p.fill_flow, h, p.stroke, {0, 0, 0}),
                               begin_piston(p, p_return, p.fill_flow, h, 0, {5 * bar, 5 * bar, 5 * bar})};
    advance_pistons(pistons, 0.5 * p.fill_flow);
    EXPECT_NEAR(pistons[0].piston, p.stroke * (1 - h / 0.09), 1e-15);
    EXPECT_NEAR(pistons[1].piston, 0.5 * p.stroke * h / 0.09, 1e-15);
}

TEST(Solenoid, HysteresisSeparatesRisingAndFallingCurrent) {
    Solenoid s;
    s.pressure_over_current = {{0.2, 0}, {1.0, 16 * bar}};
    s.hysteresis = 0.04;
    double play = 0.2;
    solenoid_pressure(s, play, 0.2);
    const double rising = solenoid_pressure(s, play, 0.6);
    EXPECT_NEAR(rising, 16 * bar * (0.58 - 0.2) / 0.8, 1e-6);
    EXPECT_EQ(solenoid_pressure(s, play, 0.57), rising) << "inside the band nothing moves";
    solenoid_pressure(s, play, 0.9);
    EXPECT_NEAR(solenoid_pressure(s, play, 0.6), 16 * bar * (0.62 - 0.2) / 0.8, 1e-6);
}

// Pedal lags and facing heat ---------------------------------------------------------------------------------

TEST(Lag, IsExactForAHeldCommandAndLimitsIt) {
    const LagOperator op = lag_operator(0.08, 1e-3);
    double y = 0.2;
    const StepValues values = advance_lag(op, y, 7);
    EXPECT_EQ(values.begin, 0.2);
    EXPECT_NEAR(values.middle, 1 - 0.8 * std::exp(-0.5e-3 / 0.08), 1e-15);
    EXPECT_NEAR(y, 1 - 0.8 * std::exp(-1e-3 / 0.08), 1e-15);
    EXPECT_NEAR(values.at(0.25), 1 - 0.8 * std::exp(-0.25e-3 / 0.08), 2e-8);
    const LagOperator none = lag_operator(0, 1e-3);
    EXPECT_EQ(advance_lag(none, y, 0.3).begin, 0.3);
}

FacingHeat reference_heat() {
    FacingHeat p;
    p.surface_capacity = 120;
    p.bulk_capacity = 1400;
    p.surface_to_bulk = 400;
    p.bulk_to_oil = 120;
    return p;
}

TEST(Heat, SettlesAtTheConductances) {
    const HeatOperator op = heat_operator(reference_heat(), 0.1);
    HeatState state{90, 90};
    for (int n = 0; n < 5000; ++n) advance_heat(op, state, 1200, 90);
    EXPECT_NEAR(state.bulk, 90 + 1200. / 120, 1e-9);
    EXPECT_NEAR(state.surface, state.bulk + 1200. / 400, 1e-9);
}

TEST(Heat, OneLongStepEqualsManyShortOnes) {
    const HeatOperator once = heat_operator(reference_heat(), 1.0),
                       often = heat_operator(reference_heat(), 1e-3);
    HeatState a{90, 90}, b = a;
    advance_heat(once, a, 50e3, 80);
    for (int n = 0; n < 1000; ++n) advance_heat(often, b, 50e3, 80);
    EXPECT_NEAR(a.surface, b.surface, 1e-9);
    EXPECT_NEAR(a.bulk, b.bulk, 1e-9);
    // Energy: what went in is stored or went to the oil (checked by one step small against the flow).
    HeatState c{90, 90};
    advance_heat(often, c, 50e3, 90);
    EXPECT_NEAR(120 * (c.surface - 90) + 1400 * (c.bulk - 90), 50, 1e-3);
}

TEST(Heat, WithoutConductancesHeatStays) {
    FacingHeat p = reference_heat();
    p.surface_to_bulk = p.bulk_to_oil = 0;
    const HeatOperator op = heat_operator(p, 0.5);
    HeatState state{20, 20};
    advance_heat(op, state, 240, 90);
    EXPECT_NEAR(state.surface, 21, 1e-12);
    EXPECT_NEAR(state.bulk, 20, 1e-12);
}

}  // namespace
}  // namespace shiftrig::plant
