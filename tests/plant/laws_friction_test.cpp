// Friction, oil, tyre, plough, road and converter laws against their equations and the figures of the reference tractor.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "plant/laws/converter.h"
#include "plant/laws/friction.h"
#include "plant/laws/oil.h"
#include "plant/laws/plough.h"
#include "plant/laws/road.h"
#include "plant/laws/tyre.h"
#include "plant/laws/waveform.h"
#include "plant/plant.h"
#include "tests/plant/parts.h"

namespace shiftrig::plant {
namespace {

BrixiusTyre reference_tyre() {
    BrixiusTyre tyre;
    tyre.radius = 0.935;
    tyre.mobility_number = 55;
    tyre.relaxation_length = 0.6;
    tyre.slip_damping_time = 0.05;
    tyre.weight = 14000 * 9.80665;
    tyre.rolling_coefficient = 0.04;
    return tyre;
}

TEST(WetPlates, CapacityAtFullPressureIsTheReferenceFigure) {
    const WetPlates plates = powershift_plates();
    const FrictionLaw law = friction_law(plates);
    EXPECT_NEAR(mean_radius(plates), 0.0980, 5e-5);
    EXPECT_NEAR(sliding_capacity(law, load_from_pressure(law, 18e5), 1e3), 1976, 1);       // μ → 0.10
    EXPECT_NEAR(sliding_capacity(law, load_from_pressure(law, 2.2e5), 1e3), 117.6, 0.05);  // per bar
    EXPECT_NEAR(static_capacity(law, load_from_pressure(law, 18e5)), 2569.3, 0.5);
    EXPECT_EQ(load_from_pressure(law, 1.2e5), 0);
    EXPECT_EQ(load_from_pressure(law, 0), 0);
}

TEST(WetPlates, SlidingFrictionFallsWithSpeedFromBothSides) {
    const FrictionLaw law = friction_law(powershift_plates());
    const double radius = mean_radius(powershift_plates());
    EXPECT_NEAR(sliding_factor(law, 0), 0.125, 1e-15);
    EXPECT_NEAR(sliding_factor(law, 0.3 / radius), 0.10 + 0.025 * std::exp(-1), 1e-15);
    EXPECT_EQ(sliding_factor(law, -5), sliding_factor(law, 5));
    // The slope that limits the step: −161 Nm s/rad at 18 bar and zero slip.
    const double load = load_from_pressure(law, 18e5);
    const double slope = (sliding_capacity(law, load, 1e-6) - sliding_capacity(law, load, 0)) / 1e-6;
    EXPECT_NEAR(slope, -161, 1);
}

TEST(DryFriction, FallsByItsShareOrFollowsItsTable) {
    DryFriction p;
    p.sliding_capacity = 200;
    p.static_ratio = 1.15;
    p.falling = 0.3;
    p.falling_speed = 10;
    const FrictionLaw law = friction_law(p);
    EXPECT_NEAR(sliding_capacity(law, load_from_engagement(law, 0.5), 0), 100, 1e-12);
    EXPECT_NEAR(sliding_capacity(law, load_from_engagement(law, 1), -10),
                200 * (1 - 0.3 * (1 - std::exp(-1))), 1e-12);
    EXPECT_NEAR(static_capacity(law, load_from_engagement(law, 1)), 230, 1e-12);
    EXPECT_EQ(load_from_engagement(law, -0.2), 0);
    DryFriction table;
    table.sliding_capacity = 10;
    table.factor_over_slip = {{0, 1}, {10, 2}};
    const FrictionLaw rising = friction_law(table);
    EXPECT_NEAR(sliding_factor(rising, -15), 2.5, 1e-15);
    EXPECT_NEAR(static_capacity(rising, 10), 10, 1e-15);
}

// Continued beyond its last point it would drive.
TEST(DryFriction, ATableThatFallsEndsAtNothing) {
    DryFriction p;
    p.sliding_capacity = 10;
    p.factor_over_slip = {{0, 1}, {20, 0.5}, {30, 0.1}};
    const FrictionLaw law = friction_law(p);
    EXPECT_NEAR(sliding_factor(law, 31), 0.06, 1e-12);
    EXPECT_EQ(sliding_factor(law, 100), 0);
    EXPECT_EQ(sliding_factor(law, -100), 0);
}

TEST(Oil, ViscosityAndItsEffectsAtWarmAndCold) {
    const Oil oil = reference_oil();
    EXPECT_NEAR(viscosity(oil, 0), 0.5, 1e-15);
    EXPECT_NEAR(viscosity(oil, 90), 0.012, 0.0001);
    const OilEffects warm = oil_effects(oil, 90), cold = oil_effects(oil, -10), middle = oil_effects(oil, 40);
    EXPECT_EQ(warm.dead_time_factor, 1);
    EXPECT_EQ(warm.valve_frequency_factor, 1);
    EXPECT_EQ(cold.dead_time_factor, 4);
    EXPECT_NEAR(cold.valve_frequency_factor, 0.4, 1e-15);
    // 40 °C is half way between in T, and so in ln η.
    EXPECT_NEAR(middle.dead_time_factor, 2.5, 1e-12);
    EXPECT_NEAR(middle.valve_frequency_factor, 0.7, 1e-12);
    EXPECT_NEAR(cold.fill_flow_factor, 1 / (1 + cold.viscosity / 0.1), 1e-15);
    EXPECT_EQ(oil_effects(oil, -30).dead_time_factor, 4);
}

TEST(Drag, ColdOilDragsFortyTimesAsHardAndLevelsOff) {
    const double factor = drag_factor(powershift_plates());
    EXPECT_NEAR(drag_torque(factor, 0.012, 30, 60), 1.7, 0.05);
    EXPECT_NEAR(drag_torque(factor, 0.5, 30, 60), 71, 0.2);
    EXPECT_EQ(drag_torque(factor, 0.5, 90, 60), drag_torque(factor, 0.5, 60, 60));
    EXPECT_EQ(drag_torque(factor, 0.5, -90, 60), -drag_torque(factor, 0.5, 60, 60));
}

TEST(Tyre, GrossAndNetTractionAreBrixius) {
    const BrixiusTyre tyre = reference_tyre();
    const double bn = 55, s = 0.1, w = tyre.weight;
    const TyreSoil soil = tyre_soil(tyre, bn);
    const double gross = 0.88 * (1 - std::exp(-0.1 * bn)) * (1 - std::exp(-7.5 * s)) + 0.04;
    const double resistance = 1 / bn + 0.04 + 0.5 * s / std::sqrt(bn);
    EXPECT_NEAR(tyre_force(soil, s) + 0.04 * w, gross * w, 1e-9 * w);
    EXPECT_NEAR(tyre_force(soil, s) - tyre_resistance(soil, s), (gross - resistance) * w, 1e-9 * w);
    EXPECT_EQ(tyre_force(soil, -s), -tyre_force(soil, s));
    EXPECT_EQ(tyre_resistance(soil, -s), tyre_resistance(soil, s));
    EXPECT_NEAR(tyre_force_slope(soil) * tyre.radius * tyre.radius / tyre.relaxation_length, 1.3e6, 0.02e6);
    EXPECT_NEAR(rolling_moment(tyre), 0.04 * w * 0.935, 1e-9);
}

TEST(Tyre, SlipRelaxesOverItsLengthToTheKinematicSlip) {
    const BrixiusTyre tyre = reference_tyre();
    const TyreSoil soil = tyre_soil(tyre, tyre.mobility_number);
    const double wheel = 2.2 / tyre.radius, v = 2;
    double kappa = 0;
    const double steady = (2.2 - 2) / 2.2, dt = 1e-5;
    for (int i = 0; i < 100000; ++i) kappa += dt * tyre_motion(tyre, soil, kappa, wheel, v).rate;
    EXPECT_NEAR(kappa, steady * (1 - std::exp(-2.2 / 0.6)), 1e-6);
    EXPECT_NEAR(tyre_motion(tyre, soil, steady, wheel, v).rate, 0, 1e-14);
    // At standstill the damping is τ κ̇; at speed it never leads beyond the steady slip.
    const TyreMotion slow = tyre_motion(tyre, soil, 0, 1e-9, 0);
    EXPECT_NEAR(slow.slip, 0.05 * slow.rate, 1e-9 * slow.slip);
    EXPECT_LT(tyre_motion(tyre, soil, 0, 22 / tyre.radius, 20).slip, 2. / 22);
}

TEST(Plough, DraftIsD497InItsUnits) {
    Plough plough;
    plough.soil_factor = 0.70;
    plough.a = 652;
    plough.c = 5.1;
    plough.width = 3.2;
    plough.depth = 0.23;
    EXPECT_NEAR(plough_draft(plough, 7.41 / 3.6, 1), 48.0e3, 100);
    EXPECT_NEAR(plough_draft(plough, -8.63 / 3.6, 1), 53.2e3, 100);
    EXPECT_NEAR(plough_draft(plough, 0, 0.5), 0.5 * 0.7 * 652 * 3.2 * 23,
                1e-9);  // a capacity: there at rest too
}

TEST(Road, GradeIsATangentAndAirOpposesMotion) {
    Road road;
    road.mass = 14000;
    road.air_coefficient = 2.82;
    EXPECT_NEAR(grade_force(road, 0.15, 9.80665), -14000 * 9.80665 * std::sin(std::atan(0.15)), 1e-9);
    EXPECT_EQ(grade_force(road, -0.1, 9.8), -grade_force(road, 0.1, 9.8));
    EXPECT_NEAR(air_force(road, -10), 282, 1e-12);
}

TorqueConverter reference_converter() {
    TorqueConverter c;
    c.k_over_speed_ratio = {{0, 6.6},   {.21, 6.6}, {.44, 6.8}, {.65, 7.1},
                            {.79, 7.3}, {.89, 7.5}, {.93, 9.5}, {1, 12.4}};
    c.torque_ratio_over_speed_ratio = {{0, 2.5}, {0.85, 1}, {1, 1}};
    return c;
}

TEST(Converter, StallTorqueAndRatioAreTheTables) {
    const ConverterTorques stall = converter_torques(reference_converter(), 188.5, 0);
    EXPECT_NEAR(stall.pump, (188.5 / 6.6) * (188.5 / 6.6), 1e-9);
    EXPECT_NEAR(stall.turbine / stall.pump, 2.5, 1e-12);
}

TEST(Converter, TorquePassesThroughZeroAtSynchronousSpeedAndReversesInOverrun) {
    const TorqueConverter c = reference_converter();
    EXPECT_EQ(converter_torques(c, 150, 150).pump, 0);
    const double below = converter_torques(c, 150, 149.999).pump,
                 above = converter_torques(c, 149.999, 150).pump;
    EXPECT_GT(below, 0);
    EXPECT_LT(above, 0);
    EXPECT_NEAR(below, -above, 1e-3 * below);
    EXPECT_LT(converter_torques(c, 100, 150).turbine, 0) << "overrun brakes the turbine";
}

// A shuttle reversal, a vehicle that rolls back: the torque ratio of the standing turbine goes over into that of the overrun.
TEST(Converter, TorqueDoesNotJumpWhereTheTurbineTurnsBackwardsAsFastAsThePump) {
    const TorqueConverter c = reference_converter();
    for (const double pump : {150., -80.}) {
        const ConverterTorques slower = converter_torques(c, pump, -pump * (1 - 1e-9)),
                               faster = converter_torques(c, pump, -pump * (1 + 1e-9));
        EXPECT_NEAR(slower.turbine, 2.5 * slower.pump, 1e-9 * std::fabs(slower.turbine));
        EXPECT_NEAR(faster.pump, slower.pump, 1e-8 * std::fabs(slower.pump));
        EXPECT_NEAR(faster.turbine, slower.turbine, 1e-8 * std::fabs(slower.turbine));
    }
    const ConverterTorques standing = converter_torques(c, 0, -150);
    EXPECT_EQ(standing.turbine, standing.pump);
    EXPECT_NEAR(standing.pump, (150 / 6.6) * (150 / 6.6), 1e-9);
    const ConverterTorques between = converter_torques(c, 75, -150);
    EXPECT_NEAR(between.turbine, 1.75 * between.pump, 1e-9);
}

TEST(Converter, NeverMakesEnergy) {
    const TorqueConverter c = reference_converter();
    for (double p = -200; p <= 200; p += 7) {
        for (double t = -200; t <= 200; t += 7) {
            const ConverterTorques torque = converter_torques(c, p, t);
            EXPECT_GE(torque.pump * p - torque.turbine * t, -1e-9) << p << " " << t;
        }
    }
}

// The largest of all four derivatives over the faster speed, by differences, all around the circle of the two speeds.
double steepest_answer(const TorqueConverter& c) {
    double most = 0;
    for (int n = 0; n < 200000; ++n) {
        const double angle = 2 * M_PI * n / 200000, p = 100 * std::cos(angle), t = 100 * std::sin(angle),
                     d = 1e-5;
        const ConverterTorques here = converter_torques(c, p, t), by_pump = converter_torques(c, p + d, t),
                               by_turbine = converter_torques(c, p, t + d);
        for (const auto& there : {by_pump, by_turbine}) {
            const double change =
                std::max(std::fabs(there.pump - here.pump), std::fabs(there.turbine - here.turbine));
            most = std::max(most, change / d / std::max(std::fabs(p), std::fabs(t)));
        }
    }
    return most;
}

TEST(Converter, AnswersNoSpeedMoreSteeplyThanItsCoefficientSays) {
    TorqueConverter c = reference_converter();
    const auto runs_off = [&](Table k) {
        c.k_over_speed_ratio = std::move(k);
        return c;
    };
    for (const TorqueConverter& one :
         {reference_converter(), runs_off({{0, 6.6}, {0.8, 7}, {0.95, 8}, {1, 100}}),
          runs_off({{0, 6.6}, {0.97, 7}, {1, 40}}), runs_off({{0, 6.6}, {0.5, 5}, {1, 12}})}) {
        const double bound = 2 * steepest_coefficient(one), found = steepest_answer(one);
        EXPECT_LE(found, bound * (1 + 1e-6));
        EXPECT_GE(found, 0.9 * bound);
    }
}

TEST(Waveform, IsOneSidedAtItsEdges) {
    Waveform wave;
    wave.pieces = {{0.4, 0.9, 1, 10, 0, 0, 0}, {-1e300, 1e300, 0, 0, 3, 5, 0}};
    EXPECT_NEAR(waveform(wave, 0.4, Side::left), 3 * std::sin(2 * M_PI * 5 * 0.4), 1e-12);
    EXPECT_NEAR(waveform(wave, 0.4, Side::right) - waveform(wave, 0.4, Side::left), 1, 1e-12);
    EXPECT_NEAR(waveform(wave, 0.9, Side::left) - waveform(wave, 0.9, Side::right), 6, 1e-12);
    // 3·0.3 is not the double 0.9: the edge is met all the same.
    EXPECT_EQ(waveform(wave, 3 * 0.3, Side::right), waveform(wave, 0.9, Side::right));
}

// Carts that a wheel each drives, on tyres with these mobility numbers; the soil changes after a second, if at all. Slips after two.
std::vector<double> slips(const std::vector<double>& mobility_numbers, double soil = 0) {
    Description d;
    for (std::size_t i = 0; i < mobility_numbers.size(); ++i) {
        const std::string number = std::to_string(i);
        d.masses.push_back(mass("wheel" + number, 50));
        d.masses.push_back({"body" + number, 14000, Motion::translating, 0});
        BrixiusTyre tyre = reference_tyre();
        tyre.name = number, tyre.wheel = "wheel" + number, tyre.body = "body" + number;
        tyre.mobility_number = mobility_numbers[i];
        d.tyres.push_back(tyre);
        d.sources.push_back(source("wheel" + number, constant(30000)));
    }
    const Model model = Model::build(d, {.step_size = 1e-3});
    Operators operators(model);
    State state(model);
    Scratch scratch(model);
    Inputs inputs(model);
    Outputs outputs(model);
    while (state.steps() < 2000) {
        if (state.steps() == 1000 && soil > 0)
            inputs.value[static_cast<std::size_t>(model.input("environment.mobility_number"))] = soil;
        step(model, operators, state, inputs, outputs, scratch);
    }
    std::vector<double> result;
    for (const BrixiusTyre& tyre : d.tyres)
        result.push_back(
            outputs.value[static_cast<std::size_t>(model.output("tyre." + tyre.name + ".slip"))]);
    return result;
}

TEST(TyreInAMachine, EachHasItsOwnMobilityNumberAndTheSoilChangesAllInProportion) {
    const auto both = slips({55, 20}), turned = slips({20, 55});
    EXPECT_NEAR(both[0], slips({55})[0], 1e-12);
    EXPECT_NEAR(both[1], slips({20})[0], 1e-12);
    EXPECT_NEAR(turned[0], both[1], 1e-12);
    EXPECT_NEAR(turned[1], both[0], 1e-12);
    EXPECT_GT(both[1], 1.05 * both[0]) << "softer soil, more slip";

    const auto softer = slips({55, 20}, 44);
    EXPECT_NEAR(softer[0], slips({55}, 44)[0], 1e-12);
    EXPECT_NEAR(softer[1], slips({20}, 16)[0], 1e-12);
}

TEST(WaveformInAMachine, AnEdgeInsideAStepActsFromItsOwnTimeOn) {
    Description d;
    d.masses = {mass("m", 2)};
    d.sources = {source("m", constant(8, 0.00037, 0.00282))};
    const Model model = Model::build(d, {.step_size = 1e-3});
    Operators operators(model);
    State state(model);
    Scratch scratch(model);
    Inputs inputs(model);
    Outputs outputs(model);
    for (const double expected : {4 * 0.63e-3, 4 * 1.63e-3, 4 * 2.45e-3}) {
        step(model, operators, state, inputs, outputs, scratch);
        EXPECT_NEAR(state.speeds()[0], expected, 1e-15);
    }
}

}  // namespace
}  // namespace shiftrig::plant
