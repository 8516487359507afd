// The speed pick-up: period measurement, drop-out, direction, faults, and its seeded noise.
#include <gtest/gtest.h>

#include <cmath>

#include "plant/laws/sensor.h"

namespace shiftrig::plant {
namespace {

SpeedSensor pickup(bool directional = false) {
    SpeedSensor p;
    p.ideal = false;
    p.teeth = 60;
    p.directional = directional;
    p.drop_out_speed = 0.5;
    return p;
}

TEST(PickUp, ReadsAConstantSpeedExactlyAfterTwoTeeth) {
    for (double speed : {5.0, 33.0, 188.5, 400.0}) {
        SensorState state;
        for (int n = 0; n < 500; ++n) advance_pickup(pickup(), state, speed, speed, 1e-3);
        EXPECT_NEAR(state.reading, speed, 1e-9 * speed) << speed;
    }
}

TEST(PickUp, LagsByAboutOnePeriodWhenTheSpeedRamps) {
    SensorState state;
    double worst = 0;
    for (int n = 0; n < 2000; ++n) {
        const double a = 100 + 0.05 * n, b = a + 0.05;  // 50 rad/s²
        advance_pickup(pickup(), state, a, b, 1e-3);
        if (n > 10) worst = std::fmax(worst, std::fabs(state.reading - b));
    }
    EXPECT_LT(worst, 50 * 3e-3);
    EXPECT_GT(worst, 0);
}

TEST(PickUp, ReadingDecaysWithoutTeethAndDropsOut) {
    SensorState state;
    for (int n = 0; n < 500; ++n) advance_pickup(pickup(), state, 20, 20, 1e-3);
    double last = state.reading;
    int steps = 0;
    while (state.reading > 0 && steps < 1000) {
        advance_pickup(pickup(), state, 0, 0, 1e-3);
        EXPECT_LE(state.reading, last);
        last = state.reading;
        ++steps;
    }
    // 2π/60 per tooth at 0.5 rad/s: 0.209 s.
    EXPECT_NEAR(steps * 1e-3, 2 * pi / 60 / 0.5, 0.006);
}

TEST(PickUp, KnowsDirectionOnlyIfItIsDirectional) {
    SensorState plain, signed_state;
    for (int n = 0; n < 200; ++n) {
        advance_pickup(pickup(false), plain, -50, -50, 1e-3);
        advance_pickup(pickup(true), signed_state, -50, -50, 1e-3);
    }
    EXPECT_NEAR(plain.reading, 50, 1e-8);
    EXPECT_NEAR(signed_state.reading, -50, 1e-8);
}

TEST(PickUp, MissingToothHalvesTheReadingOncePerTurn) {
    SensorState state;
    int dips = 0, full = 0;
    const double speed = 40;
    bool low = false;
    for (int n = 0; n < 3142; ++n) {  // 20 turns
        advance_pickup(pickup(), state, speed, speed, 1e-3, 1);
        if (n < 100) continue;
        const bool now = state.reading < 0.6 * speed;
        dips += now && !low;
        low = now;
        full += std::fabs(state.reading - speed) < 1e-6;
    }
    EXPECT_NEAR(dips, 19, 1);
    EXPECT_GT(full, 2800);
}

// However many teeth pass in a step.
TEST(PickUp, MissingTeethAreCountedThroughWholeTurns) {
    SpeedSensor p;
    p.ideal = false;
    p.teeth = 250;
    SensorState state;
    state.since_edge = 0;
    constexpr double speed = 600, h = 0.05;  // 4.8 turns, 1194 teeth
    advance_pickup(p, state, speed, speed, h, 1);
    EXPECT_NEAR(state.reading, speed * 1189 / 1193, 1e-9);
}

TEST(PickUp, IdealCopiesTheSpeed) {
    SpeedSensor ideal;
    SensorState state;
    advance_pickup(ideal, state, -3, -4, 1e-3);
    EXPECT_EQ(state.reading, -4);
}

TEST(SensorFaults, ActInTheirOrder) {
    SensorState state;
    state.reading = 100;
    SensorFaults faults;
    faults.bias = 3;
    faults.noise = 2;
    EXPECT_EQ(sensor_output(state, faults, -1), 101);
    state.reading = 50;
    faults.stuck = true;
    EXPECT_EQ(sensor_output(state, faults, 1), 101) << "stuck holds the last output";
    faults.dropout = true;
    EXPECT_EQ(sensor_output(state, faults, 1), 0);
    EXPECT_EQ(sensor_output(state, {}, 0), 50) << "and all heals when the fault ends";
}

TEST(Noise, IsStandardNormalAndAPureFunction) {
    double sum = 0, square = 0, fourth = 0, neighbour = 0, last = 0;
    const int n = 200000;
    for (int i = 0; i < n; ++i) {
        const double x = noise(42, 3, static_cast<std::uint64_t>(i));
        sum += x;
        square += x * x;
        fourth += x * x * x * x;
        neighbour += x * last;
        last = x;
    }
    // Standard errors: 1/√n, √(2/n), √(96/n), 1/√n; five of them.
    EXPECT_NEAR(sum / n, 0, 5 / std::sqrt(n));
    EXPECT_NEAR(square / n, 1, 5 * std::sqrt(2. / n));
    EXPECT_NEAR(fourth / n, 3, 5 * std::sqrt(96. / n));
    EXPECT_NEAR(neighbour / n, 0, 5 / std::sqrt(n));
    EXPECT_EQ(noise(42, 3, 17), noise(42, 3, 17));
    EXPECT_NE(noise(42, 3, 17), noise(42, 4, 17));
    EXPECT_NE(noise(42, 3, 17), noise(43, 3, 17));
}

}  // namespace
}  // namespace shiftrig::plant
