// What [Algin] found on the tractor of Fig. 11, and what a parked tractor owes its driver: claims that need the
// numbers of whole runs.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "apps/rig/choices.h"
#include "apps/rig/rig.h"
#include "plant/plant.h"

namespace shiftrig {
namespace {

// Runs a scenario and hands the rig out after every tick.
template <class Look>
void run(const std::string& scenario, const Look& look) {
    rig::Choices choices;
    choices.scenario = SHIFTRIG_SOURCE_DIR "/config/scenarios/" + scenario + ".yaml";
    rig::Setup setup = rig::make_setup(choices);
    const double duration = setup.scenario->duration;
    rig::Rig rig(std::move(setup));
    while (rig.sim_time() < duration) {
        rig.tick();
        look(rig);
    }
}

double value(const rig::Rig& rig, const std::string& signal) {
    const int index = rig.signals().find(signal);
    EXPECT_GE(index, 0) << signal;
    return index < 0 ? NAN : rig.value(index);
}

struct Shift {
    double peak_shaft_torque = 0;  // [Nm] |E2| from the shift on
    std::map<std::string, int> ticks_slipping;
    bool f2_locked_in_the_end = false;
};

Shift article(const std::string& scenario) {
    Shift seen;
    run(scenario, [&seen](const rig::Rig& rig) {
        if (rig.sim_time() < 1) return;
        seen.peak_shaft_torque = std::max(seen.peak_shaft_torque, std::fabs(value(rig, "shaft.E2.torque")));
        for (const std::string clutch : {"Fc", "Fw"})
            seen.ticks_slipping[clutch] += value(rig, "clutch." + clutch + ".state") != 0;
        seen.f2_locked_in_the_end = value(rig, "clutch.F2.state") == 0 && value(rig, "clutch.F1.state") == 2;
    });
    return seen;
}

TEST(Article, FavourableTimingShiftsWithMainClutchAndWheelContactClosedThroughout) {
    const Shift good = article("article_fig11_good");
    EXPECT_TRUE(good.f2_locked_in_the_end);
    EXPECT_EQ(good.ticks_slipping.at("Fc"), 0);
    EXPECT_EQ(good.ticks_slipping.at("Fw"), 0);
}

TEST(Article, UnfavourableTimingSlipsMainClutchAndWheelContactUnderAHigherShaftTorquePeak) {
    const Shift bad = article("article_fig11_bad"), good = article("article_fig11_good");
    EXPECT_TRUE(bad.f2_locked_in_the_end);
    EXPECT_GT(bad.ticks_slipping.at("Fc"), 0);
    EXPECT_GT(bad.ticks_slipping.at("Fw"), 0);
    // Half as much again at least: the contact that slips is all that limits it.
    EXPECT_GT(bad.peak_shaft_torque, 1.5 * good.peak_shaft_torque);
}

TEST(Scenario, ASignalWithoutItsUnitIsRefusedBeforeTheFirstTick) {
    const std::string path =
        SHIFTRIG_SOURCE_DIR "/config/scenarios/wrong.yaml";  // nothing is read from there
    const auto scenario = io::parse_scenario(
        "model: ../tractor.yaml\n"
        "duration_s: 1\n"
        "start: {inputs: {clutch.F2.pressure_command: 18}}\n",
        path);
    try {
        const rig::Rig rig(rig::make_setup({}, scenario));
        FAIL();
    } catch (const io::InputError& error) {
        EXPECT_EQ(std::string(error.what()),
                  path +
                      ":3:18: clutch.F2.pressure_command must be written with its unit: "
                      "clutch.F2.pressure_command ends in _pa or _bar");
    }
}

TEST(HoldOnSlope, StandsStillForTenMinutes) {
    double stopped_at = -1, reference = NAN, farthest = 0, last_time = 0;
    run("hold_on_slope", [&](const rig::Rig& rig) {
        const double distance = value(rig, "body.vehicle.distance");
        if (stopped_at < 0 && value(rig, "mass.vehicle.speed") == 0) stopped_at = rig.sim_time();
        if (stopped_at < 0 || rig.sim_time() < stopped_at + 60) return;
        if (std::isnan(reference)) reference = distance;
        farthest = std::max(farthest, std::fabs(distance - reference));
        last_time = rig.sim_time();
    });
    ASSERT_GT(stopped_at, 0);
    EXPECT_GE(last_time - (stopped_at + 60), 600 - 1e-3);  // observed for ten minutes
    EXPECT_LT(farthest, 1e-9);
}

}  // namespace
}  // namespace shiftrig
