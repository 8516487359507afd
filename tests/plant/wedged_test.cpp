// Pairs that begin to press, or give way, where others hold them at rest: from when on they carry their share.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "tests/plant/mirrored.h"

namespace shiftrig::plant {
namespace {

Waveform rising(double slope, double from) {
    return {{{.from = from, .slope = slope}}};
}

// 8 Nm on a mass that a brake of 10 Nm holds; one of 100 Nm is applied through a lag. Loads are shared as the capacities are.
Description two_brakes(Method method, double static_ratio) {
    Description d;
    d.method = method;
    d.masses = {mass("w", 1)};
    d.clutches = {held("park", "w", "", 10),
                  clutch("service", "w", "", 100, static_ratio, ActuationApply{.lag = 0.15})};
    d.sources = {source("w", constant(8))};
    return d;
}

TEST(Wedged, ABrakeThatIsAppliedBesideAnotherOneLocksAtItsShare) {
    for (const Method method : {Method::etd3, Method::ark3}) {
        for (const double static_ratio : {1., 1.3}) {
            Rig rig(two_brakes(method, static_ratio));
            rig.run(0.1);
            rig.in("clutch.service.application_command") = 1;
            double least = 1e300, most = -1e300;  // of what the first one carries
            while (rig.state.time() < 1) {
                rig.step();
                least = std::min(least, rig.out("clutch.park.torque"));
                most = std::max(most, rig.out("clutch.park.torque"));
            }
            // 100 (1 − e^(−t/0.15)) = 8 · 100/110, whatever it could hold before it slid
            const double share = 8 * 100. / 110;
            const std::vector<double> locks = rig.times(EventKind::lock, "service");
            ASSERT_FALSE(locks.empty());
            EXPECT_NEAR(locks.back(), 0.1 - 0.15 * std::log(1 - share / 100), 1e-6);
            EXPECT_NEAR(rig.out("clutch.service.torque"), share, 1e-9);
            EXPECT_NEAR(least, 8 - share, 1e-6);
            EXPECT_LE(most, 8 + 1e-9);
            EXPECT_EQ(rig.fall_backs, 0);
        }
    }
}

TEST(Wedged, TheNextStepRuleAsksAtTheEndsOfSteps) {
    Description d = two_brakes(Method::etd3, 1);
    d.transition = Transition::next_step;
    Rig rig(d);
    rig.in("clutch.service.application_command") = 1;
    rig.run(0.1);
    const std::vector<double> locks = rig.times(EventKind::lock, "service");
    ASSERT_FALSE(locks.empty());
    EXPECT_NEAR(locks.back(), 0.012, 1e-9);  // 0.0113 s
}

// Three clutches in a ring. What the third one takes over as it closes slowly never was too much for the others.
Description ring(Actuation third) {
    Description d;
    d.masses = {mass("m1", 1), mass("m2", 1), mass("m6", 1)};
    d.clutches = {held("ground", "m2", "", 100), held("c3", "m2", "m1", 20, 1.3, ActuationDirect{{}, 0.5}),
                  held("c7", "m2", "m6", 4), clutch("c12", "m6", "m1", 4, 1, std::move(third))};
    d.sources = {source("m1", constant(-11.8)), source("m6", constant(-3.9))};
    return d;
}

TEST(Wedged, AClutchThatClosesSlowlyInARingTearsNothingLoose) {
    const Both both(ring(ActuationDirect{.profile = rising(10, 0.02)}), 0.12);
    both.expect_mirror_images();
    Rig at_once(ring(ActuationConstant{}));
    at_once.run(0.12);
    for (const char* name : {"c3", "c7", "c12"}) {
        const std::string torque = std::string("clutch.") + name + ".torque";
        EXPECT_NEAR(both.forward.out(torque), at_once.out(torque), 1e-9) << name;
    }
    for (const double speed : both.forward.state.speeds()) EXPECT_EQ(speed, 0);
}

// A passes 10 Nm of 60, C the rest. Where the load turns at once A turns with it, and does not go on pushing against it.
TEST(Wedged, ALoadThatTurnsAtOnceTurnsThePush) {
    for (const Method method : {Method::etd3, Method::ark3}) {
        for (const Transition transition : {Transition::localised, Transition::next_step}) {
            Description d;
            d.method = method;
            d.transition = transition;
            d.masses = {mass("m", 1)};
            d.clutches = {held("A", "m", "", 100, 1, ActuationDirect{{}, 0.1}), held("C", "m", "", 100)};
            Waveform load = constant(60, -1e300, 0.02);
            load.pieces.push_back({.from = 0.02, .offset = -60});
            d.sources = {source("m", load)};
            Rig rig(d);
            rig.run(0.015);
            EXPECT_NEAR(rig.out("clutch.A.torque"), 10, 1e-9);
            rig.run(0.03);
            EXPECT_NEAR(rig.out("clutch.A.torque"), -10, 1e-9) << rig.model.engine();
            EXPECT_NEAR(rig.out("clutch.C.torque"), -50, 1e-9) << rig.model.engine();
            EXPECT_EQ(rig.state.speeds()[0], 0);
        }
    }
}

// Its capacity dips below its share for less than a step: it lets go once and holds again once.
TEST(Wedged, ACapacityThatDipsLetsGoAndHoldsOnce) {
    for (const Method method : {Method::etd3, Method::ark3}) {
        for (const double frequency : {3.1, 13.7, 30.3}) {
            for (const double depth : {1e-4, 1e-3, 1e-2}) {
                Description d;
                d.method = method;
                d.masses = {mass("m", 1)};
                Waveform wave = sine(0.4, frequency);
                wave.pieces.push_back({.offset = 0.5});
                d.clutches = {held("A", "m", "", 100, 1, ActuationDirect{.profile = wave}),
                              held("C", "m", "", 100)};
                d.sources = {source("m", constant(2 * (10 + depth)))};
                Rig rig(d);
                rig.run(1);
                EXPECT_EQ(rig.fall_backs, 0) << rig.model.engine() << ' ' << frequency << ' ' << depth;
                EXPECT_LE(rig.times(EventKind::lock, "A").size(), std::ceil(frequency) + 1)
                    << rig.model.engine() << ' ' << frequency << ' ' << depth;
                EXPECT_EQ(rig.state.speeds()[0], 0);
            }
        }
    }
}

// Where another one gives way at last, the one that pushed holds what it pushed with: it goes on from there.
TEST(Wedged, WhatPushesHoldsWhatAnotherOneLeavesIt) {
    Description d = ring(ActuationDirect{.profile = rising(10, 0.02)});
    d.clutches[1] = held("c3", "m2", "m1", 10, 1.3);
    const Both both(d, 0.12);
    both.expect_mirror_images();
    const std::vector<double> breaks = both.forward.times(EventKind::break_away, "c7");
    ASSERT_EQ(breaks.size(), 1u);
    EXPECT_NEAR(breaks[0], 0.02 + 0.1 / 40, 1e-6);  // 3.9 Nm and what c12 pushes with are 4 Nm
    EXPECT_NEAR(both.forward.out("clutch.c7.torque"), 4, 1e-9);
    EXPECT_NEAR(both.forward.out("clutch.c12.torque"), 0.1, 1e-6);
    EXPECT_EQ(both.forward.fall_backs, 0);
}

// One that is torn loose while it can hold nothing yet, in the instant in which another one lets go, pushes the way it
// was torn.
TEST(Wedged, WhatIsTornLooseAtNoCapacityKeepsItsSense) {
    Description d;
    d.masses = {mass("m1", 0.04), mass("m2", 0.02), mass("m6", 0.03), mass("m8", 2.2)};
    Waveform weakens = constant(1, -1e300, 0.021);
    weakens.pieces.push_back({.from = 0.021, .offset = 0.3});
    d.clutches = {held("c3", "m2", "m1", 25), held("c7", "m2", "m6", 5.7),
                  held("c9", "m2", "m8", 5, 1, ActuationDirect{.profile = weakens}),
                  clutch("c12", "m6", "m1", 3.6, 1, ActuationDirect{.profile = rising(13, 0.021)})};
    d.sources = {source("m2", constant(4.9))};
    const Both early(d, 0.024), late(d, 0.2);
    EXPECT_NEAR(early.forward.out("clutch.c12.torque"), -13 * 0.003 * 3.6, 1e-9);
    EXPECT_NEAR(early.backward.out("clutch.c12.torque"), 13 * 0.003 * 3.6, 1e-9);
    late.expect_mirror_images();
    EXPECT_EQ(late.forward.times(EventKind::engage, "c12").size(), 1u);
    EXPECT_EQ(late.forward.times(EventKind::lock, "c12").size(), 1u);
    EXPECT_EQ(late.forward.fall_backs, 0);
}

}  // namespace
}  // namespace shiftrig::plant
