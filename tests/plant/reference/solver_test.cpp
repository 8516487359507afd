// The oracle's own proof: published curves and closed forms.
#include "tests/plant/reference/solver.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "tests/plant/reference/cases.h"
#include "tests/plant/reference/curves.h"

namespace shiftrig::reference {
namespace {

using Read = std::function<double(const Sample&)>;

double worst_difference(const Result& result, const std::vector<double>& curve, const Read& read) {
    EXPECT_EQ(result.samples.size(), curve.size());
    double worst = 0;
    for (std::size_t i = 0; i < curve.size(); ++i)
        worst = std::max(worst, std::abs(read(result.samples.at(i)) - curve[i]));
    return worst;
}

Result run(const plant::Description& description, double until, Options options = {}) {
    const System system(description);
    Solver solver(system);
    Result result = solver.run(until, options);
    EXPECT_FALSE(result.gave_up);
    EXPECT_EQ(result.unresolved, 0);
    return result;
}

double time_of(const Result& result, const std::string& device, const std::string& what, int nth = 1) {
    for (const auto& change : result.changes)
        if (change.device == device && change.what == what && --nth == 0) return change.time;
    ADD_FAILURE() << device << " never " << what;
    return 0;
}

Curves data(const char* name) {
    return read_curves(std::string(SHIFTRIG_DATA "/") + name);
}

// The curves were made with 2 µs steps, so that each break-away (a jump of 1 Nm on 1 kg m²) may be 1e-6 rad/s
// off. Published event times are those of another
// program's tolerance, 4 µs off the closed forms used here.
TEST(ReferenceSolver, FollowsCoupledClutches) {
    const Curves curves = data("CoupledClutches.csv");
    const Result result = run(cases::coupled_clutches(), 1.5);
    EXPECT_LT(worst_difference(result, curves["J1.w"], [](const Sample& s) { return s.z[0]; }), 2e-6);
    EXPECT_LT(
        worst_difference(result, curves["clutch1.w_rel"], [](const Sample& s) { return s.z[1] - s.z[0]; }),
        2e-6);
    EXPECT_LT(
        worst_difference(result, curves["clutch2.w_rel"], [](const Sample& s) { return s.z[2] - s.z[1]; }),
        2e-6);
    EXPECT_LT(
        worst_difference(result, curves["clutch3.w_rel"], [](const Sample& s) { return s.z[3] - s.z[2]; }),
        2e-6);
    EXPECT_NEAR(result.samples.back().z.head(4).sum(), 10 + 2 / std::numbers::pi, 1e-11);
    EXPECT_NEAR(time_of(result, "clutch2", "locks"), 0.7096215, 1e-7);
    // Until clutch 1 locks, ω1 = 10 + (1 − cos 10πt)/π − (25/π) sin 0.4πt and ω2 = ω3 = (12.5/π) sin 0.4πt.
    const double lock = time_of(result, "clutch1", "locks");
    const double pi = std::numbers::pi;
    EXPECT_NEAR(10 + (1 - std::cos(10 * pi * lock)) / pi - 37.5 / pi * std::sin(0.4 * pi * lock), 0, 1e-9);
    EXPECT_NEAR(time_of(result, "clutch1", "slips", 2), 0.8311085, 1e-7);  // the first slip is at the start
    EXPECT_NEAR(time_of(result, "clutch1", "locks", 2), 0.9068491, 4e-6);
    EXPECT_NEAR(time_of(result, "clutch1", "slips", 3), 1.0002959, 4e-6);
    EXPECT_NEAR(time_of(result, "clutch3", "locks"), 1.1439696, 4e-6);
    EXPECT_NEAR(time_of(result, "clutch1", "free"), 1.25, 1e-9);
}

TEST(ReferenceSolver, FollowsLossyGearDemo) {
    const Curves curves = data("LossyGearDemo1.csv");
    const Result result = run(cases::lossy_gear_demo(), 0.5);
    EXPECT_LT(worst_difference(result, curves["Inertia2.w"], [](const Sample& s) { return s.z[1]; }), 1e-8);
    EXPECT_NEAR(time_of(result, "gear", "mesh rests", 1), 0.0804771, 1e-7);
    EXPECT_NEAR(time_of(result, "gear", "mesh moves", 2), 0.1995199, 1e-7);
    EXPECT_NEAR(time_of(result, "gear", "mesh rests", 2), 0.3713427, 1e-7);
    EXPECT_NEAR(time_of(result, "gear", "mesh moves", 3), 0.4645395, 1e-7);
}

// The curves switch the torque of −52.5 Nm off half a step (1 µs) late, which leaves 5e-5 rad/s on J3
// from 0.5 s on and up to twice that on the clutch. Before, only their printed digits differ.
TEST(ReferenceSolver, FollowsFriction) {
    const Curves curves = data("Friction.csv");
    const Result result = run(cases::friction(), 3.0);
    EXPECT_LT(worst_difference(result, curves["inertia3.w"], [](const Sample& s) { return s.z[0]; }), 6e-5);
    EXPECT_LT(
        worst_difference(result, curves["clutch.w_rel"], [](const Sample& s) { return s.z[1] - s.z[0]; }),
        1.2e-4);
    EXPECT_LT(
        worst_difference(result, curves["spring.w_rel"], [](const Sample& s) { return s.z[2] - s.z[1]; }),
        1.2e-4);
    for (std::size_t i = 0; i < 500; ++i)
        ASSERT_NEAR(result.samples[i].z[0], curves["inertia3.w"][i], 6e-7) << i;
    EXPECT_NEAR(time_of(result, "clutch", "locks", 3), 1.6636398, 2e-6);
}

TEST(ReferenceSolver, ClosesTwoInertiasAtTheComputedInstant) {
    const Result result = run(cases::two_inertias(), 0.2);
    const double j1 = 2.6, j2 = 1.0, slip = 188.5;
    EXPECT_NEAR(time_of(result, "clutch", "locks"), slip / (1500 / j1 + 1500 / j2), 1e-11);
    EXPECT_NEAR(result.samples.back().z[0], j1 * slip / (j1 + j2), 1e-9);
    EXPECT_NEAR(result.samples.back().z[1], j1 * slip / (j1 + j2), 1e-9);
}

TEST(ReferenceSolver, HasThePeriodOfTheStickSlipOscillator) {
    const Result result = run(cases::stick_slip(), 24, {.step = 1e-4});
    const double slip_time = 2 * std::numbers::pi - 2 * std::atan(0.3 / 0.2);
    const double first = time_of(result, "contact", "slips", 1);
    EXPECT_NEAR(first, 5.0, 1e-9);  // x reaches 1 at 0.2 m/s
    EXPECT_NEAR(time_of(result, "contact", "locks", 1) - first, slip_time, 1e-9);
    EXPECT_NEAR(time_of(result, "contact", "slips", 2) - first, slip_time + 3.0, 1e-9);
    double largest = 0;
    for (const auto& s : result.samples) largest = std::max(largest, s.z[3]);
    EXPECT_NEAR(largest, 0.7 + std::hypot(0.3, 0.2), 1e-7);  // sampled every millisecond
}

// The redundant pair of mechanics: capacities 10 and 30 carrying 12.5 Nm share 3.125 + 9.375.
TEST(ReferenceSolver, SharesParallelClutchesByCapacity) {
    plant::Description d;
    d.masses = {{.name = "a", .inertia = 1}, {.name = "b", .inertia = 3}};
    for (const double capacity : {10.0, 30.0}) {
        plant::Clutch clutch{
            .name = capacity < 20 ? "small" : "large",
            .a = "a",
            .b = "b",
            .friction = plant::DryFriction{.sliding_capacity = capacity, .factor_over_slip = {}},
            .actuation = plant::ActuationConstant{},
            .heat = {}};
        clutch.initially_locked = true;
        d.clutches.push_back(clutch);
    }
    // M12 = J2 M1/(J1 + J2) = 12.5
    d.sources = {{.name = "drive", .mass = "a", .waveform = {{{.offset = 12.5 * 4 / 3}}}}};
    const Result result = run(d, 0.01);
    EXPECT_NEAR(result.samples.back().friction_torque[0], 3.125, 1e-9);
    EXPECT_NEAR(result.samples.back().friction_torque[1], 9.375, 1e-9);
    EXPECT_FALSE(result.samples.back().unique);
}

// What goes in is stored or lost, with slipping pairs, a spring, a lossy mesh and every change of state.
TEST(ReferenceSolver, BooksEveryJoule) {
    const std::pair<plant::Description, double> machines[] = {{cases::coupled_clutches(), 1.5},
                                                              {cases::lossy_gear_demo(), 0.5},
                                                              {cases::friction(), 3.0},
                                                              {cases::light_body(), 3.0}};
    for (const auto& [description, until] : machines) {
        const Result result = run(description, until, {.step = 1e-5});
        const Sample &first = result.samples.front(), &last = result.samples.back();
        EXPECT_NEAR(last.stored - first.stored, last.input - last.dissipated,
                    1e-9 * (last.dissipated + first.stored))
            << description.name;
        EXPECT_GT(last.dissipated, 0.01) << description.name;
    }
}

TEST(ReferenceSolver, ConvergesOnTheLightBody) {
    const Result coarse = run(cases::light_body(), 3.0, {.step = 1e-5});
    const Result fine = run(cases::light_body(), 3.0, {.step = 4e-6});
    double worst = 0;
    for (std::size_t i = 0; i < fine.samples.size(); ++i)
        worst = std::max(worst, (fine.samples[i].z - coarse.samples[i].z).lpNorm<Eigen::Infinity>());
    EXPECT_LT(worst, 1e-7);
    EXPECT_LT(std::abs(fine.samples.back().z[0] - fine.samples.back().z[2]), 1e-9);  // direct drive reached
}

}  // namespace
}  // namespace shiftrig::reference
