// What the plant refuses to build: each refusal word for word, and the neighbour that it accepts.
#include <gtest/gtest.h>

#include <limits>

#include "plant/plant.h"
#include "tests/plant/machines.h"
#include "tests/plant/parts.h"

namespace shiftrig::plant {
namespace {

std::string refusal(const Description& d) {
    try {
        Model::build(d);
        return "";
    } catch (const ModelError& error) {
        return error.what();
    }
}

// ---- clutches ---------------------------------------------------------------------------------------

Description wet_clutch(double preload, double stroke) {
    ActuationHydraulic valve;
    valve.natural_frequency = 60;
    valve.damping_ratio = 0.8;
    valve.slew = 150e5;
    valve.maximum_pressure = 18e5;
    valve.preload_pressure = preload;
    valve.stroke = stroke;
    valve.fill_volume = 30e-6;
    valve.fill_flow = 20e-3 / 60;
    Description d;
    d.masses = {mass("left", 1), mass("right", 2)};
    d.clutches = {clutch("F2", "left", "right", 1)};
    d.clutches[0].friction = powershift_plates();
    d.clutches[0].actuation = valve;
    return d;
}

// A spring that weakens while it is pressed would throw the piston to full stroke, with no pressure to balance it on the way.
TEST(Validation, TheReturnSpringOfAPistonDoesNotWeakenAlongItsStroke) {
    EXPECT_EQ(refusal(wet_clutch(1.2e5, 2e-3)), "");
    EXPECT_EQ(refusal(wet_clutch(5e5, 2e-3)),
              "clutch \"F2\": preload_pressure = 500000; must be <= return_pressure");
    EXPECT_EQ(refusal(wet_clutch(5e5, 0)), "") << "without a piston nobody asks for it";
}

// Held less than it passes, a pair would lock and break away without end.
TEST(Validation, WhatHoldsIsNotLessThanWhatSlidesAtRest) {
    Description d = wet_clutch(0.8e5, 0);
    auto& plates = std::get<WetPlates>(d.clutches[0].friction);
    plates.mu_static = 0.125;  // 0.10 + 0.025
    EXPECT_EQ(refusal(d), "");
    plates.mu_static = 0.12;
    EXPECT_EQ(
        refusal(d),
        "clutch \"F2\": mu_static = 0.12; must be >= 0.125, what slides at rest (mu_sliding + mu_rise)");
    plates.mu_rise = -0.05;
    EXPECT_EQ(refusal(d), "") << "friction that rises with slip is least at rest";
}

TEST(Validation, PressuresArePossible) {
    Description d = wet_clutch(0.8e5, 0);
    auto& valve = std::get<ActuationHydraulic>(d.clutches[0].actuation);
    valve.initial = 60e5;
    EXPECT_EQ(refusal(d), "clutch \"F2\": initial = 6000000; must be within 0 and 1800000");
    valve.initial = valve.maximum_pressure;
    EXPECT_EQ(refusal(d), "");
    valve.initial = 0;
    valve.maximum_pressure = 1.2e5;
    EXPECT_EQ(refusal(d),
              "clutch \"F2\": maximum_pressure = 120000; must be > return_pressure, which it works against");
    d.clutches[0] = clutch("F2", "left", "right", 1, 1, ActuationApply{0.1, false, 5});
    EXPECT_EQ(refusal(d), "clutch \"F2\": initial = 5; must be within 0 and 1");
}

// Nothing converts between an inertia and a body but what has a radius or a ratio.
TEST(Validation, WhatIsJoinedMovesAlike) {
    Description d;
    d.masses = {mass("wheel", 1), {"body", 100, Motion::translating}};
    d.shafts = {{.name = "rod", .a = "wheel", .b = "body", .stiffness = 1e4}};
    EXPECT_EQ(refusal(d), "shaft \"rod\": b = \"body\"; must be a rotating mass, as the other end is");
    d.shafts.clear();
    d.clutches = {clutch("C", "body", "wheel", 10)};
    EXPECT_EQ(refusal(d), "clutch \"C\": b = \"wheel\"; must be a translating mass, as the other end is");
    d.clutches[0].a = "wheel";
    d.clutches[0].b = "body";
    d.clutches[0].radius = 0.5;
    EXPECT_EQ(refusal(d), "");
    d.sensors = {{.name = "pick-up", .mass = "body", .ideal = false, .teeth = 60}};
    EXPECT_EQ(refusal(d), "sensor \"pick-up\": mass = \"body\"; must be a rotating mass to have teeth");
    d.sensors[0].ideal = true;
    EXPECT_EQ(refusal(d), "");
}

TEST(Validation, AnEngineFadesBelowWhereItPulls) {
    Description d;
    d.masses = {mass("crank", 1)};
    Engine e;
    e.name = "diesel";
    e.mass = "crank";
    e.full_load = {{50, 300}, {200, 400}};
    e.governor_slope = 20;
    e.low_idle = 90;
    e.high_idle = 220;
    e.fade_from = 60;
    e.fade_to = 40;
    d.engines = {e};
    EXPECT_EQ(refusal(d), "");
    d.engines[0].fade_to = 70;
    EXPECT_EQ(refusal(d), "engine \"diesel\": fade_to = 70; must be < fade_from");
    d.engines[0] = e;
    d.engines[0].full_load[0].second = -10;
    EXPECT_EQ(refusal(d), "engine \"diesel\": full_load = -10; must be >= 0");
}

// M_b = −u (M_a η ± b): with η = 1 the lines of both directions are parallel, and between them both agree.
TEST(Validation, BearingsThatDifferNeedLossesThatTellTheDirections) {
    Description d;
    d.masses = {mass("a", 1), mass("b", 1)};
    d.gears = {lossy_gear("g", "a", "b", 2, 1, 5)};
    EXPECT_EQ(refusal(d), "");
    d.gears[0].backward_bearing_torque = 5;
    EXPECT_EQ(refusal(d), "");
    d.gears[0].backward_bearing_torque = 1;
    EXPECT_EQ(
        refusal(d),
        "gear \"g\": backward_bearing_torque = 1; must be bearing_torque where both efficiencies are 1");
    d.gears[0].backward_efficiency = 0.99;
    EXPECT_EQ(refusal(d), "");
}

TEST(Validation, OptionsOfGearsCombineToNoMoreThanCanBeLookedAt) {
    Description d;
    d.masses = {mass("m0", 1)};
    const std::vector<std::pair<std::string, double>> four = {{"A", 1}, {"B", 2}, {"C", 3}, {"D", 4}};
    for (int k = 1; k <= 5; ++k) {
        const std::string here = std::to_string(k), before = std::to_string(k - 1);
        d.masses.push_back(mass("m" + here, 1));
        d.gears.push_back(lossy_gear("g" + here, "m" + before, "m" + here, 1, 1, 0));
        d.gears.back().options = four;
    }
    d.gears[4].options.clear();
    EXPECT_EQ(refusal(d), "");  // 256
    d.gears[4].options = four;
    EXPECT_EQ(refusal(d), "model \"\": gears have 1024 combinations of options; must be 1000 at most");
}

TEST(Validation, OnePedalHasOnePosition) {
    Description d;
    d.masses = {mass("left", 1), mass("right", 2)};
    d.clutches = {clutch("front", "left", "", 500, 1, ActuationApply{0.1, true, 0.25}),
                  clutch("rear", "right", "", 900, 1, ActuationApply{0.1, true, 0.25}),
                  clutch("parking", "right", "", 900, 1, ActuationApply{0.1, false, 1})};
    EXPECT_EQ(refusal(d), "");
    std::get<ActuationApply>(d.clutches[1].actuation).initial = 0;
    EXPECT_EQ(refusal(d),
              "clutch \"rear\": initial = 0; must be that of \"front\", which the same pedal applies");
}

// The scorecard tells the clutches of gears apart in sets of this size.
TEST(Validation, GearPathsNameNoMoreClutchesThanCanBeToldApart) {
    Description d;
    d.masses = {mass("left", 1)};
    const auto with_gears = [&](int count) {
        d.gear_paths.clear();
        for (int k = 0; k < count; ++k) {
            const std::string name = "K" + std::to_string(k);
            if (static_cast<int>(d.clutches.size()) <= k) d.clutches.push_back(clutch(name, "left", "", 1));
            d.gear_paths.push_back({name, {name}});
        }
        return refusal(d);
    };
    EXPECT_EQ(with_gears(256), "");
    EXPECT_EQ(with_gears(257), "model \"\": gear_paths name 257 clutches; must be 256 at most");
}

// ---- oil --------------------------------------------------------------------------------------------

std::string oil_refusal(double Oil::*field, double value) {
    Description d;
    d.masses = {mass("left", 1)};
    d.oil = reference_oil();
    (*d.oil).*field = value;
    return refusal(d);
}

// Warm as cold would make the share of cold 0/0, and swapped ones would take the cold oil's valves for the warm ones.
TEST(Validation, OilIsWarmAboveItsColdTemperature) {
    EXPECT_EQ(oil_refusal(&Oil::warm_temperature, -9), "");
    EXPECT_EQ(oil_refusal(&Oil::warm_temperature, -10),
              "oil \"oil\": warm_temperature = -10; must be > cold_temperature");
    EXPECT_EQ(oil_refusal(&Oil::cold_temperature, 91),
              "oil \"oil\": warm_temperature = 90; must be > cold_temperature");
}

TEST(Validation, WhatOilDoesToValvesIsANumberAboveZero) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(oil_refusal(&Oil::cold_dead_time_factor, 0),
              "oil \"oil\": cold_dead_time_factor = 0; must be > 0");
    EXPECT_EQ(oil_refusal(&Oil::cold_valve_frequency_factor, -0.4),
              "oil \"oil\": cold_valve_frequency_factor = -0.4; must be > 0");
    EXPECT_EQ(oil_refusal(&Oil::fill_viscosity, 0), "oil \"oil\": fill_viscosity = 0; must be > 0");
    EXPECT_EQ(oil_refusal(&Oil::initial_temperature, nan),
              "oil \"oil\": initial_temperature = nan; must be finite");
    EXPECT_EQ(oil_refusal(&Oil::cold_temperature, nan),
              "oil \"oil\": cold_temperature = nan; must be finite");
}

// ---- converters -------------------------------------------------------------------------------------

using Points = std::vector<std::pair<double, double>>;

std::string converter_refusal(const Points& k, const Points& torque_ratio) {
    Description d;
    d.masses = {mass("engine", 1), mass("turbine", 2)};
    d.converters = {{"c", "engine", "turbine", k, torque_ratio}};
    return refusal(d);
}

TEST(Validation, AConverterTakesTorqueAtEverySpeedRatio) {
    const Points torque_ratio = {{0, 2.5}, {0.85, 1}, {1, 1}};
    EXPECT_EQ(converter_refusal({{0, 6.6}, {1, 12.4}}, torque_ratio), "");
    EXPECT_EQ(converter_refusal({{0, 6.6}, {1, 0}}, torque_ratio),
              "converter \"c\": k_over_speed_ratio is 0 at speed ratio 1; must be > 0");
    EXPECT_EQ(converter_refusal({{0, -6.6}, {1, 12.4}}, torque_ratio),
              "converter \"c\": k_over_speed_ratio is -6.6 at speed ratio 0; must be > 0");
    EXPECT_EQ(converter_refusal({{0, 6.6}, {1.2, 12.4}}, torque_ratio),
              "converter \"c\": k_over_speed_ratio has the speed ratio 1.2; must be within 0 and 1");
    EXPECT_EQ(converter_refusal({{-0.5, 6.6}, {1, 12.4}}, torque_ratio),
              "converter \"c\": k_over_speed_ratio has the speed ratio -0.5; must be within 0 and 1");
}

TEST(Validation, AConverterPassesNoMorePowerThanItTakes) {
    const Points k = {{0, 6.6}, {1, 12.4}};
    EXPECT_EQ(converter_refusal(k, {{0, 2}, {1, 1}}), "") << "ν (2 − ν) is 1 at the end";
    EXPECT_EQ(converter_refusal(k, {{0, 2}, {1, -0.1}}),
              "converter \"c\": torque_ratio_over_speed_ratio is -0.1 at speed ratio 1; must be >= 0");
    EXPECT_EQ(
        converter_refusal(k, {{0, 2}, {0.9, 1.2}}),
        "converter \"c\": torque_ratio_over_speed_ratio is 1.2 at speed ratio 1, more power than goes in; "
        "their product must be <= 1");
    // Both ends pass nothing; between them ν (4 − 4 ν) rises to 1, ν (5 − 5 ν) to 1.25.
    EXPECT_EQ(converter_refusal(k, {{0, 4}, {1, 0}}), "");
    EXPECT_EQ(
        converter_refusal(k, {{0, 5}, {1, 0}}),
        "converter \"c\": torque_ratio_over_speed_ratio is 2.5 at speed ratio 0.5, more power than goes in; "
        "their product must be <= 1");
}

}  // namespace
}  // namespace shiftrig::plant
