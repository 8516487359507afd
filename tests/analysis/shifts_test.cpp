#include "analysis/shifts.h"

#include <gtest/gtest.h>

#include "analysis/gears.h"
#include "tests/analysis/synthetic_run.h"

namespace shiftrig::analysis {
namespace {

using Names = std::vector<std::string>;

TEST(Gears, RatioIsMeasuredAcrossTheGearboxNotAcrossShafts) {
    const std::vector<Gear> gears = gears_of(small_machine());
    ASSERT_EQ(gears.size(), 3u);
    EXPECT_EQ(gears[0].selecting, Names{"A"});
    EXPECT_EQ(gears[0].common, Names{"Fc"});
    EXPECT_EQ(gears[0].out, "output");
    EXPECT_NEAR(gears[0].ratio.value(), 4, 1e-12);
    EXPECT_NEAR(gears[1].ratio.value(), 3, 1e-12);
    EXPECT_NEAR(gears[2].ratio.value(), -4, 1e-12);
}

// The planetary gearbox of [Algin] Fig. 9: two clutches make a gear, ratios known from its rows.
TEST(Gears, PlanetaryGearboxHasTheKnownRatios) {
    plant::Description machine;
    for (const char* name : {"in", "ring1", "c1r2", "suns23", "c2r3", "out"})
        machine.masses.push_back({.name = name, .inertia = 1});
    machine.planetaries = {{"row1", "in", "ring1", "c1r2", -1.779, 1},
                           {"row2", "suns23", "c1r2", "c2r3", -3.151, 1},
                           {"row3", "suns23", "c2r3", "out", -2.409, 1}};
    const auto clutch = [&](const char* name, const char* a, const char* b) {
        plant::Clutch result;
        result.name = name;
        result.a = a;
        result.b = b;
        plant::DryFriction friction;
        friction.sliding_capacity = 100;
        result.friction = friction;
        result.actuation = plant::ActuationDirect{};
        machine.clutches.push_back(result);
    };
    clutch("C1", "in", "suns23");
    clutch("C2", "in", "c2r3");
    clutch("C3", "ring1", "");
    clutch("C4", "c1r2", "");
    clutch("C5", "c2r3", "");
    machine.gear_paths = {{"I", {"C1", "C5"}},  {"II", {"C1", "C4"}}, {"III", {"C1", "C3"}},
                          {"IV", {"C1", "C2"}}, {"V", {"C2", "C3"}},  {"VI", {"C2", "C4"}},
                          {"R", {"C3", "C5"}}};
    machine.input_mass = "in";
    machine.output_mass = "out";
    const double expected[] = {3.4090, 2.1571, 1.5230, 1.0000, 0.6283, 0.5197, -3.0065};
    const std::vector<Gear> gears = gears_of(machine);
    ASSERT_EQ(gears.size(), 7u);
    for (std::size_t i = 0; i < gears.size(); ++i) {
        EXPECT_NEAR(gears[i].ratio.value(), expected[i], 5e-5) << gears[i].name;
        EXPECT_EQ(gears[i].selecting.size(), 2u);
    }
}

TEST(Shifts, SteadyDrivingHasNone) {
    EXPECT_TRUE(find_shifts(driving_in_a().run).empty());
}

TEST(Shifts, UpshiftLastsFromTheLeverToTwoPercentOfTheNewRatio) {
    const std::vector<Shift> shifts = find_shifts(upshift().run);
    ASSERT_EQ(shifts.size(), 1u);
    const Shift& shift = shifts[0];
    EXPECT_EQ(shift.label(), "A->B");
    EXPECT_EQ(shift.kind, ShiftKind::power_upshift);
    EXPECT_TRUE(shift.completed());
    EXPECT_EQ(shift.oncoming, Names{"B"});
    EXPECT_EQ(shift.offgoing, Names{"A"});
    EXPECT_NEAR(shift.asked_at, 5.0, 1e-9);
    EXPECT_NEAR(shift.ended_at, 5.676, 1e-3);  // one tick
    EXPECT_NEAR(shift.duration(), 0.676, 1e-3);
}

TEST(Shifts, WithoutALeverItLastsFromTheFirstCommand) {
    SyntheticRun synthetic = upshift();
    synthetic.set("driver.lever", 1);
    const std::vector<Shift> shifts = find_shifts(synthetic.run);
    ASSERT_EQ(shifts.size(), 1u);
    EXPECT_NEAR(shifts[0].asked_at, 5.1, 1e-9);
}

TEST(Shifts, EngineTorqueTellsPowerFromCoast) {
    SyntheticRun synthetic = upshift();
    synthetic.set("engine.engine.torque", -80);
    EXPECT_EQ(find_shifts(synthetic.run)[0].kind, ShiftKind::coast_upshift);
}

TEST(Shifts, RatioThatOnlyPassesByIsNotCompletion) {
    SyntheticRun synthetic = upshift();
    // Falls through 90 to 70 at 5.5 s and comes back to stay within 2 % from 6.0 s on.
    const Formula input = [](double t) {
        return t < 5.3 ? 120 : t < 5.5 ? 120 - 250 * (t - 5.3) : t < 6 - 1e-9 ? 70. : 90.;
    };
    synthetic.set_input_speed(input);
    const std::vector<Shift> shifts = find_shifts(synthetic.run);
    ASSERT_EQ(shifts.size(), 1u);
    EXPECT_NEAR(shifts[0].ended_at, 6.0, 1e-9);
}

TEST(Shifts, SlippingMainClutchIsNotCompletion) {
    SyntheticRun synthetic = upshift();
    synthetic.set("clutch.Fc.slip", step(6.2, 5, 0));  // 5 of 90 rad/s
    EXPECT_NEAR(find_shifts(synthetic.run)[0].ended_at, 6.2, 1e-9);
}

TEST(Shifts, ShiftThatNeverReachesItsRatioFailsTwoSecondsAfterItWasAskedFor) {
    SyntheticRun synthetic = upshift();
    synthetic.set_input_speed(ramp(5.3, 5.7, 120, 100));
    const std::vector<Shift> shifts = find_shifts(synthetic.run);
    ASSERT_EQ(shifts.size(), 1u);
    EXPECT_FALSE(shifts[0].completed());
    EXPECT_EQ(shifts[0].end, ShiftEnd::timed_out);
    EXPECT_NEAR(shifts[0].ended_at, 7.0, 1e-9);
}

TEST(Shifts, CommandTakenBackIsAnAbortedShift) {
    SyntheticRun synthetic = driving_in_a();
    synthetic.set("driver.lever", [](double t) { return t < 5 ? 1 : t < 5.18 ? 2 : 1; });
    synthetic.set("clutch.B.engagement", [](double t) { return t > 5.1 && t < 5.2 - 1e-9 ? 1 : 0; });
    const std::vector<Shift> shifts = find_shifts(synthetic.run);
    ASSERT_EQ(shifts.size(), 1u);
    EXPECT_EQ(shifts[0].label(), "A->B");
    EXPECT_EQ(shifts[0].end, ShiftEnd::taken_back);
    EXPECT_NEAR(shifts[0].ended_at, 5.2, 1e-9);
}

TEST(Shifts, ThirdGearOvertakesAnUnfinishedShift) {
    SyntheticRun synthetic = driving_in_a();
    synthetic.set("clutch.A.engagement", step(5.1, 1, 0)).set("clutch.A.state", step(5.1, locked, open));
    synthetic.set("clutch.B.engagement", step(5.05, 0, 1));
    synthetic.set("clutch.R.engagement", step(5.3, 0, 1));
    const std::vector<Shift> shifts = find_shifts(synthetic.run);
    ASSERT_EQ(shifts.size(), 2u);
    EXPECT_EQ(shifts[0].label(), "A->B");
    EXPECT_EQ(shifts[0].end, ShiftEnd::overtaken);
    EXPECT_NEAR(shifts[0].ended_at, 5.3, 1e-9);
    EXPECT_EQ(shifts[1].to, "R");
}

TEST(Shifts, LaunchBeginsInNeutralAndEndsWhenTheMainClutchHolds) {
    SyntheticRun synthetic = driving_in_a();
    synthetic.set("driver.lever", step(4.8, 0, 1));
    synthetic.set("clutch.A.engagement", step(5.0, 0, 1)).set("clutch.A.state", step(5.1, open, locked));
    synthetic.set("mass.output.speed", ramp(5.2, 6.2, 0, 30)).set("mass.input.speed", ramp(5.2, 6.2, 0, 120));
    synthetic.set("clutch.Fc.slip", ramp(5.2, 6.2, 120, 0))
        .set("clutch.Fc.state", step(6.2, slipping, locked));
    const std::vector<Shift> shifts = find_shifts(synthetic.run);
    ASSERT_EQ(shifts.size(), 1u);
    EXPECT_EQ(shifts[0].label(), "N->A");
    EXPECT_EQ(shifts[0].kind, ShiftKind::launch);
    EXPECT_NEAR(shifts[0].asked_at, 4.8, 1e-9);
    EXPECT_NEAR(shifts[0].ended_at, 5.2 + 1 / 1.02, 1e-3);  // 4·30·(t − 5.2)·1.02 = 120
}

TEST(Shifts, ShuttleThroughNeutralCountsFromTheLeverInTheOldGear) {
    SyntheticRun synthetic = driving_in_a();
    synthetic.set("driver.lever", step(4.0, 1, -1));
    synthetic.set("clutch.A.engagement", step(4.1, 1, 0)).set("clutch.A.state", step(4.15, locked, open));
    synthetic.set("clutch.R.engagement", step(5.5, 0, 1)).set("clutch.R.state", step(6.5, open, locked));
    synthetic.set("mass.output.speed", ramp(4.5, 6.5, 30, -30));
    const std::vector<Shift> shifts = find_shifts(synthetic.run);
    ASSERT_EQ(shifts.size(), 1u);
    EXPECT_EQ(shifts[0].label(), "A->R");
    EXPECT_EQ(shifts[0].kind, ShiftKind::shuttle);
    EXPECT_NEAR(shifts[0].asked_at, 4.0, 1e-9);
    // |120 + 4·ω| ≤ 2 % of 4·|ω| from ω = −120/4/1.02 on.
    EXPECT_NEAR(shifts[0].ended_at, 4.5 + (30 + 30 / 1.02) / 30, 1e-3);
}

TEST(Shifts, OpeningTheDrivelineIsNoShiftAndStartingAgainIsALaunch) {
    SyntheticRun synthetic = driving_in_a();
    synthetic.set("clutch.A.engagement", [](double t) { return t > 3 && t < 6 - 1e-9 ? 0. : 1.; });
    synthetic.set("clutch.A.state", [](double t) { return t > 3 && t < 6.5 - 1e-9 ? open : locked; });
    synthetic.set("mass.output.speed", [](double t) { return t > 3 && t < 6.5 - 1e-9 ? 10. : 30.; });
    const std::vector<Shift> shifts = find_shifts(synthetic.run);
    ASSERT_EQ(shifts.size(), 1u);
    EXPECT_EQ(shifts[0].label(), "N->A");
    EXPECT_NEAR(shifts[0].asked_at, 6.0, 1e-9);
    EXPECT_NEAR(shifts[0].ended_at, 6.5, 1e-9);
}

TEST(Shifts, TwoInSuccessionAreToldApartAndTheFirstSettlesUntilTheSecondIsAskedFor) {
    SyntheticRun synthetic = upshift();
    synthetic.set("driver.lever", [](double t) { return t < 5 - 1e-9 ? 1. : t < 6 - 1e-9 ? 2. : 1.; });
    // Back to A: commanded at 6.1, in ratio at 6.4.
    synthetic.set("clutch.A.engagement", [](double t) { return t > 5.25 && t < 6.1 - 1e-9 ? 0. : 1.; });
    synthetic.set("clutch.A.state", [](double t) { return t > 5.3 && t < 6.4 - 1e-9 ? open : locked; });
    synthetic.set("clutch.B.engagement", [](double t) { return t > 5.1 && t < 6.2 ? 1. : 0.; });
    synthetic.set("clutch.B.state", [](double t) { return t > 5.7 && t < 6.3 ? locked : open; });
    const Formula down = ramp(5.3, 5.7, 120, 90);
    synthetic.set_input_speed([down](double t) { return t < 6.4 - 1e-9 ? down(t) : 120; });
    const std::vector<Shift> shifts = find_shifts(synthetic.run);
    ASSERT_EQ(shifts.size(), 2u);
    EXPECT_EQ(shifts[0].label(), "A->B");
    EXPECT_EQ(shifts[1].label(), "B->A");
    EXPECT_EQ(shifts[1].kind, ShiftKind::power_downshift);
    EXPECT_NEAR(synthetic.run.time[shifts[0].settled], 6.0, 1e-9);
    EXPECT_NEAR(shifts[1].duration(), 0.4, 1e-9);
}

// `count` gears before A that nobody engages, each with a clutch of its own.
SyntheticRun upshift_beside_other_gears(int count) {
    SyntheticRun synthetic = upshift();
    plant::Description& machine = synthetic.run.machine;
    std::vector<plant::GearPath> paths;
    for (int i = 0; i < count; ++i) {
        plant::Clutch clutch = machine.clutches[1];
        clutch.name = "X" + std::to_string(i);
        machine.clutches.push_back(clutch);
        paths.push_back({clutch.name, {"Fc", clutch.name}});
    }
    paths.insert(paths.end(), machine.gear_paths.begin(), machine.gear_paths.end());
    machine.gear_paths = paths;
    return synthetic;
}

TEST(Shifts, AreToldApartAmongMoreGearsThanAWordHasBits) {
    const std::vector<Shift> shifts = find_shifts(upshift_beside_other_gears(64).run);
    ASSERT_EQ(shifts.size(), 1u);
    EXPECT_EQ(shifts[0].label(), "A->B");
    EXPECT_EQ(shifts[0].oncoming, Names{"B"});
    EXPECT_EQ(shifts[0].offgoing, Names{"A"});
}

// Of more than that no model is built.
TEST(Shifts, AreToldApartAmongAsManyClutchesAsAModelMayHave) {
    EXPECT_EQ(find_shifts(upshift_beside_other_gears(252).run).size(), 1u);
}

TEST(Shifts, RunWithoutGearPathsHasNone) {
    SyntheticRun synthetic = upshift();
    synthetic.run.machine.gear_paths.clear();
    EXPECT_TRUE(find_shifts(synthetic.run).empty());
}

}  // namespace
}  // namespace shiftrig::analysis
