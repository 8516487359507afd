// What gives way where several devices hold something at rest together, and that the sense of the load does not matter.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "tests/plant/mirrored.h"

namespace shiftrig::plant {
namespace {

Waveform ramp(double slope, double until = 1e300) {
    Waveform wave{{{.from = 0, .until = until, .slope = slope}}};
    if (until < 1e300) wave.pieces.push_back({.from = until, .offset = slope * until});
    return wave;
}

Clutch brake(const char* name, const char* mass, double sliding, double static_ratio) {
    Clutch c = clutch(name, mass, "", sliding, static_ratio);
    c.initially_locked = true;
    return c;
}

// They share the load in equal parts. At 54.6 Nm the weaker one is at its 27.3 Nm, passes 21 from then on, and 33.6 Nm are more
// than the other can hold.
TEST(Standstill, TwoBrakesGiveWayWhereTheOneThatBreaksAwayLeavesTooMuch) {
    Description d;
    d.masses = {mass("m", 0.5)};
    d.clutches = {brake("B0", "m", 21, 1.3), brake("B1", "m", 21, 33. / 21)};
    d.sources = {source("m", ramp(55.5, 1))};
    const Both both(d, 1.5);
    both.expect_mirror_images();
    ASSERT_EQ(both.forward.times(EventKind::break_away, "B0").size(), 1u);
    EXPECT_NEAR(both.forward.times(EventKind::break_away, "B0")[0], 54.6 / 55.5, 1e-6);
    EXPECT_EQ(both.forward.times(EventKind::break_away, "B1").size(), 1u);
}

// The other one can hold what is left: nothing moves.
TEST(Standstill, OneOfTwoBrakesBreaksAwayAndTheOtherHolds) {
    Description d;
    d.masses = {mass("m", 0.5)};
    d.clutches = {brake("B0", "m", 21, 1.3), brake("B1", "m", 21, 2)};
    d.sources = {source("m", ramp(55.5, 1))};
    const Both both(d, 1.5);
    both.expect_mirror_images();
    EXPECT_EQ(both.forward.times(EventKind::break_away, "B0").size(), 1u);
    EXPECT_TRUE(both.forward.times(EventKind::break_away, "B1").empty());
    EXPECT_EQ(both.forward.state.speeds()[0], 0);
    EXPECT_NEAR(both.forward.out("clutch.B1.torque"), 55.5 - 21, 1e-9);
}

TEST(Standstill, TwoBrakesWithAGearBetweenThem) {
    Description d;
    d.masses = {mass("m0", 0.011), mass("m1", 0.2978)};
    d.gears = {lossy_gear("g", "m0", "m1", 2.55, 1, 0)};
    d.clutches = {brake("c4", "m1", 4.88, 2), brake("c5", "m0", 13.68, 1.3)};
    d.sources = {source("m0", ramp(100))};
    const Both both(d, 0.25);
    both.expect_mirror_images();
    EXPECT_NEAR(both.forward.times(EventKind::break_away, "c5").at(0), 0.1875957, 1e-6);
}

// A mass on a clutch turns its slip round against another, which a brake holds through a lossy gear. What the clutch passes is
// within what brake and gear hold, but not as their mode shares it: the losses have to carry what they can.
TEST(Standstill, ABrakeHoldsWhatTheLossesOfItsGearLeaveIt) {
    Description d;
    d.masses = {mass("m0", 0.124), mass("m1", 0.1), mass("m3", 0.9, 5)};
    d.gears = {lossy_gear("g", "m0", "m1", -1.065, 0.7, 2.1)};
    d.clutches = {clutch("c2", "m3", "m0", 26.78, 1.3), brake("c5", "m1", 59.67, 2)};
    auto& falling = std::get<DryFriction>(d.clutches[0].friction);
    falling.falling = 0.48;
    falling.falling_speed = 1.16;
    d.sources = {source("m0", constant(-41)), source("m1", constant(47.4)), source("m3", constant(-144))};
    const Both both(d, 0.1);
    both.expect_mirror_images();
    for (const Rig* rig : {&both.forward, &both.backward}) {
        EXPECT_EQ(rig->times(EventKind::reverse, "c2").size(), 1u);
        EXPECT_TRUE(rig->times(EventKind::break_away, "c5").empty());
        EXPECT_EQ(rig->state.speeds()[0], 0);
    }
    EXPECT_NEAR(both.forward.state.speeds()[2], -10.2875, 1e-4);
}

// The one at its limit is just below it in the split of minimum norm; nobody else is, and it breaks away all the same.
TEST(Standstill, FourBrakesAroundARow) {
    Description d;
    d.masses = {mass("m0", 0.09234), mass("m1", 0.02439), mass("m2", 0.1284)};
    d.planetaries = {{.name = "row", .sun = "m2", .ring = "m0", .carrier = "m1", .ratio = -3.775}};
    d.clutches = {held("B0", "m1", "", 25.22), held("B1", "m2", "m0", 7.175, 1.99),
                  held("B2", "m1", "", 27.12, 1.375), held("B3", "m0", "", 12.01)};
    auto& falling = std::get<DryFriction>(d.clutches[2].friction);
    falling.falling = 0.413;
    falling.falling_speed = 1.815;
    d.sources = {source("m0", sine(43.15, 4.505)), source("m2", sine(76.78, 6.991))};
    const Both both(d, 0.01);
    both.expect_mirror_images();
    ASSERT_EQ(both.forward.times(EventKind::break_away, "B1").size(), 1u);
    EXPECT_NEAR(both.forward.times(EventKind::break_away, "B1")[0], 0.0059111, 1e-6);
    EXPECT_TRUE(both.forward.times(EventKind::break_away, "B2").empty());
}

// One that slides at rest is not locked again by what it could hold: it did so until the events of the step were used up.
TEST(Standstill, ABrakeDoesNotLockAndBreakAwayInOneInstant) {
    Description d;
    d.masses = {mass("m0", 0.04263), mass("m1", 0.07009), mass("m2", 0.05324)};
    d.gears = {lossy_gear("g1", "m0", "m1", -0.5467, 1, 0.4357),
               lossy_gear("g2", "m0", "m2", -3.544, 0.7755, 0)};
    d.shafts = {{.name = "sh", .a = "m2", .b = "m0", .stiffness = 589.4, .damping = 0.7474}};
    d.clutches = {held("B0", "m0", "", 11.63, 1.172), held("B1", "m2", "", 25.39)};
    d.sources = {source("m1", ramp(-364.9))};
    const Both both(d, 0.05);
    both.expect_mirror_images();
    for (const Rig* rig : {&both.forward, &both.backward}) {
        EXPECT_EQ(rig->fall_backs, 0);
        EXPECT_EQ(rig->times(EventKind::break_away, "B1").size(), 1u);
        EXPECT_TRUE(rig->times(EventKind::lock, "B1").empty());
    }
}

// Two gears with η = 0.9 at rest, 100 Nm before them, a load behind, a clutch between: either loses no more than a tenth of what
// drives it, so the clutch carries what lies within both their limits, however they share what is missing or too much.
Description clutch_between_gears(double capacity, double load, double static_ratio = 1) {
    Description d;
    d.masses = {mass("m0", 1), mass("m1", 1), mass("m2", 1), mass("m3", 1)};
    d.gears = {lossy_gear("g1", "m0", "m1", 1, 0.9, 0), lossy_gear("g2", "m2", "m3", 1, 0.9, 0)};
    d.clutches = {clutch("c", "m1", "m2", capacity, static_ratio)};
    d.clutches[0].initially_locked = true;
    d.sources = {source("m0", constant(100)), source("m3", constant(-load))};
    return d;
}
double least_between(double load) {
    return std::max(0.9 * 100, 0.9 * load);
}
double most_between(double load) {
    return std::min(100 / 0.9, load / 0.9);
}

TEST(Standstill, AClutchBetweenGearsAtRestCarriesWhatTheirLossesLeaveIt) {
    for (const Method method : {Method::etd3, Method::ark3}) {
        for (const double load : {85., 92., 98., 105., 112.}) {
            const double least = least_between(load);
            Description d = clutch_between_gears(200, load);
            d.method = method;
            const Both held(d, 0.01);
            held.expect_mirror_images();
            EXPECT_EQ(held.forward.state.speeds()[0], 0);
            EXPECT_GE(held.forward.out("clutch.c.torque"), least - 1e-9) << load;
            EXPECT_LE(held.forward.out("clutch.c.torque"), most_between(load) + 1e-9) << load;

            // Less than the least is not enough, a little more is.
            for (const double share : {0.99, 1.01}) {
                Description weak = clutch_between_gears(share * least, load);
                weak.method = method;
                const Both both(weak, 0.01);
                both.expect_mirror_images();
                const bool rests = both.forward.state.speeds()[0] == 0 && both.forward.state.speeds()[3] == 0;
                EXPECT_EQ(rests, share > 1) << load << ' ' << both.forward.model.engine();
                EXPECT_LE(both.forward.out("clutch.c.torque"), share * least * (1 + 1e-9)) << load;
                EXPECT_EQ(both.forward.fall_backs, 0) << load;
            }

            // Its static capacity falls from 121 Nm by 100 Nm a second.
            for (const double static_ratio : {1., 1.3}) {
                d = clutch_between_gears(200, load, static_ratio);
                d.method = method;
                const Waveform falling{
                    {{.from = 0, .offset = 0.605 / static_ratio, .slope = -0.5 / static_ratio}}};
                d.clutches[0].actuation = ActuationDirect{falling, 0};
                Rig rig(d);
                const double due = (121 - least) / 100;
                rig.run(due - 0.001);
                for (const double speed : rig.state.speeds()) EXPECT_EQ(speed, 0) << load;
                rig.run(due + 0.002);
                EXPECT_GT(std::fabs(rig.state.speeds()[0]) + std::fabs(rig.state.speeds()[3]), 0) << load;
                EXPECT_EQ(rig.fall_backs, 0) << load;
            }
        }
    }
}

// Every such train rests where a torque of the clutch lies within the limits of both gears and its own, and passes on one
// of those; elsewhere it moves.
TEST(Standstill, TwoGearsAndAClutchRestWhereTheyCanAndNowhereElse) {
    int rests = 0, moves = 0;
    for (const Method method : {Method::etd3, Method::ark3}) {
        for (const double first : {0.7, 0.85, 1.}) {
            for (const double second : {0.75, 0.9, 1.}) {
                for (int load = 62; load <= 150; load += 8) {
                    for (int capacity = 55; capacity <= 135; capacity += 16) {
                        const double least = std::max(first * 100, second * load);
                        const double most = std::min({100 / first, load / second, 1. * capacity});
                        Description d = clutch_between_gears(capacity, load);
                        d.gears[0].efficiency = first;
                        d.gears[1].efficiency = second;
                        d.method = method;
                        Rig rig(d);
                        rig.run(0.003);
                        bool still = true;
                        for (const double speed : rig.state.speeds()) still = still && speed == 0;
                        const std::string where = std::string(rig.model.engine()) + " " +
                                                  std::to_string(first) + " " + std::to_string(second) +
                                                  ", load " + std::to_string(load) + ", capacity " +
                                                  std::to_string(capacity);
                        ASSERT_EQ(still, least <= most) << where;
                        ASSERT_EQ(rig.fall_backs, 0) << where;
                        (still ? rests : moves) += 1;
                        if (!still) continue;
                        ASSERT_GE(rig.out("clutch.c.torque"), least - 1e-6) << where;
                        ASSERT_LE(rig.out("clutch.c.torque"), most + 1e-6) << where;
                    }
                }
            }
        }
    }
    EXPECT_GT(rests, 200);
    EXPECT_GT(moves, 200);
}

// A load that turns round: what was at its limit one way has to come back from it.
TEST(Standstill, LossesAtRestFollowALoadThatTurnsRound) {
    for (const Method method : {Method::etd3, Method::ark3}) {
        Description d = clutch_between_gears(200, 100);
        d.method = method;
        d.sources[1].waveform = Waveform{{{.offset = -100}, {.amplitude = 15, .frequency = 2}}};
        Rig rig(d);
        for (int n = 0; n < 1000; ++n) {
            rig.step();
            ASSERT_EQ(rig.state.speeds()[0], 0) << n;
            // Either way both gears together lose what is missing, each no more than it can.
            const double load = 100 - 15 * std::sin(4 * std::numbers::pi * rig.state.time());
            ASSERT_GE(rig.out("clutch.c.torque"), least_between(load) - 1e-6) << n;
            ASSERT_LE(rig.out("clutch.c.torque"), most_between(load) + 1e-6) << n;
        }
        EXPECT_EQ(rig.fall_backs, 0);
    }
}

// Two clutches close a ring of two gears of different ratio, in → a → out and in → b → out: all is at rest, and the ring holds a
// load on `out` by a torque T = M_a = −M_b that goes round in it, û_a T − û_b T. With what meshes at rest can lose that is
// anything from (u_a η_a − u_b/η_b) T to (u_a/η_a − u_b η_b) T, a sum of either sign.
struct Ring {
    double ratio_a, efficiency_a, ratio_b, efficiency_b;
    double most() const { return ratio_a / efficiency_a - ratio_b * efficiency_b; }
    Description description(bool swapped, Waveform load) const {
        Description d;
        d.masses = {mass("in", 0.05), mass("a", 0.02), mass("b", 0.007), mass("out", 0.12)};
        d.clutches = {clutch("ca", "in", "a", 100), clutch("cb", "in", "b", 120)};
        for (Clutch& c : d.clutches) c.initially_locked = true;
        d.gears = {lossy_gear("ga", "a", "out", ratio_a, efficiency_a),
                   lossy_gear("gb", "b", "out", ratio_b, efficiency_b)};
        if (swapped) {
            std::swap(d.masses[0], d.masses[3]);
            d.gears = {lossy_gear("gb", "out", "b", 1 / ratio_b, efficiency_b),
                       lossy_gear("ga", "out", "a", 1 / ratio_a, efficiency_a)};
        }
        d.sources = {source("out", std::move(load))};
        return d;
    }
};

TEST(Standstill, AJammedRingStaysAtRestAsLongAsItsLossesCanHoldIt) {
    for (const Ring& ring :
         {Ring{0.88, 0.82, 0.71, 0.75}, Ring{0.9, 0.5, 0.6, 0.55}, Ring{2, 0.7, 1.7, 0.6}}) {
        for (const bool swapped : {false, true}) {
            const double gone = (2 + 100 * ring.most()) / 20;  // [s]
            Both both(ring.description(swapped, {{{.from = 0, .offset = 2, .slope = -20}}}), gone - 2e-3);
            for (const double speed : both.forward.state.speeds()) EXPECT_LT(std::fabs(speed), 1e-12);
            EXPECT_TRUE(both.forward.times(EventKind::break_away, "ca").empty());
            both.forward.run(gone + 2e-3);
            both.backward.run(gone + 2e-3);
            both.expect_mirror_images();
            const auto times = both.forward.times(EventKind::break_away, "ca");
            ASSERT_EQ(times.size(), 1u);
            EXPECT_NEAR(times[0], gone, 1e-6);
        }
    }
}

// The simple rule looks at the ends of steps, but then asks the same of what holds together.
TEST(Standstill, TheNextStepRuleLetsOthersTakeALoadAsWell) {
    Description d;
    d.masses = {mass("m", 0.5)};
    d.clutches = {brake("B0", "m", 21, 1.3), brake("B1", "m", 21, 2)};
    d.sources = {source("m", ramp(55.5, 1))};
    d.transition = Transition::next_step;
    const Both both(d, 1.5);
    both.expect_mirror_images();
    EXPECT_EQ(both.forward.state.speeds()[0], 0);
}

// Friction that rises with slip over `fade` [rad/s], on 0.02 kg m²: a time constant of 20 µs for the first of these. The load is
// more than rest takes and less than sliding does, so it ends creeping and never locks.
Description held_up(double speed, double fade) {
    Description d;
    d.masses = {mass("a", 0.02, speed), mass("b", 5)};
    Clutch c = clutch("F", "a", "b", 2589);
    auto& friction = std::get<DryFriction>(c.friction);
    friction.falling = -0.625;  // of 1593 Nm at rest
    friction.sliding_capacity = 1593;
    friction.static_ratio = 1.63;
    friction.falling_speed = fade;
    d.clutches = {c};
    d.sources = {source("a", constant(1800)), source("b", constant(-1800))};
    return d;
}

TEST(Standstill, ASlipThatIsHeldUpDoesNotLock) {
    for (const double speed : {3., 13., 30.}) {
        Rig rig(held_up(speed, 1.02));
        rig.run(0.1);
        EXPECT_TRUE(rig.times(EventKind::lock, "F").empty()) << speed;
        const double slip = rig.state.speeds()[0] - rig.state.speeds()[1];
        EXPECT_GT(slip, 0.1) << speed;
        EXPECT_LT(slip, 1) << speed;
        EXPECT_EQ(rig.flags & 16, 0) << speed;
    }
}

// A hundredth of that is too fast for any part: the pair locks, which is wrong, but not in silence.
TEST(Standstill, AnInstantThatIsNotFoundIsFlagged) {
    for (const int parts : {1, 16}) {
        Description d = held_up(3, 0.01);
        d.maximum_parts = parts;
        Rig rig(d);
        rig.run(0.1);
        EXPECT_EQ(rig.flags & 16, 16) << parts;
        EXPECT_EQ(rig.times(EventKind::lock, "F").size(), 1u) << parts;
    }
}

}  // namespace
}  // namespace shiftrig::plant
