// Hydraulic actuation against closed forms and against a fine explicit integration of its equations.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "plant/laws/friction.h"
#include "tests/plant/hydraulic_rig.h"

namespace shiftrig::plant {
namespace {

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

}  // namespace
}  // namespace shiftrig::plant
