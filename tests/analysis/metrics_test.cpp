// Every metric on a signal whose answer is worked out by hand. Unless said otherwise the shift is that of
// synthetic_run.h: asked for at 5.0 s, ended at 5.676 s, settled at 6.676 s.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "analysis/filter.h"
#include "analysis/scorecard.h"
#include "tests/analysis/synthetic_run.h"

namespace shiftrig::analysis {
namespace {

constexpr double pi = std::numbers::pi;

ShiftScore only_shift(const SyntheticRun& synthetic) {
    const Scorecard card = score(synthetic.run);
    EXPECT_EQ(card.shifts.size(), 1u);
    return card.shifts.at(0);
}

double metric(const SyntheticRun& synthetic, const std::string& name) {
    const ShiftScore shift = only_shift(synthetic);
    const Metric* found = shift.find(name);
    EXPECT_NE(found, nullptr) << name;
    EXPECT_TRUE(found != nullptr && found->value) << name;
    return found != nullptr && found->value ? *found->value : std::nan("");
}

TEST(Metrics, Duration) {
    EXPECT_NEAR(metric(upshift(), "duration_s"), 0.676, 1e-3);
}

// a = A sin(π(t − 5)): its mean over [4.7, 5] is −A(1 − cos 0.3π)/(0.3π), its greatest value A at 5.5 s; the filter
// passes 0.5 Hz but for 6 parts in a million.
TEST(Metrics, PeakAccelerationChangeIsAgainstTheMeanBefore) {
    SyntheticRun synthetic = upshift();
    const double amplitude = 1.3;
    synthetic.set("body.vehicle.acceleration", [=](double t) { return amplitude * std::sin(pi * (t - 5)); });
    const double mean = -amplitude * (1 - std::cos(0.3 * pi)) / (0.3 * pi);
    EXPECT_NEAR(metric(synthetic, "peak_acceleration_change_m_s2"), amplitude - mean, 1e-3);
}

TEST(Metrics, PeakAccelerationChangeDoesNotSeeWhatVibratesAbove10Hz) {
    SyntheticRun synthetic = upshift();
    synthetic.set("body.vehicle.acceleration", [](double t) { return 5 * std::sin(2 * pi * 100 * t); });
    EXPECT_NEAR(metric(synthetic, "peak_acceleration_change_m_s2"), 0, 1e-3);
}

// Two whole periods in the window [t_a, t_s]: A·|W_d|·(3/8·T)^¼, whatever the phase.
TEST(Metrics, VibrationDoseRunsToOneSecondAfterCompletion) {
    SyntheticRun synthetic = upshift();
    const Shift shift = only_shift(synthetic).shift;
    const double window = synthetic.run.time[shift.settled] - shift.asked_at;
    EXPECT_NEAR(window, 1.676, 1e-3);
    const double frequency = 2 / window, amplitude = 0.8;
    synthetic.set("body.vehicle.acceleration",
                  [=](double t) { return amplitude * std::sin(2 * pi * frequency * t); });
    const double expected =
        amplitude * weight_horizontal_gain(frequency, 1e-3) * std::pow(3.0 / 8 * window, 0.25);
    EXPECT_NEAR(metric(synthetic, "vdv_m_s1_75"), expected, 1e-3 * expected);
}

// A sin(2πt): the greatest slope is 2πA, times the filter's gain at 1 Hz.
TEST(Metrics, PeakJerk) {
    SyntheticRun synthetic = upshift();
    synthetic.set("body.vehicle.acceleration", [](double t) { return 0.5 * std::sin(2 * pi * t); });
    EXPECT_NEAR(metric(synthetic, "peak_jerk_m_s3"), 2 * pi * 0.5 / (1 + 1e-4), 2e-4);
}

TEST(Metrics, SpeedDip) {
    SyntheticRun synthetic = upshift();
    synthetic.set("mass.vehicle.speed", [](double t) { return t < 5.2 ? 2 : t < 5.9 ? 1.76 : 2.2; });
    EXPECT_NEAR(metric(synthetic, "speed_dip_percent"), 12, 1e-9);
    synthetic.set("mass.vehicle.speed", ramp(5, 6, 2, 3));
    EXPECT_NEAR(metric(synthetic, "speed_dip_percent"), 0, 1e-9);
    synthetic.set("mass.vehicle.speed", [](double t) { return t < 5.2 ? -2 : -1.5; });  // in reverse
    EXPECT_NEAR(metric(synthetic, "speed_dip_percent"), 25, 1e-9);
}

TEST(Metrics, ClutchEnergyIsTheHeatBetweenAskingAndSettling) {
    SyntheticRun synthetic = upshift();
    synthetic.set("clutch.B.heat",
                  [](double t) { return 100 + ramp(5.2, 6.0, 0, 3000)(t) + ramp(7, 8, 0, 9000)(t); });
    synthetic.set("clutch.A.heat", ramp(4.0, 6.0, 0, 800));
    EXPECT_NEAR(metric(synthetic, "clutch_energy_j.B"), 3000, 1e-6);
    EXPECT_NEAR(metric(synthetic, "clutch_energy_j.A"), 400, 1e-6);
}

TEST(Metrics, OtherClutchesAreToldOnlyIfTheyTookHeat) {
    SyntheticRun synthetic = upshift();
    EXPECT_EQ(only_shift(synthetic).find("clutch_energy_j.Fc"), nullptr);
    synthetic.set("clutch.Fc.heat", ramp(5.2, 6.0, 0, 250));
    EXPECT_NEAR(metric(synthetic, "clutch_energy_j.Fc"), 250, 1e-6);
}

TEST(Metrics, ClutchPeakPowerAndTemperature) {
    SyntheticRun synthetic = upshift();
    synthetic.set("clutch.B.heat_power", [](double t) { return t < 5.3 ? 0 : 4e4 * std::exp(-(t - 5.3)); });
    synthetic.set("clutch.B.temperature",
                  [](double t) { return 90 + 60 * std::exp(-std::pow((t - 6) / 0.2, 2)); });
    EXPECT_NEAR(metric(synthetic, "clutch_peak_power_w.B"), 4e4, 1e-6);
    EXPECT_NEAR(metric(synthetic, "clutch_temperature_degc.B"), 150, 1e-9);
}

// A raised-cosine dip of 0.6 s by 60 %: at 1/0.6 Hz the filter takes (f/10)⁴ = 0.08 % of its swing, and rounds its
// corners.
TEST(Metrics, TorqueHole) {
    SyntheticRun synthetic = upshift();
    synthetic.set("shaft.axle.torque", [](double t) {
        return t < 5 || t > 5.6 ? 2000. : 2000 - 600 * (1 - std::cos(2 * pi * (t - 5) / 0.6));
    });
    EXPECT_NEAR(metric(synthetic, "torque_hole_percent"), 60, 0.1);
}

TEST(Metrics, TorqueThatReversesIsAHoleOfMoreThanTheWhole) {
    SyntheticRun synthetic = upshift();
    synthetic.set("shaft.axle.torque", [](double t) { return t < 5.2 || t > 5.6 ? -2000. : 500.; });
    EXPECT_GT(metric(synthetic, "torque_hole_percent"), 120);
}

TEST(Metrics, TorqueHoleHasNoMeaningOnTheOverrun) {
    SyntheticRun synthetic = upshift();
    synthetic.set("engine.engine.torque", -80);
    EXPECT_FALSE(only_shift(synthetic).find("torque_hole_percent")->value);
}

TEST(Metrics, SlipTimeOfThePairsThatShouldHold) {
    SyntheticRun synthetic = upshift();
    synthetic.set("clutch.Fc.state",
                  [](double t) { return t > 5.4 - 1e-9 && t < 5.65 - 1e-9 ? slipping : locked; });
    synthetic.set("clutch.Fw.state", [](double t) { return t > 7 ? slipping : locked; });
    EXPECT_NEAR(metric(synthetic, "slip_time_s.Fc"), 0.25, 1e-9);
    EXPECT_NEAR(metric(synthetic, "slip_time_s.Fw"), 0, 1e-9);
    EXPECT_EQ(only_shift(synthetic).find("slip_time_s.B"), nullptr);
}

TEST(Metrics, WhatSelectsTheOnlyGearIsNoPairThatShouldHold) {
    SyntheticRun synthetic = driving_in_a();
    synthetic.run.machine.gear_paths.resize(1);
    synthetic.set("clutch.A.engagement", step(5, 0, 1)).set("clutch.A.state", step(5.5, slipping, locked));
    synthetic.set_input_speed(ramp(5, 5.5, 200, 120));
    const ShiftScore shift = only_shift(synthetic);
    EXPECT_EQ(shift.shift.label(), "N->A");
    EXPECT_EQ(shift.find("slip_time_s.A"), nullptr);
    EXPECT_EQ(shift.find("slip_time_s.Fc"), nullptr);
    EXPECT_NE(shift.find("slip_time_s.Fw"), nullptr);
}

TEST(Metrics, FillTimeIsFromTheCommandToTheKissPoint) {
    EXPECT_NEAR(metric(upshift(), "fill_time_s"), 0.1, 1e-9);
}

// B carries from 5.2 s, 600 Nm at 5.3 s; A carries 500 Nm until 5.3 s; 5 % of 500 are 25 Nm, reached at 5.2042 s.
TEST(Metrics, TorquePhaseIsWhileBothCarry) {
    SyntheticRun synthetic = upshift();
    synthetic.set("clutch.A.torque", step(5.3, 500, 0)).set("clutch.B.torque", ramp(5.2, 5.3, 0, 600));
    EXPECT_NEAR(metric(synthetic, "torque_phase_s"), 0.1 * (1 - 25.0 / 600), 1e-3);
}

// A's slip 75(t − 5.3) passes 2 % of the input's 120 − 75(t − 5.3) at 5.3 + 2.4/76.5.
TEST(Metrics, InertiaPhaseIsFromLeavingTheOldRatioToReachingTheNew) {
    EXPECT_NEAR(metric(upshift(), "inertia_phase_s"), 5.676 - (5.3 + 2.4 / 76.5), 2e-3);
}

TEST(Metrics, FlareIsTheExcessOverBothGears) {
    SyntheticRun synthetic = upshift();
    EXPECT_NEAR(metric(synthetic, "flare_rad_s"), 0, 1e-9);
    const Formula input = [](double t) {
        return t < 5.3 ? 120 : t < 5.35 ? 127. : ramp(5.35, 5.7, 127, 90)(t);
    };
    synthetic.set_input_speed(input);
    synthetic.set("clutch.A.slip", [input](double t) { return input(t) - 120; });
    synthetic.set("clutch.B.slip", [input](double t) { return input(t) - 90; });
    EXPECT_NEAR(metric(synthetic, "flare_rad_s"), 7, 1e-9);
}

// The input runs 7 rad/s above gear A's speed, whichever end of a clutch the model calls a, and on which side of
// its gear the clutch sits.
TEST(Metrics, FlareDoesNotDependOnHowTheModelWritesItsClutches) {
    const Formula input = [](double t) {
        return t < 5.3 ? 120 : t < 5.35 ? 127. : ramp(5.35, 5.7, 127, 90)(t);
    };
    for (const char* turned : {"", "A", "B", "AB"}) {
        for (const double direction : {1., -1.}) {
            SyntheticRun synthetic = upshift();
            const auto set_slip = [&](const std::string& name, double old_speed) {
                const bool turn = std::string(turned).find(name) != std::string::npos;
                for (plant::Clutch& clutch : synthetic.run.machine.clutches) {
                    if (turn && clutch.name == name) std::swap(clutch.a, clutch.b);
                }
                synthetic.set("clutch." + name + ".slip",
                              [=](double t) { return (turn ? -1 : 1) * direction * (input(t) - old_speed); });
            };
            set_slip("A", 120);
            set_slip("B", 90);
            synthetic.set_input_speed([=](double t) { return direction * input(t); });
            synthetic.set("mass.output.speed", direction * 30);
            EXPECT_NEAR(metric(synthetic, "flare_rad_s"), 7, 1e-9) << turned << " " << direction;
            EXPECT_NEAR(metric(synthetic, "inertia_phase_s"), 5.69 - 5.3, 0.02) << turned;
        }
    }
    SyntheticRun synthetic = upshift();
    for (plant::Gear& gear : synthetic.run.machine.gears) {
        if (gear.name == "b") gear.a = "input", gear.b = "pinion_b";
    }
    for (plant::Clutch& clutch : synthetic.run.machine.clutches) {
        if (clutch.name == "B") clutch.a = "pinion_b", clutch.b = "output";
    }
    synthetic.set_input_speed(input);
    synthetic.set("clutch.A.slip", [input](double t) { return input(t) - 120; });
    synthetic.set("clutch.B.slip", [input](double t) { return input(t) / 3 - 30; });
    EXPECT_NEAR(metric(synthetic, "flare_rad_s"), 7, 1e-9);

    // And the offgoing one behind its gear, where it slips at a quarter of what the input makes of it.
    for (plant::Gear& gear : synthetic.run.machine.gears) {
        if (gear.name == "a") gear.a = "input", gear.b = "pinion_a";
    }
    for (plant::Clutch& clutch : synthetic.run.machine.clutches) {
        if (clutch.name == "A") clutch.a = "pinion_a", clutch.b = "output";
    }
    synthetic.set("clutch.A.slip", [input](double t) { return input(t) / 4 - 30; });
    EXPECT_NEAR(metric(synthetic, "flare_rad_s"), 7, 1e-9);
    EXPECT_NEAR(metric(synthetic, "inertia_phase_s"), 5.69 - 5.3, 0.02);
}

TEST(Metrics, TieUpIsTheTorqueOfTheOffgoingClutchAgainstItsDirection) {
    SyntheticRun synthetic = upshift();
    EXPECT_NEAR(metric(synthetic, "tie_up_torque_nm"), 0, 1e-9);
    synthetic.set("clutch.A.torque", [](double t) { return t < 5.2 ? 500 : t < 5.3 ? -976 : 0; });
    EXPECT_NEAR(metric(synthetic, "tie_up_torque_nm"), 976, 1e-9);
    synthetic.set("clutch.A.torque", [](double t) { return t < 5.2 ? -500 : t < 5.3 ? 120 : 0; });
    EXPECT_NEAR(metric(synthetic, "tie_up_torque_nm"), 120, 1e-9);
}

TEST(Metrics, MissingSignalsGiveNoValueInsteadOfAWrongOne) {
    SyntheticRun synthetic = upshift();
    std::erase_if(synthetic.run.columns, [](const Column& column) {
        return column.signal.name.find("acceleration") != std::string::npos ||
               column.signal.name.find("capacity") != std::string::npos ||
               column.signal.name.find("heat") != std::string::npos;
    });
    const ShiftScore shift = only_shift(synthetic);
    for (const char* name : {"peak_acceleration_change_m_s2", "vdv_m_s1_75", "peak_jerk_m_s3", "fill_time_s",
                             "clutch_energy_j.B", "clutch_peak_power_w.B"}) {
        EXPECT_FALSE(shift.find(name)->value) << name;
    }
    EXPECT_TRUE(shift.find("duration_s")->value);
}

}  // namespace
}  // namespace shiftrig::analysis
