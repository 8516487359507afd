// When pistons are full, against brute force: alone, again before they are empty, two at one pump, turned back.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "tests/plant/hydraulic_rig.h"

namespace shiftrig::plant {
namespace {

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

}  // namespace
}  // namespace shiftrig::plant
