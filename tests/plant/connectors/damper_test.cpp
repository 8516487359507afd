// Dampers against the closed form. Two masses alone with one: their slip falls as e^(−λt), λ = d (1/J_a + 1/J_b), and of its
// energy J_r Δω²/2 that share is lost.
#include "plant/connectors/damper.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/plant/rig.h"

namespace shiftrig::plant {
namespace {

constexpr double slip = 50, reduced = 0.01 / 1.01, energy = 0.5 * reduced * slip * slip;

// By one of λh = `speed` at 1 ms; as a shaft that hardly has a stiffness, the same.
Description joined(double speed, bool by_shaft) {
    Description d;
    d.masses = {mass("a", 1), mass("b", 0.01, slip)};
    const double damping = speed / 1e-3 * reduced;
    if (by_shaft) {
        d.shafts = {{.name = "s", .a = "a", .b = "b", .stiffness = 1, .damping = damping}};
    } else {
        d.dampers = {{.name = "k", .a = "a", .b = "b", .damping = damping}};
    }
    return d;
}

// Simpson's rule on e^(−2λt), on parts of a length p, is off by (2λp)⁴/180 of what is lost. λp is 1/4 at most, up to λh = 2 1/2.
constexpr double simpson = 1. / 16 / 180, simpson_of_few_parts = 1. / 180;

class EachDamper : public ::testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Connectors, EachDamper, ::testing::Bool(),
                         [](const auto& test) { return test.param ? "shaft" : "damper"; });

TEST_P(EachDamper, LosesWhatThereIsHoweverFastItIs) {
    for (double speed = 0.1; speed < 2e8; speed *= 4) {
        Rig rig(joined(speed, GetParam()));
        const double tolerance = energy * (speed > 2 ? simpson : simpson_of_few_parts);
        for (int tick = 1; tick <= 100; ++tick) {
            rig.step();
            ASSERT_NEAR(rig.out("energy.defect"), 0, tolerance) << speed << ", tick " << tick;
            ASSERT_LE(rig.out("energy.dissipated"), energy + tolerance) << speed << ", tick " << tick;
            if (GetParam()) continue;
            ASSERT_NEAR(rig.out("energy.dissipated"), energy * -std::expm1(-2 * speed * tick), tolerance)
                << speed << ", tick " << tick;
        }
        EXPECT_EQ(rig.flags, 0) << speed;
    }
}

// What cuts the step in which the slip falls: a torque that begins there.
TEST(Damper, LosesWhatThereIsInPartsOfAStepToo) {
    for (const double cut : {1e-9, 3e-8, 1e-6, 1.7e-5, 3e-4, 0.99e-3}) {
        for (const double speed : {1., 30., 300., 3e4, 3e6}) {
            Description d = joined(speed, false);
            d.sources = {source("a", constant(1e-3, cut))};
            Rig rig(d);
            for (int tick = 0; tick < 10; ++tick) {
                rig.scratch.fill_with_nan();
                if (tick % 2 == 1) rig.operators.drop();
                rig.step();
            }
            EXPECT_NEAR(rig.out("energy.dissipated"), energy, simpson * energy) << speed << ", cut " << cut;
            EXPECT_NEAR(rig.out("energy.defect"), 0, simpson * energy) << speed << ", cut " << cut;
        }
    }
}

// A clutch slides against a light mass that a fast damper couples to a heavy one: its heat, the work of the torque and the way of
// a body count too.
TEST(Damper, LeavesOthersTheirWork) {
    const auto run = [](double speed, double h) {
        Description d = joined(speed, false);
        d.masses.push_back(mass("c", 1, 200));
        d.masses.push_back({"body", 10, Motion::translating, 2});
        d.clutches = {clutch("C", "c", "b", 30)};
        d.sources = {source("b", sine(100, 30))};
        d.gears = {lossy_gear("G", "a", "body", 0.1, 0.9, 0)};
        d.masses[0].initial_speed = 0.2;
        Rig rig(d, {h, KernelKind::automatic});
        rig.run(0.02);
        EXPECT_LT(std::fabs(rig.out("energy.defect")), simpson * energy) << speed << ", step " << h;
        return std::array{rig.out("clutch.C.heat"), rig.out("energy.input"), rig.out("body.body.distance")};
    };
    for (const double speed : {300., 3e4}) {
        const auto coarse = run(speed, 1e-3), fine = run(speed, 1e-5);
        for (std::size_t i = 0; i < coarse.size(); ++i)
            EXPECT_NEAR(coarse[i], fine[i], 1e-4 * std::fabs(fine[i])) << speed << ", " << i;
    }
}

}  // namespace
}  // namespace shiftrig::plant
