#include "io/scenario_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <string>

#include "io/model_file.h"

namespace shiftrig::io {
namespace {

const std::string head = "model: ../tractor.yaml\nduration_s: 6\n";  // lines 1, 2

std::string refusal(const std::string& text) {
    try {
        parse_scenario(text, "config/scenarios/s.yaml");
        return "";
    } catch (const InputError& error) {
        return error.what();
    }
}

SignalTable some_signals() {
    SignalTable table;
    const auto add = [&table](const char* name, plant::Unit unit, double minimum = -1e300,
                              double maximum = 1e300) {
        table.add({name, unit, 0, minimum, maximum, ""});
    };
    add("driver.throttle", plant::Unit::one, 0, 1);
    add("environment.grade", plant::Unit::one, -10, 10);
    add("source.motor.torque", plant::Unit::newton_metre);
    add("mass.engine.speed", plant::Unit::radian_per_second);
    add("mass.vehicle.speed", plant::Unit::metre_per_second);
    add("clutch.F2.pressure_command", plant::Unit::pascal, 0, 20e5);
    return table;
}

std::string signal_refusal(const std::string& text) {
    try {
        check_signals(parse_scenario(head + text, "s.yaml"), some_signals());
        return "";
    } catch (const InputError& error) {
        return error.what();
    }
}

TEST(ScenarioFile, EveryShippedScenarioIsReadAndNamesAModelThatIs) {
    int scenarios = 0;
    for (const auto& entry : std::filesystem::directory_iterator(SHIFTRIG_SOURCE_DIR "/config/scenarios")) {
        if (entry.path().extension() != ".yaml") continue;
        try {
            read_model(read_scenario(entry.path().string()).model_path);
        } catch (const InputError& error) {
            ADD_FAILURE() << error.what();
        }
        ++scenarios;
    }
    EXPECT_GE(scenarios, 1);
}

TEST(ScenarioFile, FindsItsModelFromItsOwnFolder) {
    const auto scenario = parse_scenario(head, "config/scenarios/s.yaml");
    EXPECT_EQ(scenario.model_path, "config/tractor.yaml");
    EXPECT_EQ(scenario.name, "s");
    EXPECT_EQ(scenario.duration, 6);
    EXPECT_FALSE(scenario.bus_faults.IsDefined());
}

TEST(ScenarioFile, SettingsCarryTheirUnitInTheName) {
    const auto scenario =
        parse_scenario(head +
                           "start:\n"
                           "  speeds: {engine_rpm: 1800, vehicle_kmh: 7.2}\n"
                           "  inputs: {clutch.F2.pressure_command_bar: 18, driver.throttle: 0.5}\n"
                           "timeline:\n"
                           "  - {at_s: 3, over_s: 0.5, environment.grade_percent: 15}\n"
                           "  - {at_s: 2, driver.lever: 3, driver.throttle: 1}\n",
                       "s.yaml");
    ASSERT_EQ(scenario.start.speeds.size(), 2u);
    EXPECT_EQ(scenario.start.speeds[0].quantity.signal, "engine");
    EXPECT_DOUBLE_EQ(scenario.start.speeds[0].value, 60 * std::numbers::pi);
    EXPECT_DOUBLE_EQ(scenario.start.speeds[1].value, 2);
    EXPECT_EQ(scenario.start.inputs[0].quantity.signal, "clutch.F2.pressure_command");
    EXPECT_DOUBLE_EQ(scenario.start.inputs[0].value, 18e5);
    EXPECT_EQ(scenario.start.inputs[1].value, 0.5);

    // Sorted by time.
    ASSERT_EQ(scenario.timeline.size(), 3u);
    EXPECT_EQ(scenario.timeline[0].at, 2);
    EXPECT_EQ(scenario.timeline[0].setting.quantity.signal, "driver.lever");
    EXPECT_EQ(scenario.timeline[1].setting.quantity.signal, "driver.throttle");
    EXPECT_EQ(scenario.timeline[2].setting.quantity.signal, "environment.grade");
    EXPECT_DOUBLE_EQ(scenario.timeline[2].setting.value, 0.15);
    EXPECT_EQ(scenario.timeline[2].over, 0.5);
}

TEST(ScenarioFile, ExpectationsAreReadInSi) {
    const auto expect =
        parse_scenario(head +
                           "expect:\n"
                           "  shifts: [{from: F2, to: F3}, {from: F3, to: F4, completed: false}]\n"
                           "  scorecard: [{metric: duration_s, max: 0.6}]\n"
                           "  must: [{kind: lock, device: F3, from_s: 2, until_s: 3}]\n"
                           "  must_not: [{kind: break_away}]\n"
                           "  signals: [{signal: mass.vehicle.speed_kmh, from_s: 1, min: 3.6}]\n"
                           "  final: [{signal: mass.engine.speed_rpm, max: 60}]\n",
                       "s.yaml")
            .expect;
    ASSERT_EQ(expect.shifts.size(), 2u);
    EXPECT_TRUE(expect.shifts_given);
    EXPECT_EQ(parse_scenario(head + "expect:\n  no_shifts: true\n", "s.yaml").expect.no_shifts_line, 4);
    EXPECT_EQ(expect.shifts[1].shift, "F3->F4");
    EXPECT_FALSE(expect.shifts[1].completed);
    EXPECT_EQ(expect.metrics.at(0).maximum, 0.6);
    ASSERT_EQ(expect.events.size(), 2u);
    EXPECT_TRUE(expect.events[0].must);
    EXPECT_EQ(expect.events[0].window.until, 3);
    EXPECT_FALSE(expect.events[1].must);
    ASSERT_EQ(expect.signals.size(), 2u);
    EXPECT_DOUBLE_EQ(expect.signals[0].minimum, 1);
    EXPECT_EQ(expect.signals[0].maximum, INFINITY);
    EXPECT_FALSE(expect.signals[0].at_end());
    EXPECT_TRUE(expect.signals[1].at_end());
    EXPECT_DOUBLE_EQ(expect.signals[1].maximum, 2 * std::numbers::pi);
}

TEST(ScenarioFile, WhatIsWrongIsNamedWithItsPlace) {
    EXPECT_EQ(refusal("model: ../tractor.yaml\n"), "config/scenarios/s.yaml:1:1: duration_s is missing");
    EXPECT_EQ(refusal(head + "timline: []\n"),
              "config/scenarios/s.yaml:3:1: timline is not a known key; nearest: timeline");
    EXPECT_EQ(refusal(head + "bus: {bit_rate: 250000}\n"),
              "config/scenarios/s.yaml:3:1: bus is not a known key; the bit rate of the in-process bus "
              "stands under "
              "bus_faults (bit_rate)");
    EXPECT_EQ(refusal(head + "timeline:\n  - {driver.lever: 3}\n"),
              "config/scenarios/s.yaml:4:5: timeline.at_s is missing");
    EXPECT_EQ(refusal(head + "timeline:\n  - {at_s: 2, throttle: 3}\n"),
              "config/scenarios/s.yaml:4:15: timeline.throttle is not a known key; nearest: note");
    EXPECT_EQ(refusal(head + "expect:\n  must: [{kind: explode}]\n").substr(0, 82),
              "config/scenarios/s.yaml:4:11: expect.must.kind = explode; must be one of lock, bre");
    EXPECT_EQ(refusal(head + "expect:\n  final: [{signal: mass.engine.speed_rpm}]\n"),
              "config/scenarios/s.yaml:4:20: expect: mass.engine.speed_rpm needs min or max");
    EXPECT_EQ(refusal(head + "expect:\n  no_shifts: true\n  shifts: [{from: F1, to: F2}]\n"),
              "config/scenarios/s.yaml:5:12: expect.shifts and no_shifts exclude each other");
}

TEST(ScenarioFile, ASignalTheModelLacksIsNamedWithItsNeighbour) {
    EXPECT_EQ(signal_refusal("start: {inputs: {driver.throttle: 1}}\n"), "");
    EXPECT_EQ(signal_refusal("start: {inputs: {driver.throtle: 1}}\n"),
              "s.yaml:3:18: driver.throtle is no signal of this model; nearest: driver.throttle");
    EXPECT_EQ(signal_refusal("start: {speeds: {motor_rpm: 1}}\n"),
              "s.yaml:3:18: motor_rpm is no signal of this model; nearest: mass.engine.speed");
}

TEST(ScenarioFile, ASignalWithoutItsUnitIsRefused) {
    EXPECT_EQ(signal_refusal("timeline: [{at_s: 1, clutch.F2.pressure_command: 18}]\n"),
              "s.yaml:3:22: clutch.F2.pressure_command must be written with its unit: "
              "clutch.F2.pressure_command ends in "
              "_pa or _bar");
    EXPECT_EQ(signal_refusal("expect: {final: [{signal: mass.vehicle.speed_rpm, min: 1}]}\n"),
              "s.yaml:3:27: mass.vehicle.speed_rpm must be written with its unit: mass.vehicle.speed ends in "
              "_m_s or _kmh");
}

// Nothing is limited in silence: 73 is a percentage that somebody took for a share.
TEST(ScenarioFile, AValueBeyondTheSignalsRangeIsRefusedInTheUnitWritten) {
    EXPECT_EQ(signal_refusal("start: {inputs: {driver.throttle: 73}}\n"),
              "s.yaml:3:18: driver.throttle = 73; must be within 0 and 1");
    EXPECT_EQ(signal_refusal("start: {inputs: {driver.throttle_percent: 73}}\n"), "");
    EXPECT_EQ(signal_refusal("timeline: [{at_s: 1, environment.grade_percent: 1e300}]\n"),
              "s.yaml:3:22: environment.grade_percent = 1e+300; must be within -1000 and 1000");
    EXPECT_EQ(signal_refusal("timeline: [{at_s: 1, clutch.F2.pressure_command_bar: 20.5}]\n"),
              "s.yaml:3:22: clutch.F2.pressure_command_bar = 20.5; must be within 0 and 20");
    EXPECT_EQ(signal_refusal("timeline: [{at_s: 1, clutch.F2.pressure_command_bar: 20}]\n"), "");
    EXPECT_EQ(signal_refusal("timeline: [{at_s: 1, source.motor.torque_nm: -1e9}]\n"), "");
}

TEST(ScenarioFile, NoBoundIsAboveAndBelow) {
    const std::string where = "config/scenarios/s.yaml:5:", expect = head + "expect:\n";
    for (const char* list : {"signals", "final"})
        EXPECT_EQ(refusal(expect + "  " + list + ":\n    - {signal: mass.a.speed_rpm, min: 9, max: 3}\n"),
                  where + "16: expect: mass.a.speed_rpm max = 3; must be at least min = 9");
    EXPECT_EQ(refusal(expect + "  scorecard:\n    - {metric: duration_s, min: 0.5, max: 0.4}\n"),
              where + "7: expect: duration_s max = 0.4; must be at least min = 0.5");
    EXPECT_EQ(refusal(expect + "  scorecard:\n    - {metric: duration_s, min: 0.5, max: 0.5}\n"), "");
}

TEST(ScenarioFile, AMomentThatDoesNothingIsRefused) {
    EXPECT_EQ(refusal(head + "timeline:\n  - {at_s: 0.5, note: nothing}\n"),
              "config/scenarios/s.yaml:4:5: timeline: sets no signal");
    EXPECT_EQ(refusal(head + "timeline:\n  - {at_s: 6, driver.lever: 3}\n"),
              "config/scenarios/s.yaml:4:5: timeline: at_s = 6; must be before the end, duration_s = 6");
    EXPECT_EQ(refusal(head + "timeline:\n  - {at_s: 5.999, over_s: 3, driver.throttle: 1}\n"), "");
}

// Such an expectation would hold whatever happens.
TEST(ScenarioFile, AnEventIsExpectedInAWindowThatHasTimeInIt) {
    const std::string place = "config/scenarios/s.yaml:4:14: expect: lock from_s = ";
    EXPECT_EQ(refusal(head + "expect:\n  must_not: [{kind: lock, from_s: 5, until_s: 2}]\n"),
              place + "5; must be below until_s = 2");
    EXPECT_EQ(refusal(head + "expect:\n  must_not: [{kind: lock, from_s: 2, until_s: 2}]\n"),
              place + "2; must be below until_s = 2");
    EXPECT_EQ(refusal(head + "expect:\n  must_not: [{kind: lock, from_s: 20}]\n"),
              place + "20; must be below duration_s = 6");
    EXPECT_EQ(refusal(head + "expect:\n  must_not: [{kind: lock, from_s: 5.5, until_s: 20}]\n"), "");
}

// What check_events() says of this event, expected of a machine with a device of every kind that tells any.
std::string event_refusal(const std::string& event) {
    static const auto model =
        plant::Model::build(read_model(SHIFTRIG_SOURCE_DIR "/config/tractor.yaml").description);
    try {
        check_events(parse_scenario(head + "expect:\n  must_not: [{" + event + "}]\n", "s.yaml"), model);
        return "";
    } catch (const InputError& error) {
        return error.what();
    }
}

TEST(ScenarioFile, ADeviceThatTellsNoEventsIsNamedWithItsNeighbour) {
    EXPECT_EQ(event_refusal("kind: lock, device: F2"), "");
    EXPECT_EQ(event_refusal("kind: lock"), "");
    EXPECT_EQ(
        event_refusal("kind: lock, device: F22"),
        "s.yaml:4:14: expect: lock of F22: no device of this model has events by that name; nearest: F2");
    EXPECT_EQ(event_refusal("kind: safe_command, device: F2"),
              "s.yaml:4:14: expect: safe_command is of no device: it is the bench's own");
}

TEST(ScenarioFile, AnEventThatItsDeviceNeverTellsIsRefusedWithThoseItDoes) {
    const std::string place = "s.yaml:4:14: expect: ";
    EXPECT_EQ(event_refusal("kind: lock, device: axle_drive"),
              place +
                  "lock of axle_drive never happens; its events are mesh_sticks, mesh_releases, drive_side, "
                  "fall_back");
    EXPECT_EQ(
        event_refusal("kind: mesh_sticks, device: F2"),
        place +
            "mesh_sticks of F2 never happens; its events are lock, break_away, engage, release, tie_up, "
            "fall_back, facing_warning, facing_failure, reverse");
    EXPECT_EQ(event_refusal("kind: break_away, device: engine"),
              place + "break_away of engine never happens; its events are engine_stalls, engine_starts");
    EXPECT_EQ(event_refusal("kind: drive_side, device: axle_drive"), "");
    EXPECT_EQ(event_refusal("kind: facing_failure, device: F2"), "");
    EXPECT_EQ(event_refusal("kind: engine_stalls, device: engine"), "");
}

}  // namespace
}  // namespace shiftrig::io
