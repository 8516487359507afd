#include "io/model_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <numbers>
#include <string>

#include "io/yaml_document.h"

namespace shiftrig::io {
namespace {

const std::string config = SHIFTRIG_SOURCE_DIR "/config/";

// The message a text is refused with; empty if it is accepted.
std::string refusal(const std::string& text) {
    try {
        parse_model(text, "m.yaml");
        return "";
    } catch (const InputError& error) {
        return error.what();
    }
}

// A machine of two masses with room for more devices below.
const std::string two_masses =
    "name: test\n"                    // 1
    "masses:\n"                       // 2
    "  left: {inertia_kg_m2: 1}\n"    // 3
    "  right: {inertia_kg_m2: 2}\n";  // 4

const std::string wet_clutch =
    "clutches:\n"                          // 5
    "  F2:\n"                              // 6
    "    a: left\n"                        // 7
    "    b: right\n"                       // 8
    "    wet_plates:\n"                    // 9
    "      surfaces: 8\n"                  // 10
    "      outer_radius_m: 0.110\n"        // 11
    "      inner_radius_m: 0.085\n"        // 12
    "      piston_area_m2: 0.015\n"        // 13
    "      return_pressure_bar: 1.2\n"     // 14
    "      mu_static: 0.13\n"              // 15
    "      mu_sliding: 0.10\n"             // 16
    "      mu_rise: 0.025\n"               // 17
    "      mu_speed_m_s: 0.3\n"            // 18
    "      clearance_mm: 0.25\n"           // 19
    "    hydraulic:\n"                     // 20
    "      dead_time_s: 0.015\n"           // 21
    "      natural_frequency_rad_s: 60\n"  // 22
    "      damping_ratio: 0.8\n"           // 23
    "      slew_bar_per_s: 150\n"          // 24
    "      maximum_pressure_bar: 18\n"     // 25
    "      preload_pressure_bar: 0.8\n"    // 26
    "      stroke_mm: 2\n"                 // 27
    "      fill_volume_cm3: 30\n"          // 28
    "      fill_flow_l_per_min: 20\n";     // 29

std::string replaced(std::string text, const std::string& what, const std::string& with) {
    const auto at = text.find(what);
    EXPECT_NE(at, std::string::npos) << what;
    return text.replace(at, what.size(), with);
}

// ---- what is right -----------------------------------------------------------------------------------

TEST(ModelFile, EveryShippedModelIsReadAndValid) {
    int models = 0;
    for (const auto& entry : std::filesystem::directory_iterator(config)) {
        if (entry.path().extension() != ".yaml" ||
            read_text(entry.path()).find("\nmasses:") == std::string::npos)
            continue;  // not a model
        EXPECT_NO_THROW(read_model(entry.path().string())) << entry.path();
        ++models;
    }
    EXPECT_GE(models, 9);
}

TEST(ModelFile, FriendlyUnitsBecomeSi) {
    const auto machine = parse_model(two_masses + wet_clutch, "m.yaml").description;
    const auto& clutch = machine.clutches.at(0);
    const auto& wet = std::get<plant::WetPlates>(clutch.friction);
    const auto& valve = std::get<plant::ActuationHydraulic>(clutch.actuation);
    EXPECT_DOUBLE_EQ(wet.return_pressure, 1.2e5);
    EXPECT_DOUBLE_EQ(wet.clearance, 0.25e-3);
    EXPECT_DOUBLE_EQ(valve.slew, 150e5);
    EXPECT_DOUBLE_EQ(valve.maximum_pressure, 18e5);
    EXPECT_DOUBLE_EQ(valve.stroke, 2e-3);
    EXPECT_DOUBLE_EQ(valve.fill_volume, 30e-6);
    EXPECT_DOUBLE_EQ(valve.fill_flow, 20e-3 / 60);
    EXPECT_DOUBLE_EQ(valve.dead_time, 0.015);

    const auto tractor = read_model(config + "tractor.yaml").description;
    EXPECT_DOUBLE_EQ(tractor.engines.at(0).high_idle, 2191 * std::numbers::pi / 30);
    EXPECT_DOUBLE_EQ(tractor.engines.at(0).full_load.at(5).first, 1600 * std::numbers::pi / 30);
    EXPECT_DOUBLE_EQ(tractor.engines.at(0).full_load.at(5).second, 1201);
    EXPECT_DOUBLE_EQ(tractor.ploughs.at(0).depth, 0.23);
}

TEST(ModelFile, TeethBecomeTheRatioOfSpeeds) {
    const auto gear = [](const std::string& keys) {
        return parse_model(two_masses + "gears:\n  g: {a: left, b: right, efficiency: 1, " + keys + "}\n",
                           "m.yaml")
            .description.gears.at(0);
    };
    EXPECT_DOUBLE_EQ(gear("teeth_a: 30, teeth_b: 41").ratio, 41. / 30);
    EXPECT_DOUBLE_EQ(gear("ratio: -1.435").ratio, -1.435);
    EXPECT_DOUBLE_EQ(gear("options: {L: 6, H: 1}, in_use: H").ratio, 1);
}

TEST(ModelFile, AMergedMapYieldsToTheDevicesOwnKeys) {
    const auto tractor = read_model(config + "tractor.yaml").description;
    const auto& f2 = tractor.clutches.at(2);
    EXPECT_EQ(f2.name, "F2");
    EXPECT_EQ(f2.a, "input");
    EXPECT_EQ(f2.b, "pinion_2");
    EXPECT_DOUBLE_EQ(std::get<plant::WetPlates>(f2.friction).outer_radius, 0.110);
}

TEST(ModelFile, HousingMakesABrake) {
    const auto tractor = read_model(config + "tractor.yaml").description;
    EXPECT_EQ(tractor.clutches.back().name, "brake");
    EXPECT_EQ(tractor.clutches.back().b, "");
}

TEST(ModelFile, ChoosingARangePutsItsRatioInUse) {
    auto tractor = read_model(config + "tractor.yaml").description;
    select_option(tractor, "range", "L");
    EXPECT_DOUBLE_EQ(tractor.gears.at(5).ratio, 6.048);
    try {
        select_option(tractor, "range", "X");
        FAIL();
    } catch (const std::invalid_argument& error) {
        EXPECT_STREQ(error.what(), "gear \"range\": no option \"X\"; there are L, M, H");
    }
    EXPECT_THROW(select_option(tractor, "P1", "L"), std::invalid_argument);
}

TEST(ModelFile, EveryCommandedClutchHasASafeCommand) {
    const auto tractor = read_model(config + "tractor.yaml");
    ASSERT_EQ(tractor.controller.safe_commands.size(), 6u);
    EXPECT_EQ(tractor.controller.safe_commands[0].signal, "clutch.Fc.release_command");
    EXPECT_EQ(tractor.controller.safe_commands[0].value, 1);
    EXPECT_EQ(tractor.controller.safe_commands[1].signal, "clutch.F1.pressure_command");
    EXPECT_EQ(tractor.controller.safe_commands[1].value, 0);
    EXPECT_EQ(tractor.controller.safe_commands[1].within, 0.05);
    EXPECT_EQ(tractor.controller.lever.size(), 5u);

    // Not named in the file: it opens within 0.05 s.
    const auto small = parse_model(two_masses + wet_clutch, "m.yaml");
    ASSERT_EQ(small.controller.safe_commands.size(), 1u);
    EXPECT_EQ(small.controller.safe_commands[0].signal, "clutch.F2.pressure_command");
    EXPECT_EQ(small.controller.safe_commands[0].value, 0);
    EXPECT_EQ(small.controller.safe_commands[0].within, 0.05);
    EXPECT_EQ(small.controller.command_timeout, 0.1);
}

TEST(ModelFile, AClutchWithASolenoidIsCommandedByCurrent) {
    const auto file = parse_model(
        two_masses + wet_clutch +
            "      solenoid: {pressure_over_current_a_bar: [[0.2, 0], [1.0, 18]], hysteresis_a: 0.02}\n",
        "m.yaml");
    const auto& valve = std::get<plant::ActuationHydraulic>(file.description.clutches.at(0).actuation);
    ASSERT_TRUE(valve.solenoid);
    EXPECT_EQ(valve.solenoid->pressure_over_current.back(), (std::pair<double, double>{1.0, 18e5}));
    EXPECT_EQ(valve.solenoid->hysteresis, 0.02);
    EXPECT_EQ(file.controller.safe_commands.at(0).signal, "clutch.F2.current_command");
}

TEST(ModelFile, ThePartOfAnotherReaderIsHandedThrough) {
    EXPECT_FALSE(parse_model(two_masses, "m.yaml").can.IsDefined());
    const auto file = parse_model(two_masses + "can:\n  bit_rate: 250000\n", "m.yaml");
    ASSERT_TRUE(file.can.IsDefined());
    EXPECT_EQ(file.can["bit_rate"].as<int>(), 250000);
}

// ---- what is wrong -----------------------------------------------------------------------------------

TEST(ModelFile, TheWorkOfAStepIsBounded) {
    EXPECT_EQ(refusal(two_masses + "maximum_events: 64\nmaximum_parts: 256\n"), "");
    EXPECT_EQ(refusal(two_masses + "maximum_events: 100000000\n"),
              "m.yaml:5:1: maximum_events = 100000000; must be within 1 and 64");
    EXPECT_EQ(refusal(two_masses + "maximum_parts: 257\n"),
              "m.yaml:5:1: maximum_parts = 257; must be within 1 and 256");
    EXPECT_EQ(refusal(two_masses + "maximum_events: 0\n"),
              "m.yaml:5:1: maximum_events = 0; must be within 1 and 64");
}

TEST(ModelFile, AWrongValueIsNamedWithPlaceDeviceKeyValueAndRule) {
    EXPECT_EQ(refusal(replaced(two_masses, "inertia_kg_m2: 1}", "inertia_kg_m2: -2.6}")),
              "m.yaml:3:10: mass \"left\": inertia_kg_m2 = -2.6; must be > 0");
    EXPECT_EQ(refusal(two_masses + replaced(wet_clutch, "radius_m: 0.110", "radius_m: -0.11")),
              "m.yaml:11:7: clutch \"F2\": wet_plates.outer_radius_m = -0.11; must be > 0");
    EXPECT_EQ(refusal(two_masses + replaced(wet_clutch, "stroke_mm: 2", "stroke_mm: two")),
              "m.yaml:27:7: clutch \"F2\": hydraulic.stroke_mm = two; must be a number");
    EXPECT_EQ(refusal(two_masses + replaced(wet_clutch, "surfaces: 8", "surfaces: 8.5")),
              "m.yaml:10:7: clutch \"F2\": wet_plates.surfaces = 8.5; must be a whole number");
    EXPECT_EQ(refusal(two_masses + replaced(wet_clutch, "mu_rise: 0.025", "mu_rise: .nan")),
              "m.yaml:17:7: clutch \"F2\": wet_plates.mu_rise = .nan; must be a finite number");
    EXPECT_EQ(refusal(two_masses + "gears:\n  g: {a: left, b: right, ratio: 2, efficiency: 1.04}\n"),
              "m.yaml:6:36: gear \"g\": efficiency = 1.04; must be > 0 and at most 1");
    EXPECT_EQ(refusal(two_masses + "gears:\n  g: {a: left, b: right, ratio: 0, efficiency: 1}\n"),
              "m.yaml:6:26: gear \"g\": ratio = 0; must not be 0");
}

TEST(ModelFile, NoNumberIsInfinite) {
    EXPECT_EQ(refusal(replaced(two_masses, "inertia_kg_m2: 1}", "inertia_kg_m2: .inf}")),
              "m.yaml:3:10: mass \"left\": inertia_kg_m2 = .inf; must be a finite number");
    EXPECT_EQ(refusal(replaced(two_masses, "inertia_kg_m2: 1}", "inertia_kg_m2: -.inf}")),
              "m.yaml:3:10: mass \"left\": inertia_kg_m2 = -.inf; must be a finite number");
}

TEST(ModelFile, NoMassIsCalledAsTheHousing) {
    EXPECT_EQ(
        refusal(replaced(two_masses, "  left:", "  housing:")),
        "m.yaml:3:3: mass \"housing\": the word stands for the fixed housing, and can be no mass's name");
    EXPECT_EQ(refusal(two_masses + "dampers:\n  housing: {a: left, b: housing, damping_nm_s_per_rad: 1}\n"),
              "");
}

TEST(ModelFile, ALineBreakInANameLeavesTheRefusalOneLine) {
    EXPECT_EQ(refusal(two_masses + "\"two\\nlines\": 1\n"),
              "m.yaml:5:1: two\\nlines is not a known key; nearest: engines");
    EXPECT_EQ(refusal(two_masses + "input_mass: \"a\\tb\\e[2Jc\"\n"),
              "m.yaml:5:1: input_mass = a\\tb\\x1b[2Jc; must name a mass; nearest: left");
}

TEST(ModelFile, AMisspeltKeyIsNamedWithItsNeighbour) {
    EXPECT_EQ(
        refusal(replaced(two_masses, "inertia_kg_m2: 2}", "inertia_kg_m2: 2, inital_speed_rad_s: 3}")),
        "m.yaml:4:29: mass \"right\": inital_speed_rad_s is not a known key; nearest: initial_speed_rad_s");
    // Reported before the key that is missing because of it.
    EXPECT_EQ(
        refusal(two_masses + replaced(wet_clutch, "damping_ratio", "dampin_ratio")),
        "m.yaml:23:7: clutch \"F2\": hydraulic.dampin_ratio is not a known key; nearest: damping_ratio");
    EXPECT_EQ(refusal(two_masses + "cluches: {}\n"),
              "m.yaml:5:1: cluches is not a known key; nearest: clutches");
}

TEST(ModelFile, APhysicalParameterHasNoDefault) {
    EXPECT_EQ(refusal(two_masses + replaced(wet_clutch, "      mu_static: 0.13\n", "")),
              "m.yaml:9:5: clutch \"F2\": wet_plates.mu_static is missing");
    EXPECT_EQ(refusal(two_masses + "gears:\n  g: {a: left, b: right, ratio: 2}\n"),
              "m.yaml:6:3: gear \"g\": efficiency is missing");
    EXPECT_EQ(refusal(replaced(two_masses, "inertia_kg_m2: 1", "")),
              "m.yaml:3:3: mass \"left\": needs one of inertia_kg_m2, mass_kg");
    EXPECT_EQ(refusal(two_masses + replaced(wet_clutch, "    b: right\n", "")),
              "m.yaml:6:3: clutch \"F2\": b is missing");
}

TEST(ModelFile, WhatExcludesEachOtherIsRefused) {
    EXPECT_EQ(refusal(two_masses +
                      "gears:\n  g: {a: left, b: right, ratio: 2, teeth_a: 3, teeth_b: 6, efficiency: 1}\n"),
              "m.yaml:6:36: gear \"g\": teeth_a and ratio exclude each other");
    EXPECT_EQ(
        refusal(two_masses + "gears:\n  g: {a: left, b: right, options: {L: 2}, in_use: M, efficiency: 1}\n"),
        "m.yaml:6:43: gear \"g\": in_use must be one of its options");
}

TEST(ModelFile, ADuplicateKeyIsRefused) {
    EXPECT_EQ(refusal(two_masses + "  left: {inertia_kg_m2: 3}\n"), "m.yaml:5:3: masses left is given twice");
    EXPECT_EQ(refusal(replaced(two_masses, "inertia_kg_m2: 1", "inertia_kg_m2: 1, inertia_kg_m2: 2")),
              "m.yaml:3:28: mass \"left\": inertia_kg_m2 is given twice");
}

TEST(ModelFile, TwoShaftsJoinedWithoutAMassAreBothNamed) {
    EXPECT_EQ(refusal(two_masses +
                      "shafts:\n"
                      "  s1: {a: left, b: joint, stiffness_nm_per_rad: 100, damping_nm_s_per_rad: 0}\n"
                      "  s2: {a: joint, b: right, stiffness_nm_per_rad: 100, damping_nm_s_per_rad: 0}\n"),
              "m.yaml:6:17: shaft \"s1\": b = \"joint\" is not a mass: shaft \"s1\" and shaft \"s2\" meet "
              "there without "
              "a mass between them (regularity rule)");
}

TEST(ModelFile, AMisspeltMassIsNamedWithItsNeighbour) {
    EXPECT_EQ(refusal(two_masses + "gears:\n  g: {a: left, b: rihgt, ratio: 2, efficiency: 1}\n"),
              "m.yaml:6:16: gear \"g\": b = \"rihgt\" is not a mass; nearest: right");
}

TEST(ModelFile, WhatThePlantRefusesIsShownAsWritten) {
    EXPECT_EQ(refusal(two_masses + replaced(wet_clutch, "inner_radius_m: 0.085", "inner_radius_m: 0.2")),
              "m.yaml:12:7: clutch \"F2\": wet_plates.inner_radius_m = 0.2; must be < outer_radius");
    EXPECT_EQ(
        refusal(two_masses + replaced(wet_clutch, "preload_pressure_bar: 0.8", "preload_pressure_bar: 5")),
        "m.yaml:26:7: clutch \"F2\": hydraulic.preload_pressure_bar = 5; must be <= return_pressure");
    const std::string engine =
        "engines:\n"
        "  e: {mass: left, full_load_rpm_nm: [[700, 550], [2154, 729]], governor_slope_nm_s_per_rad: 187,\n"
        "      low_idle_rpm: 900, high_idle_rpm: 800, friction_constant_nm: 70,\n"
        "      friction_per_speed_nm_s_per_rad: 0.45, actuator_lag_s: 0.04, turbo_instant_fraction: 0.62,\n"
        "      turbo_lag_s: 0.5, fade_from_rpm: 700, fade_to_rpm: 500, stall_speed_rpm: 400}\n";
    EXPECT_EQ(refusal(two_masses + engine),
              "m.yaml:7:26: engine \"e\": high_idle_rpm = 800; must be > low_idle");
    EXPECT_EQ(refusal(two_masses + replaced(engine, "low_idle_rpm: 900", "cylinders: 0, low_idle_rpm: 900")),
              "m.yaml:7:7: engine \"e\": cylinders = 0; must be at least 1");
    EXPECT_EQ(refusal(two_masses + replaced(engine, "[2154, 729]", "[700, 729]")),
              "m.yaml:6:50: engine \"e\": full_load_rpm_nm = [700, 729]; x must rise from pair to pair");
}

TEST(ModelFile, OilIsWarmAboveItsColdTemperature) {
    const std::string oil =
        "oil: {viscosity_at_zero_pa_s: 0.5, viscosity_decay_per_degc: 0.0414, initial_temperature_degc: 90,\n"
        "      drag_speed_limit_rad_s: 60, cold_temperature_degc: -10, warm_temperature_degc: 90,\n"
        "      cold_dead_time_factor: 4, cold_valve_frequency_factor: 0.4, fill_viscosity_pa_s: 0.1,\n"
        "      pump_flow_l_per_min: 60}\n";
    EXPECT_EQ(refusal(two_masses + oil), "");
    EXPECT_EQ(refusal(two_masses + replaced(oil, "warm_temperature_degc: 90", "warm_temperature_degc: -10")),
              "m.yaml:6:63: oil.warm_temperature_degc = -10; must be > cold_temperature");
}

TEST(ModelFile, APointOfATableIsNamedWithItsOwnPlace) {
    const std::string converter =
        "converters:\n"
        "  c:\n"
        "    pump: left\n"
        "    turbine: right\n"
        "    k_over_speed_ratio_rad_s_per_sqrt_nm: [[0, 6.6], [1, 12.4]]\n"  // 9
        "    torque_ratio_over_speed_ratio: [[0, 2], [1, 1]]\n";             // 10
    EXPECT_EQ(refusal(two_masses + replaced(converter, "[1, 12.4]", "[1, 0]")),
              "m.yaml:9:54: converter \"c\": k_over_speed_ratio_rad_s_per_sqrt_nm = [1, 0]; y must be > 0");
    EXPECT_EQ(refusal(two_masses + replaced(converter, "[1, 12.4]", "[1.5, 12.4]")),
              "m.yaml:9:54: converter \"c\": k_over_speed_ratio_rad_s_per_sqrt_nm = [1.5, 12.4]; x must be "
              "within 0 and 1");
    EXPECT_EQ(refusal(two_masses + replaced(converter, "[1, 1]", "[1, -1]")),
              "m.yaml:10:45: converter \"c\": torque_ratio_over_speed_ratio = [1, -1]; y must be at least 0");
    EXPECT_EQ(refusal(two_masses + replaced(converter, "[1, 1]", "[1, 1.1]")),
              "m.yaml:10:5: converter \"c\": torque_ratio_over_speed_ratio is 1.1 at speed ratio 1, more "
              "power than goes in; their product must be <= 1");
}

TEST(ModelFile, GearPathsAndSafeCommandsNameClutchesThereAre) {
    EXPECT_EQ(refusal(two_masses + wet_clutch + "gear_paths:\n  one: {closed: [F1]}\n"),
              "m.yaml:31:9: gear path \"one\": closed = F1; must name a clutch; nearest: F2");
    EXPECT_EQ(refusal(two_masses + wet_clutch + "gear_paths:\n  one: {closed: [F2, F2]}\n"),
              "m.yaml:31:9: gear path \"one\": closed = F2; must be named once");
    EXPECT_EQ(refusal(two_masses + wet_clutch +
                      "gear_paths:\n  one: {closed: [F2], lever: 1}\n  two: {closed: [F2], lever: 1}\n"),
              "m.yaml:32:23: gear path \"two\": lever = 1; is taken by \"one\"");
    EXPECT_EQ(
        refusal(
            two_masses + wet_clutch +
            "controller:\n  command_timeout_s: 0.1\n  safe_command:\n    F2: {release: 1, within_s: 0.1}\n"),
        "m.yaml:33:5: safe command \"F2\": must set its pressure_command");
    EXPECT_EQ(refusal(two_masses + wet_clutch + "controller: {command_timeout_s: 0.1, pedal_clutch: F2}\n"),
              "m.yaml:30:38: controller.pedal_clutch = F2; must be a clutch with release");
    EXPECT_EQ(refusal(two_masses + "output_mass: rihgt\n"),
              "m.yaml:5:1: output_mass = rihgt; must name a mass; nearest: right");
}

TEST(ModelFile, BrokenYamlIsNamedWithItsPlace) {
    EXPECT_EQ(refusal("name: [a\nmasses: }\n"), "m.yaml:2:7: not valid YAML: end of sequence flow not found");
    EXPECT_EQ(refusal(""), "m.yaml:1:1: the file is empty");
    EXPECT_EQ(refusal("- a\n- b\n"), "m.yaml:1:1: the file = [a, b]; must be a map of key: value");
    EXPECT_EQ(refusal(two_masses + "gears:\n  g: [1, 2]\n"),
              "m.yaml:6:3: gear \"g\": = [1, 2]; must be a map of key: value");
    EXPECT_EQ(refusal(two_masses + "gears: {\"a.b\": {}}\n"),
              "m.yaml:5:9: gear \"a.b\": a name is made of letters, digits and _");
}

TEST(ModelFile, AliasesThatNeverEndAreRefused) {
    EXPECT_EQ(refusal("name: x\nmasses: &m\n  <<: *m\n"),
              "m.yaml:2:9: an alias names the map or list it stands in");
    std::string bomb = "name: x\ntemplates:\n  a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
    for (int i = 1; i < 9; ++i) {
        const std::string last = "*a" + std::to_string(i - 1);
        bomb += "  a" + std::to_string(i) + ": &a" + std::to_string(i) + " [" + last;
        for (int k = 1; k < 10; ++k) bomb += ", " + last;
        bomb += "]\n";
    }
    EXPECT_NE(refusal(bomb).find("aliases unfold into too much"), std::string::npos);
}

TEST(ModelFile, AMissingFileIsNamed) {
    try {
        read_model("nosuch.yaml");
        FAIL();
    } catch (const InputError& error) {
        EXPECT_STREQ(error.what(), "nosuch.yaml: cannot be read: No such file or directory");
    }
}

TEST(ModelFile, ADeadTimeFitsIntoMemory) {
    EXPECT_EQ(refusal(two_masses + replaced(wet_clutch, "dead_time_s: 0.015", "dead_time_s: 1e300")),
              "m.yaml:21:7: clutch \"F2\": hydraulic.dead_time_s = 1e300; must be within 0 and 10");
    const auto file =
        parse_model(two_masses + replaced(wet_clutch, "dead_time_s: 0.015", "dead_time_s: 10"), "m.yaml");
    plant::BuildOptions options;
    EXPECT_NO_THROW(build_model(file, options));
    options.step_size = 1e-8;  // 100 kHz, 1000 substeps
    try {
        build_model(file, options);
        FAIL() << "was built";
    } catch (const InputError& error) {
        EXPECT_STREQ(error.what(),
                     "m.yaml:21:7: clutch \"F2\": hydraulic.dead_time_s = 10; must be at most "
                     "1000000 steps of 1e-08 s in the coldest oil");
    }
}

TEST(ModelFile, FrictionDoesNotDrive) {
    const std::string dry =
        "clutches:\n"
        "  C:\n"
        "    a: left\n"
        "    b: right\n"
        "    dry: {sliding_capacity_nm: 100, static_ratio: 1.2,\n"
        "          factor_over_slip_rad_s: [[0, 1], [10, 0]]}\n"  // 10
        "    direct: {}\n";
    EXPECT_EQ(refusal(two_masses + dry), "");
    EXPECT_EQ(refusal(two_masses + replaced(dry, "[10, 0]", "[10, -0.5]")),
              "m.yaml:10:44: clutch \"C\": dry.factor_over_slip_rad_s = [10, -0.5]; y must be at least 0");
}

}  // namespace
}  // namespace shiftrig::io
