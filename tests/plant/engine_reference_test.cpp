// Against curves made elsewhere (tests/data, provenance in tests/data/README.md). The bounds are three times what a
// prototype of the same method reached, where the reference's own tolerance is not larger.
#include "rig.h"

namespace shiftrig::plant {
namespace {

constexpr double pi = 3.14159265358979323846;

Description coupled_clutches() {
    Description d;
    d.name = "CoupledClutches";
    d.masses = {mass("J1", 1, 10), mass("J2", 1), mass("J3", 1), mass("J4", 1)};
    // cos(0.4 π t) on [0, 1.25 s): a sine of 0.2 Hz a quarter turn early.
    d.clutches = {
        clutch("clutch1", "J1", "J2", 10, 1.1, ActuationDirect{sine(1, 0.2, -1e300, 1.25, -1.25), 0}),
        clutch("clutch2", "J2", "J3", 10, 1.1, ActuationDirect{constant(1, 0.4), 0}),
        clutch("clutch3", "J3", "J4", 10, 1.1, ActuationDirect{constant(1, 0.9), 0})};
    d.sources = {source("J1", sine(10, 5))};
    return d;
}

Description friction() {
    Description d;
    d.name = "Friction";
    d.masses = {mass("J3", 1, 100), mass("J2", 0.05, 90), mass("J1", 1, 90)};
    d.clutches = {clutch("clutch", "J3", "J2", 80),
                  clutch("brake", "J1", "", 800, 1, ActuationDirect{constant(1, 0.5), 0})};
    d.shafts = {{"spring", "J2", "J1", 160, 1, 0}};
    d.sources = {source("J3", sine(200, 100 / (2 * pi), -1e300, 0.5))};
    return d;
}

Description lossy_gear() {
    Description d;
    d.name = "LossyGearDemo1";
    d.masses = {mass("J1", 1), mass("J2", 1.5)};
    Gear gear;
    gear.name = "gear";
    gear.a = "J1";
    gear.b = "J2";
    gear.ratio = 2;
    gear.efficiency = 0.5;
    d.gears = {gear};
    Waveform load;
    load.pieces.push_back({});
    load.pieces[0].from = 0;
    load.pieces[0].offset = -10;
    load.pieces[0].slope = 2.5;
    d.sources = {source("J1", sine(10, 1)), source("J2", load)};
    return d;
}

// Worst difference of a signal from a reference column over the run, on the grid both share.
struct Comparison {
    std::string signal, column;
    double sign = 1;
    std::string minus = {};  // signal to be taken off
    double worst = 0;
};

void compare(Rig& rig, const std::string& file, double h, std::vector<Comparison>& comparisons) {
    const auto reference = read_reference(file);
    const auto every = static_cast<std::size_t>(std::lround(h / 1e-3));
    const std::size_t rows = reference.at("time").size();
    ASSERT_GT(rows, 100u);
    for (std::size_t row = every; row < rows; row += every) {
        rig.step();
        for (Comparison& c : comparisons) {
            const double value = rig.out(c.signal) - (c.minus.empty() ? 0 : rig.out(c.minus));
            const double error = std::fabs(c.sign * value - reference.at(c.column)[row]);
            c.worst = std::max(c.worst, error);
        }
    }
}

struct Case {
    double h;
    Method method;
};
Description with(Description d, Method method) {
    d.method = method;
    return d;
}

class BothEngines : public ::testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(OneAndTwoMilliseconds, BothEngines,
                         ::testing::Values(Case{1e-3, Method::etd3}, Case{2e-3, Method::etd3},
                                           Case{1e-3, Method::ark3}, Case{2e-3, Method::ark3}),
                         [](const auto& test) {
                             return std::string(test.param.method == Method::etd3 ? "etd3_" : "ark3_") +
                                    (test.param.h > 1.5e-3 ? "2ms" : "1ms");
                         });

TEST_P(BothEngines, CoupledClutchesFollowTheReference) {
    Rig rig(with(coupled_clutches(), GetParam().method), {GetParam().h, KernelKind::automatic});
    std::vector<Comparison> c = {{"mass.J1.speed", "J1.w"},
                                 {"clutch.clutch1.slip", "clutch1.w_rel", -1},
                                 {"clutch.clutch2.slip", "clutch2.w_rel", -1},
                                 {"clutch.clutch3.slip", "clutch3.w_rel", -1}};
    compare(rig, "CoupledClutches.csv", GetParam().h, c);
    EXPECT_LT(c[0].worst, 3 * 6.6e-5);
    EXPECT_LT(c[1].worst, 3 * 6.6e-5);
    EXPECT_LT(c[2].worst, 3 * 1.5e-7);
    EXPECT_LT(c[3].worst, 3 * 3.1e-5);
    EXPECT_EQ(rig.fall_backs, 0);
    // Momentum: Σω(1.5 s) = 10 + 2/π, whatever the clutches do.
    double sum = 0;
    for (double speed : rig.state.speeds()) sum += speed;
    EXPECT_NEAR(sum, 10 + 2 / pi, 2e3 * std::pow(GetParam().h, 4));  // quadrature of the sine, order 4
    const auto lock1 = rig.times(EventKind::lock, "clutch1"), lock2 = rig.times(EventKind::lock, "clutch2"),
               lock3 = rig.times(EventKind::lock, "clutch3"),
               open1 = rig.times(EventKind::break_away, "clutch1");
    ASSERT_EQ(lock1.size(), 2u);
    ASSERT_EQ(lock2.size(), 1u);
    ASSERT_EQ(lock3.size(), 1u);
    ASSERT_EQ(open1.size(), 2u);
    EXPECT_NEAR(lock1[0], 0.7916583, 3 * 4.1e-6);
    EXPECT_NEAR(open1[0], 0.8311085, 3 * 4.1e-6);
    EXPECT_NEAR(lock1[1], 0.9068491, 3 * 4.1e-6);
    EXPECT_NEAR(open1[1], 1.0002959, 3 * 4.1e-6);
    EXPECT_NEAR(lock2[0], 0.7096215, 3 * 4.1e-6);
    EXPECT_NEAR(lock3[0], 1.1439696, 3 * 4.1e-6);
}

TEST_P(BothEngines, FrictionFollowsTheReference) {
    Rig rig(with(friction(), GetParam().method), {GetParam().h, KernelKind::automatic});
    std::vector<Comparison> c = {{"mass.J3.speed", "inertia3.w"},
                                 {"clutch.clutch.slip", "clutch.w_rel", -1},
                                 {"shaft.spring.twist", "spring.phi_rel", -1},
                                 {"mass.J2.speed", "spring.w_rel", -1, "mass.J1.speed"}};
    compare(rig, "Friction.csv", GetParam().h, c);
    EXPECT_LT(c[0].worst, 4e-4);  // the reference's own agreement
    EXPECT_LT(c[1].worst, 4e-4);
    EXPECT_LT(c[2].worst, 3 * 1e-5);
    EXPECT_LT(c[3].worst, 4e-4);
    EXPECT_EQ(rig.fall_backs, 0);
}

// ETD3 is exact in the swinging spring; ARK3 comes to agree with it across lock and break-away. Divided, long steps are as near.
TEST(Ark3, ConvergesToTheExactEngineInTheFrictionProblem) {
    const auto difference = [](double h, int parts) {
        Description whole = friction();
        whole.maximum_parts = parts;
        Rig exact(with(whole, Method::etd3), {h, KernelKind::automatic}),
            tree(with(whole, Method::ark3), {h, KernelKind::automatic});
        double worst = 0;
        while (exact.state.time() < 1 - 1e-9) {
            exact.step();
            tree.step();
            worst =
                std::max(worst, std::fabs(exact.out("clutch.clutch.slip") - tree.out("clutch.clutch.slip")));
        }
        return worst;
    };
    const double coarse = difference(4e-3, 1), fine = difference(1e-3, 1), finest = difference(1.25e-4, 1);
    EXPECT_GT(std::log2(coarse / fine) / 2, 3) << coarse << " → " << fine;
    EXPECT_LT(fine, 5e-5);
    EXPECT_LT(finest, 1e-6);
    EXPECT_LT(difference(4e-3, 16), 0.25 * coarse);
}

class EachEngine : public ::testing::TestWithParam<Method> {};
INSTANTIATE_TEST_SUITE_P(Methods, EachEngine, ::testing::Values(Method::etd3, Method::ark3),
                         [](const auto& test) { return test.param == Method::etd3 ? "etd3" : "ark3"; });

// The article's rule acts from the next step on: the figures are those of the same prototype without localisation.
TEST_P(EachEngine, NextStepRuleHasTheErrorsKnownOfIt) {
    Description clutches = with(coupled_clutches(), GetParam()), brake = with(friction(), GetParam());
    for (Description* d : {&clutches, &brake}) d->transition = Transition::next_step;
    Rig coupled(clutches), braked(brake);
    std::vector<Comparison> c = {{"mass.J1.speed", "J1.w"}, {"clutch.clutch1.slip", "clutch1.w_rel", -1}},
                            f = {{"clutch.clutch.slip", "clutch.w_rel", -1}};
    compare(coupled, "CoupledClutches.csv", 1e-3, c);
    compare(braked, "Friction.csv", 1e-3, f);
    EXPECT_LT(c[0].worst, 3 * 4.8e-4);
    EXPECT_LT(c[1].worst, 3 * 7.5e-4);
    EXPECT_LT(f[0].worst, 3 * 2.0e-2);
    EXPECT_GT(c[0].worst, 4.8e-4 / 3) << "is it localised after all?";
    EXPECT_GT(c[1].worst, 7.5e-4 / 3);
    EXPECT_GT(f[0].worst, 2.0e-2 / 3);
}

// A diesel is let run up through every corner of its full-load curve and onto the governor line. Corners are not located:
// each costs O(h²) once.
TEST_P(EachEngine, CornersOfTheEngineCurveAreHarmless) {
    Description d;
    d.name = "run-up";
    d.method = GetParam();
    d.masses = {mass("engine", 2.6, 75), mass("rotor", 0.5, 75)};
    d.shafts = {{"shaft", "engine", "rotor", 5000, 20, 0}};
    Engine engine;
    engine.name = "diesel";
    engine.mass = "engine";
    engine.full_load = {{73, 550},   {89, 700},   {105, 880}, {126, 1060}, {147, 1170},
                        {168, 1201}, {188, 1144}, {210, 972}, {220, 858},  {226, 729}};
    engine.governor_slope = 187;
    engine.low_idle = 94;
    engine.high_idle = 229;
    engine.friction_constant = 70;
    engine.friction_per_speed = 0.45;
    engine.actuator_lag = 0.04;
    engine.turbo_instant_fraction = 0.62;
    engine.turbo_lag = 0.5;
    engine.fade_from = 70;
    engine.fade_to = 50;
    engine.stall_speed = 40;
    d.engines = {engine};
    const auto trace = [&](int steps_per_millisecond) {
        Rig rig(d, {1e-3 / steps_per_millisecond, KernelKind::automatic});
        rig.in("driver.throttle") = 1;
        std::vector<double> speeds;
        for (int k = 0; k < 1500; ++k) {
            for (int i = 0; i < steps_per_millisecond; ++i) rig.step();
            speeds.push_back(rig.state.speeds()[0]);
        }
        return speeds;
    };
    const auto exact = trace(32);
    EXPECT_GT(exact.back(), 226) << "it reached the governor line";
    const auto worst = [&](const std::vector<double>& speeds) {
        double most = 0;
        for (std::size_t k = 0; k < speeds.size(); ++k)
            most = std::max(most, std::fabs(speeds[k] - exact[k]));
        return most;
    };
    const double coarse = worst(trace(1)), fine = worst(trace(4));
    // Reached, of what the speed passes through: 8.8e-8 and 5.2e-8 (ETD3), 2.6e-6 and 9.6e-8 (ARK3).
    const bool exact_swings = GetParam() == Method::etd3;
    EXPECT_LT(coarse, 150 * (exact_swings ? 2.5e-7 : 7.5e-6));
    EXPECT_LT(fine, 150 * (exact_swings ? 1.5e-7 : 2.8e-7));
    EXPECT_LT(fine, coarse);
}

// Releases act at the start of a step, so the bounds are for 1 ms.
TEST_P(EachEngine, LossyGearSticksAndReleasesAsTheReference) {
    Rig rig(with(lossy_gear(), GetParam()));
    std::vector<Comparison> c = {{"mass.J2.speed", "Inertia2.w"}};
    compare(rig, "LossyGearDemo1.csv", 1e-3, c);
    EXPECT_LT(c[0].worst, 3 * 2.7e-6);
    const auto sticks = rig.times(EventKind::mesh_sticks, "gear"),
               moves = rig.times(EventKind::mesh_releases, "gear");
    ASSERT_EQ(sticks.size(), 2u);
    ASSERT_EQ(moves.size(), 2u);
    EXPECT_NEAR(sticks[0], 0.0804771, 4.5e-6);
    EXPECT_NEAR(sticks[1], 0.3713427, 4.5e-6);
    EXPECT_NEAR(moves[0], 0.1995199, 1e-3);
    EXPECT_NEAR(moves[1], 0.4645395, 1e-3);
}

}  // namespace
}  // namespace shiftrig::plant
