// The reference controller's decisions, on sensors written by hand. Whether its shifts are any good is asked of the
// whole bench (rig tests).
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <numbers>

#include "apps/tcu/controller.h"
#include "io/input_error.h"

namespace shiftrig::tcu {
namespace {

const Calibration& calibration() {
    static const Calibration cal = read_calibration(SHIFTRIG_SOURCE_DIR "/config/calibration/tractor.yaml");
    return cal;
}

constexpr double rpm = 2 * std::numbers::pi / 60;

// A machine at speed in a gear, its clutch at full pressure, and a controller that has adopted it.
struct Bench {
    Controller controller{calibration()};
    Sensors s;
    Commands c;

    explicit Bench(int gear, double engine_rpm = 1800, double engine_torque = 600) {
        s.lever = gear;
        s.engine_speed = s.disc_speed = s.input_speed = engine_rpm * rpm;
        s.engine_torque = engine_torque;
        s.output_speed = s.input_speed / ratio(gear);
        pressure(gear) = calibration().clutch.full_pressure;
        s.speeds_alive = s.engine_alive = s.lever_alive = s.pressures_alive = true;
        cycle();
    }
    static double ratio(int gear) {
        return calibration().machine.ratio[static_cast<std::size_t>(clutch_of(gear))];
    }
    double& pressure(int gear) { return s.pressure[static_cast<std::size_t>(clutch_of(gear))]; }
    double command(int gear) const { return c.pressure[static_cast<std::size_t>(clutch_of(gear))]; }
    void cycle(double seconds = 0.01) {
        for (int i = 0; i < std::lround(seconds / calibration().period); ++i) c = controller.step(s);
    }
    double sum_of_commands() const {
        double sum = 0;
        for (const double p : c.pressure) sum += p;
        return sum;
    }
};

TEST(Controller, ControllerThatRestartsTakesOverTheGearItFindsLocked) {
    for (const int gear : {-1, 1, 2, 3, 4}) {
        Bench bench(gear);
        EXPECT_EQ(bench.c.mode, Mode::driving);
        EXPECT_EQ(bench.c.current_gear, gear);
        EXPECT_EQ(bench.command(gear), calibration().clutch.full_pressure);
        EXPECT_EQ(bench.sum_of_commands(), calibration().clutch.full_pressure);
    }
}

TEST(Controller, NothingIsCommandedBeforeTheMachineIsHeard) {
    Bench bench(2);
    bench.controller = Controller(calibration());
    bench.s.lever_alive = false;
    bench.cycle(1);
    EXPECT_EQ(bench.c.mode, Mode::listening);
    bench.s.lever_alive = true;
    bench.cycle();
    EXPECT_EQ(bench.c.mode, Mode::driving);
}

TEST(Controller, LeverOneUpHandsTheTorqueToTheNextClutch) {
    Bench bench(2);
    bench.s.lever = 3;
    bench.cycle();
    bench.cycle();
    ASSERT_EQ(bench.c.mode, Mode::shift);
    EXPECT_EQ(bench.c.selected_gear, 3);
    EXPECT_EQ(bench.command(3), calibration().clutch.fill_pressure);
    bench.pressure(3) = calibration().clutch.kiss_pressure;  // filled
    bench.cycle(0.02 + calibration().shift.torque_time);
    EXPECT_EQ(bench.command(2), 0);
    // The clutch that pulls carries the engine's torque and what slows the input's inertia, T + J Δω/t.
    const double slip = bench.s.input_speed - Bench::ratio(3) * bench.s.output_speed;
    const double least =
        calibration().pressure_for(bench.s.engine_torque + calibration().machine.input_inertia * slip /
                                                               calibration().shift.inertia_time);
    EXPECT_GE(bench.command(3), least * (1 - 1e-12));
    // The input runs at its new speed: the clutch is locked, and pressed to the full.
    bench.s.input_speed = bench.s.engine_speed = Bench::ratio(3) * bench.s.output_speed;
    bench.cycle(0.5);
    EXPECT_EQ(bench.c.current_gear, 3);
    EXPECT_EQ(bench.command(3), calibration().clutch.full_pressure);
}

TEST(Controller, PowerDownshiftLetsTheOffgoingClutchSlipFirst) {
    Bench bench(3);
    bench.s.lever = 2;
    bench.cycle(0.02);
    ASSERT_EQ(bench.c.mode, Mode::shift);
    bench.pressure(2) = calibration().clutch.kiss_pressure;
    bench.cycle(0.05);
    EXPECT_EQ(bench.command(2), calibration().clutch.touch_pressure);
    const double carries = calibration().pressure_for(bench.s.engine_torque);
    EXPECT_LT(bench.command(3), carries);  // less than the engine gives: the input speeds up
    EXPECT_GT(bench.command(3), calibration().clutch.touch_pressure);
    // The governor would hold the engine at the driver's speed: the new one is asked of it.
    EXPECT_GT(bench.c.engine_speed_request, Bench::ratio(2) * bench.s.output_speed);
    // It passes its new speed: the oncoming clutch catches it at once.
    bench.s.input_speed = bench.s.engine_speed = 1.02 * Bench::ratio(2) * bench.s.output_speed;
    bench.cycle(0.02 + calibration().shift.torque_time);
    EXPECT_EQ(bench.command(3), 0);
    EXPECT_GE(bench.command(2), calibration().pressure_for(bench.s.engine_torque));
}

TEST(Controller, UpshiftThatTheEngineCouldNotBearIsRefused) {
    // 970 Nm at 1790 rpm in F3 would be 1149 Nm at 1511 rpm in F4, 0.97 of full load there.
    Bench bench(3, 1790, 970);
    bench.s.lever = 4;
    for (int i = 0; i < 300; ++i) {
        bench.cycle();
        ASSERT_EQ(bench.c.mode, Mode::driving);
    }
    EXPECT_EQ(bench.c.mode, Mode::driving);
    EXPECT_EQ(bench.c.current_gear, 3);
    // The plough comes out: the same lever is obeyed.
    bench.s.engine_torque = 500;
    bench.cycle(1);
    EXPECT_EQ(bench.c.selected_gear, 4);
}

TEST(Controller, LuggingEngineGetsTheLowerGearBackAndTheUpshiftStaysRefused) {
    Bench bench(4, 1500, 1180);
    bench.cycle(calibration().choice.lug_time + 0.02);
    EXPECT_EQ(bench.c.mode, Mode::shift);
    EXPECT_EQ(bench.c.selected_gear, 3);
}

TEST(Controller, LeverTakenBackDuringTheFillKeepsTheOldGear) {
    Bench bench(2);
    bench.s.lever = 3;
    bench.cycle(0.03);
    ASSERT_EQ(bench.c.mode, Mode::shift);
    bench.s.lever = 2;
    bench.cycle(0.5);
    EXPECT_EQ(bench.c.mode, Mode::driving);
    EXPECT_EQ(bench.c.current_gear, 2);
    EXPECT_EQ(bench.command(2), calibration().clutch.full_pressure);
    EXPECT_EQ(bench.command(3), 0);
}

TEST(Controller, ShiftThatDoesNotComeToAnEndGivesTheOldGearBack) {
    Bench bench(2);
    bench.s.lever = 3;
    bench.cycle(0.02);
    bench.pressure(3) = calibration().clutch.kiss_pressure;
    bench.cycle(calibration().shift.torque_time + calibration().shift.timeout +
                0.5);  // the slip never vanishes
    EXPECT_EQ(bench.c.current_gear, 2);
    EXPECT_EQ(bench.command(3), 0);
    EXPECT_EQ(bench.command(2), calibration().clutch.full_pressure);
    bench.cycle(2);
    EXPECT_EQ(bench.c.current_gear, 2) << "tried again at once";
}

TEST(Controller, SilentSignalsInGearHoldTheGear) {
    Bench bench(3);
    bench.s.speeds_alive = false;
    bench.s.lever = 4;
    bench.cycle(5);
    EXPECT_EQ(bench.c.mode, Mode::limp);
    EXPECT_EQ(bench.command(3), calibration().clutch.full_pressure);
    bench.s.lever = 3;
    bench.s.speeds_alive = true;
    bench.cycle(calibration().limp.recovery_time + 0.02);
    EXPECT_EQ(bench.c.mode, Mode::driving);
    EXPECT_EQ(bench.c.current_gear, 3);
}

TEST(Controller, SilentSignalsInMidShiftOpenEverything) {
    Bench bench(2);
    bench.s.lever = 3;
    bench.cycle(0.03);
    ASSERT_EQ(bench.c.mode, Mode::shift);
    bench.s.engine_alive = false;
    bench.cycle();
    EXPECT_EQ(bench.c.mode, Mode::limp);
    EXPECT_EQ(bench.sum_of_commands(), 0);
}

TEST(Controller, ShaftThatReadsAsStandingInGearIsALostSensorAndHoldsTheGear) {
    Bench bench(2);
    bench.s.output_speed = 0;
    bench.cycle(5);
    EXPECT_EQ(bench.c.mode, Mode::limp);
    EXPECT_EQ(bench.command(2), calibration().clutch.full_pressure);
}

TEST(Controller, ClutchThatDoesNotHoldIsOpened) {
    Bench bench(2);
    bench.s.output_speed *= 0.7;
    bench.cycle(calibration().limp.slip_time + 0.05);
    EXPECT_EQ(bench.c.mode, Mode::neutral);
    EXPECT_EQ(bench.sum_of_commands(), 0);
    bench.cycle(2);
    EXPECT_EQ(bench.c.mode, Mode::neutral) << "closed again although the lever did not move";
}

TEST(Controller, DrivelineOpensBeforeTheBrakeStallsTheEngine) {
    Bench bench(2, 840, 100);
    EXPECT_EQ(bench.c.mode, Mode::driving);
    bench.s.brake = 1;
    bench.cycle(0.02);
    EXPECT_EQ(bench.c.mode, Mode::neutral);
    EXPECT_EQ(bench.sum_of_commands(), 0);
}

TEST(Controller, EngineThatFallsFastIsSavedBeforeItIsSlow) {
    Bench bench(2, 900, 500);
    EXPECT_EQ(bench.c.mode, Mode::driving);
    for (int i = 0; i < 10; ++i) {  // 1200 rpm a second
        bench.s.engine_speed -= 12 * rpm;
        bench.s.input_speed = bench.s.engine_speed;
        bench.s.output_speed = bench.s.input_speed / Bench::ratio(2);
        bench.cycle();
    }
    EXPECT_GT(bench.s.engine_speed, calibration().stop.stall_guard_speed);
    EXPECT_EQ(bench.c.mode, Mode::neutral);
}

TEST(Controller, ReverseIsEngagedOnlyBelowTheReversalSpeed) {
    Bench bench(2);
    bench.s.lever = -1;
    bench.cycle(0.5);
    EXPECT_EQ(bench.c.mode, Mode::neutral);
    bench.s.output_speed = 0.9 * calibration().launch.highest_reversal_speed;
    bench.cycle(0.02);
    EXPECT_EQ(bench.c.mode, Mode::launch);
    EXPECT_EQ(bench.command(-1), calibration().clutch.fill_pressure);
}

TEST(Controller, StandingStartRaisesTheTorqueAndYieldsToADroopingEngine) {
    Bench bench(2);
    bench.controller = Controller(calibration());
    bench.s.lever = 0;
    bench.s.pressure = {};
    bench.s.output_speed = 0;
    bench.cycle(0.1);
    ASSERT_EQ(bench.c.mode, Mode::neutral);
    bench.s.lever = 1;
    bench.cycle(0.02);
    ASSERT_EQ(bench.c.mode, Mode::launch);
    bench.pressure(1) = calibration().clutch.kiss_pressure;
    bench.cycle(1);
    const double pulling = bench.command(1);
    EXPECT_DOUBLE_EQ(pulling, calibration().pressure_for(calibration().launch.torque));
    const double before = bench.s.engine_speed;
    for (int i = 1; i <= 50; ++i) {
        bench.s.engine_speed = before * (1 - calibration().launch.engine_droop / 2 * i / 50);
        bench.cycle();
    }
    EXPECT_NEAR(bench.command(1), calibration().pressure_for(calibration().launch.torque / 2), 1);
}

TEST(Calibration, WrongKeyIsNamedWithItsPlace) {
    const std::string path = testing::TempDir() + "wrong_calibration.yaml";
    std::ofstream(path) << "period_s: 0.01\nmachines: {}\n";
    try {
        read_calibration(path);
        FAIL() << "was read";
    } catch (const io::InputError& error) {
        EXPECT_EQ(std::string(error.what()), path + ":2:1: machines is not a known key; nearest: machine");
    }
}

TEST(Calibration, TouchPressureBeyondTheFullOneIsRefused) {
    std::ifstream shipped(SHIFTRIG_SOURCE_DIR "/config/calibration/tractor.yaml");
    std::string text{std::istreambuf_iterator<char>(shipped), {}};
    const auto at = text.find("touch_pressure_bar:");
    ASSERT_NE(at, std::string::npos);
    text.replace(at, text.find('\n', at) - at, "touch_pressure_bar: 40");
    const std::string path = testing::TempDir() + "touch_calibration.yaml";
    std::ofstream(path) << text;
    try {
        read_calibration(path);
        FAIL() << "was read";
    } catch (const io::InputError& error) {
        const auto line = std::to_string(
            1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n'));
        EXPECT_EQ(
            std::string(error.what()),
            path + ":" + line + ":3: clutch.touch_pressure_bar = 40; must be at most full_pressure_bar");
    }
}

}  // namespace
}  // namespace shiftrig::tcu
