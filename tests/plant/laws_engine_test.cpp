// The diesel engine: governor line, full load, limits, lags, stall and start.
#include <gtest/gtest.h>

#include <cmath>

#include "plant/laws/engine.h"
#include "plant/plant.h"

namespace shiftrig::plant {
namespace {

constexpr double rpm = 3.14159265358979323846 / 30;

Engine reference_engine() {
    Engine e;
    for (auto [speed, torque] : {std::pair{700., 550.},
                                 {850., 700.},
                                 {1000., 880.},
                                 {1200., 1060.},
                                 {1400., 1170.},
                                 {1600., 1201.},
                                 {1800., 1144.},
                                 {2003., 972.},
                                 {2100., 858.},
                                 {2154., 729.}}) {
        e.full_load.emplace_back(speed * rpm, torque);
    }
    e.governor_slope = 187;
    e.low_idle = 900 * rpm;
    e.high_idle = 2191 * rpm;
    e.friction_constant = 70;
    e.friction_per_speed = 0.45;
    e.actuator_lag = 0.04;
    e.turbo_instant_fraction = 0.62;
    e.turbo_lag = 0.5;
    e.fade_from = 700 * rpm;
    e.fade_to = 500 * rpm;
    e.stall_speed = 400 * rpm;
    return e;
}
constexpr double peak = 1201;

EngineInput throttle(double value) {
    EngineInput input;
    input.throttle = value;
    return input;
}

EngineState settle(const Engine& e, const EngineInput& input, double speed, double seconds = 10) {
    EngineState state;
    const double dt = 1e-3;
    for (double t = 0; t < seconds; t += dt) {
        const EngineState rate = engine_drive(e, engine_setting(e, peak, input), state, EngineMode::running,
                                              speed, full_load(e, speed))
                                     .rate;
        state.torque += dt * rate.torque;
        state.boost += dt * rate.boost;
    }
    return state;
}

TEST(Engine, SettlesOnTheGovernorLineAndOnFullLoad) {
    const Engine e = reference_engine();
    const double no_load = 1840 * rpm, share = (no_load - e.low_idle) / (e.high_idle - e.low_idle);
    EXPECT_NEAR(settle(e, throttle(share), 1801 * rpm).torque, 187 * (1840 - 1801) * rpm, 1e-6);
    EXPECT_NEAR(settle(e, throttle(1), 1600 * rpm, 30).torque, 1201, 1e-6);
    EXPECT_NEAR(settle(e, throttle(1), 2154 * rpm).torque, 187 * 37 * rpm, 1e-6);
}

TEST(Engine, BoostIsWaitedFor) {
    const Engine e = reference_engine();
    EngineState state = settle(e, throttle(1), 1600 * rpm, 0.15);
    EXPECT_LT(state.torque, 0.8 * 1201);
    EXPECT_GT(state.torque, 0.55 * 1201);
}

TEST(Engine, Tsc1LimitsTorqueAndTakesOverSpeed) {
    const Engine e = reference_engine();
    EngineInput input = throttle(1);
    input.torque_limit = 0.5;
    EXPECT_NEAR(settle(e, input, 1600 * rpm).torque, 0.5 * peak, 1e-3);
    input = throttle(1);
    input.speed_request_enable = true;
    input.speed_request = 1500 * rpm;
    EXPECT_NEAR(settle(e, input, 1490 * rpm).torque, 187 * 10 * rpm, 1e-6);
}

TEST(Engine, FrictionShowsOnlyWhenMotoring) {
    const Engine e = reference_engine();
    EngineInput cut = throttle(1);
    cut.fuel_cut = true;
    EXPECT_NEAR(settle(e, cut, 150).torque, -(70 + 0.45 * 150), 1e-6);
    EXPECT_NEAR(settle(e, throttle(0), 150).torque, -(70 + 0.45 * 150), 1e-6);  // overrun far above idle
    EXPECT_NEAR(settle(e, throttle(0), 901 * rpm).torque, -187 * rpm, 1e-6);    // on the governor's line
    EXPECT_NEAR(settle(e, throttle(0), 900 * rpm).torque, 0, 1e-9);
}

TEST(Engine, CurveFadesBelowItsLowestSpeed) {
    const Engine e = reference_engine();
    EXPECT_NEAR(full_load(e, 700 * rpm), 550, 1e-9);
    EXPECT_NEAR(full_load(e, 600 * rpm), 275, 1e-9);
    EXPECT_EQ(full_load(e, 500 * rpm), 0);
    EXPECT_EQ(full_load(e, 100), interpolate(e.full_load, 100));
}

TEST(Engine, StallsHoldsAndStartsAgain) {
    const Engine e = reference_engine();
    double crank = 0;
    EngineMode mode = next_engine_mode(e, EngineMode::running, 399 * rpm, false, 1e-3, crank);
    EXPECT_EQ(mode, EngineMode::stalled);
    EXPECT_EQ(
        engine_drive(e, engine_setting(e, peak, throttle(1)), {500, 1}, mode, 30, full_load(e, 30)).torque,
        0);
    EXPECT_NEAR(stalled_friction_capacity(e, mode, 0), 70, 1e-12);
    EXPECT_EQ(stalled_friction_capacity(e, EngineMode::running, 0), 0);
    mode = next_engine_mode(e, mode, 0, false, 1e-3, crank);
    EXPECT_EQ(mode, EngineMode::stalled) << "it does not start by itself";
    mode = next_engine_mode(e, mode, 0, true, 1e-3, crank);
    EXPECT_EQ(mode, EngineMode::cranking);
    // Cranking a free engine of 2.6 kg m² reaches the fade speed well within the starter's time.
    double speed = 0;
    int steps = 0;
    while (mode == EngineMode::cranking && steps < 5000) {
        speed += 1e-3 *
                 engine_drive(e, engine_setting(e, peak, throttle(0)), {}, mode, speed, full_load(e, speed))
                     .torque /
                 2.6;
        mode = next_engine_mode(e, mode, speed, false, 1e-3, crank);
        ++steps;
    }
    EXPECT_EQ(mode, EngineMode::running);
    EXPECT_LT(steps, 1000);
    crank = 0;
    mode = EngineMode::cranking;
    for (steps = 0; mode == EngineMode::cranking && steps < 5000; ++steps) {
        mode = next_engine_mode(e, mode, 10, false, 1e-3, crank);
    }
    EXPECT_EQ(mode, EngineMode::stalled) << "a blocked engine gives up";
    EXPECT_NEAR(steps, 3000, 1);
}

// In a machine, with and without what makes it a device that can stall: the boost builds up in both.
TEST(EngineInAMachine, BuildsUpItsBoostWhetherItCanStallOrNot) {
    for (const bool stalls : {true, false}) {
        Engine engine = reference_engine();
        engine.name = "diesel";
        engine.mass = "crank";
        if (!stalls) engine.stall_speed = engine.friction_constant = engine.friction_per_speed = 0;
        Description d;
        d.name = "engine";
        d.masses = {{"crank", 1e7, Motion::rotating, 1500 * rpm}};
        d.engines = {engine};
        const Model model = Model::build(d);
        Operators operators(model);
        State state(model);
        Scratch scratch(model);
        Inputs inputs(model);
        Outputs outputs(model);
        inputs.value[static_cast<std::size_t>(model.input("driver.throttle"))] = 1;
        const auto load = static_cast<std::size_t>(model.output("engine.diesel.load"));
        for (int n = 0; n < 5000; ++n) {
            step(model, operators, state, inputs, outputs, scratch);
            if (n == 300) {
                EXPECT_LT(outputs.value[load], 0.9) << "it lags";
            }
        }
        EXPECT_NEAR(outputs.value[load], 1, 3e-3) << (stalls ? "can stall" : "cannot stall");
    }
}

// One that neither fades nor stalls pulls against a brake for as long as one likes, whichever way rounding has it turn there.
TEST(EngineLaw, RestIsNotTurnedBackwards) {
    Engine motor = reference_engine();
    motor.fade_from = motor.fade_to = motor.stall_speed = 0;
    const double at_rest = full_load(motor, 0);
    EXPECT_GT(at_rest, 0);
    for (const double speed : {1e-16, -1e-16, -1e-12}) {
        double crank = 0;
        EXPECT_EQ(full_load(motor, speed), at_rest) << speed;
        EXPECT_EQ(full_load(motor, Curve(motor.full_load), speed), at_rest) << speed;
        EXPECT_EQ(next_engine_mode(motor, EngineMode::running, speed, false, 1e-3, crank),
                  EngineMode::running)
            << speed;
    }
    double crank = 0;
    EXPECT_EQ(full_load(motor, -1), 0);
    EXPECT_EQ(next_engine_mode(motor, EngineMode::running, -1, false, 1e-3, crank), EngineMode::stalled);
}

// Without a stall speed it has stalled only where something turns it backwards: its friction is there all the same.
// 2 dω/dt = −(70 + 0.45 ω), from 20 rad/s.
TEST(EngineInAMachine, TurnedBackwardsIsBrakedByItsFriction) {
    for (const double stall_speed : {0., 1 * rpm}) {
        Engine engine = reference_engine();
        engine.name = "diesel";
        engine.mass = "crank";
        engine.stall_speed = stall_speed;
        engine.friction_constant = 70;
        engine.friction_per_speed = 0.45;
        Description d;
        d.name = "engine";
        d.masses = {{"crank", 2, Motion::rotating, -20}};
        d.engines = {engine};
        const Model model = Model::build(d);
        Operators operators(model);
        State state(model);
        Scratch scratch(model);
        const Inputs inputs(model);
        Outputs outputs(model);
        for (int n = 0; n < 400; ++n) step(model, operators, state, inputs, outputs, scratch);
        const double limit = 70 / 0.45, left = (20 + limit) * std::exp(-0.45 / 2 * 0.4) - limit;
        EXPECT_NEAR(state.speeds()[0], -left, 1e-6) << stall_speed;
    }
}

// Its law changes with its mode at the end of a step: what the step has just computed does not hold for the next one.
TEST(EngineInAMachine, StartsAndStallsTheSameWhetherTheLastStepIsRememberedOrNot) {
    Engine engine = reference_engine();
    engine.name = "diesel";
    engine.mass = "crank";
    Description d;
    d.name = "engine";
    d.masses = {{"crank", 2.6, Motion::rotating, 0}};
    d.engines = {engine};
    TorqueSource load;
    load.name = "load";
    load.mass = "crank";
    load.input = true;
    d.sources = {load};
    const Model model = Model::build(d);
    Operators kept(model), dropped(model);
    State state(model), again(model);
    Scratch scratch(model);
    Inputs inputs(model);
    Outputs outputs(model);
    bool ran = false, stalled = false;
    for (int n = 0; n < 6000; ++n) {
        inputs.value[static_cast<std::size_t>(model.input("engine.diesel.start"))] = n > 50 ? 1 : 0;
        inputs.value[static_cast<std::size_t>(model.input("source.load.torque"))] = n > 3000 ? -1500 : 0;
        dropped.drop();
        step(model, dropped, again, inputs, outputs, scratch);
        step(model, kept, state, inputs, outputs, scratch);
        ASSERT_EQ(state.block, again.block) << "step " << n;
        const double speed = state.speeds()[0];
        ran = ran || speed > 800 * rpm;
        stalled = stalled ||
                  (ran && outputs.value[static_cast<std::size_t>(model.output("engine.diesel.stalled"))] > 0);
    }
    EXPECT_TRUE(ran);
    EXPECT_TRUE(stalled);
}

// The boost follows the torque there is, whether a lag holds that or it is the demand itself.
TEST(Engine, WithoutActuatorLagTheTurboRespondsAsWell) {
    Engine e = reference_engine();
    e.actuator_lag = 0;
    const double speed = 1500 * rpm, full = full_load(e, speed);
    EXPECT_GT(settle(e, throttle(1), speed).boost, 0.99);
    EngineState state = settle(e, throttle(1), speed);
    EXPECT_NEAR(
        engine_drive(e, engine_setting(e, peak, throttle(1)), state, EngineMode::running, speed, full).torque,
        full, 0.01 * full);
}

// One whose torque fades in below the speed at which it stalls would start and stall at once.
TEST(Engine, IsCrankedBeyondTheSpeedAtWhichItStalls) {
    Engine e = reference_engine();
    e.fade_from = 300 * rpm;
    e.fade_to = 200 * rpm;
    double time = 0;
    EXPECT_EQ(next_engine_mode(e, EngineMode::cranking, 350 * rpm, false, 1e-3, time), EngineMode::cranking);
    EXPECT_EQ(next_engine_mode(e, EngineMode::cranking, 401 * rpm, false, 1e-3, time), EngineMode::running);
}

}  // namespace
}  // namespace shiftrig::plant
