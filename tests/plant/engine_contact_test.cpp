// Contact states: when pairs close and open, what they carry, and what a machine at rest does.
#include "rig.h"

namespace shiftrig::plant {
namespace {

constexpr double pi = 3.14159265358979323846;

Mass body(const std::string& name, double inertia, double speed = 0) {
    return {name, inertia, Motion::translating, speed};
}

Description two_inertias() {
    Description d;
    d.name = "two inertias";
    d.masses = {mass("fast", 2.6, 188.5), mass("slow", 1.0)};
    d.clutches = {clutch("C", "fast", "slow", 1500)};
    return d;
}

TEST(Clutch, TwoInertiasCloseAtTheClosedFormsTimeSpeedAndHeat) {
    const double dw = 188.5, reduced = 2.6 / 3.6;
    for (const double h : {1e-4, 1e-3, 5e-3}) {
        Rig rig(two_inertias(), {h, KernelKind::automatic});
        rig.run(0.2);
        const auto locks = rig.times(EventKind::lock, "C");
        ASSERT_EQ(locks.size(), 1u);
        EXPECT_NEAR(locks[0], reduced * dw / 1500, 1e-12);
        EXPECT_NEAR(rig.out("mass.fast.speed"), 2.6 * dw / 3.6, 1e-11);
        EXPECT_DOUBLE_EQ(rig.out("mass.fast.speed"), rig.out("mass.slow.speed"));
        EXPECT_NEAR(rig.out("clutch.C.heat"), 0.5 * reduced * dw * dw, 1e-8);
        EXPECT_NEAR(rig.out("energy.defect"), 0, 1e-7);
    }
}

TEST(Clutch, InternalTorqueOfAClosedClutchIsTable1RowByRow) {
    const double rows[][5] = {{1, 1, 10, -1, 5.5}, {2, 1, 10, -1, 4},   {5, 1, 10, -1, 2.5},
                              {9, 1, 10, -1, 1.9}, {1, 9, 10, -1, 9.1}, {9, 1, 1, -1, 1},
                              {9, 1, 1, 1, -0.8}};
    for (const auto& [j1, j2, m1, m2, m12] : rows) {
        Description d = two_inertias();
        d.masses = {mass("fast", j1), mass("slow", j2)};
        d.clutches[0].initially_locked = true;
        d.sources = {source("fast", constant(m1)), source("slow", constant(m2))};
        Rig rig(d);
        rig.step();
        EXPECT_NEAR(rig.out("clutch.C.torque"), m12, 1e-12);
        EXPECT_EQ(rig.out("clutch.C.state"), 0);
    }
}

// The clutch carries M12, not M1: it holds although the torque on its first mass is beyond its capacity.
TEST(Clutch, StuckClutchCarriesLoadBelowItsCapacity) {
    Description d = two_inertias();
    d.masses = {mass("fast", 9), mass("slow", 1)};
    d.clutches = {clutch("C", "fast", "slow", 2)};
    d.clutches[0].initially_locked = true;
    d.sources = {source("fast", constant(10)), source("slow", constant(-1))};  // M12 = 1.9
    Rig rig(d);
    rig.run(0.1);
    EXPECT_TRUE(rig.times(EventKind::break_away, "C").empty());
    EXPECT_EQ(rig.out("clutch.C.state"), 0);
}

TEST(Clutch, BreaksAwayWhereItsInternalTorquePassesTheStaticCapacity) {
    Description d = two_inertias();
    d.masses = {mass("fast", 1), mass("slow", 1)};
    d.clutches = {clutch("C", "fast", "slow", 5, 1.2)};
    d.clutches[0].initially_locked = true;
    Waveform ramp;
    ramp.pieces.push_back({});
    ramp.pieces[0].from = 0;
    ramp.pieces[0].slope = 100;
    d.sources = {source("fast", ramp)};  // M12 = 50 t, 6 Nm at 0.12 s
    Rig rig(d, {7e-3, KernelKind::automatic});
    rig.run(0.14);
    const auto opens = rig.times(EventKind::break_away, "C");
    ASSERT_EQ(opens.size(), 1u);
    EXPECT_NEAR(opens[0], 0.12, 1e-9);
    // From then on 5 Nm slide: Δω̇ = 100 t − 10.
    const double t = rig.state.time() - 0.12;
    EXPECT_NEAR(rig.out("clutch.C.slip"), 2 * t + 50 * t * t, 1e-9);
}

// A load on a belt: m = k = 1, belt 0.2 m/s, static 1, sliding 0.7; seen from the belt the wall moves. It slips for
// 2π − 2 atan 1.5 and sticks while the belt carries it from −0.3 to 0.3 m past the centre.
const double slip_time = 2 * pi - 2 * std::atan(1.5), stick_slip_period = slip_time + 3;

struct StickSlip : Rig {
    StickSlip(Method method, double h, Transition transition) : Rig(machine(method, transition), {h}) {
        while (state.time() < 60) {
            step();
            furthest = std::max(furthest, std::fabs(out("shaft.spring.twist")));
        }
        slips = times(EventKind::break_away, "belt");
        sticks = times(EventKind::lock, "belt");
        for (std::size_t i = 2; i < slips.size(); ++i)
            worst = std::max(worst, std::fabs(slips[i] - slips[i - 1] - stick_slip_period));
    }
    static Description machine(Method method, Transition transition) {
        Description d;
        d.name = "stick-slip";
        d.method = method;
        d.transition = transition;
        d.masses = {body("load", 1), body("wall", 1e12, -0.2)};
        d.clutches = {clutch("belt", "load", "", 0.7, 1 / 0.7)};
        d.shafts = {{"spring", "load", "wall", 1, 0, 0}};
        return d;
    }
    std::vector<double> slips, sticks;
    double worst = 0, furthest = 0;  // error of a period [s], position [m]
};

TEST(Clutch, StickSlipHasThePeriodOfTheClosedForm) {
    for (const Method method : {Method::etd3, Method::ark3}) {
        for (const double h : {1e-3, 2e-3, 5e-3, 10e-3, 20e-3}) {
            const StickSlip rig(method, h, Transition::localised);
            ASSERT_GE(rig.slips.size(), 7u);
            EXPECT_LT(rig.worst, 3 * 1.4e-7) << "h = " << h;
            const std::size_t first = rig.sticks[0] > rig.slips[0] ? 0 : 1;
            EXPECT_NEAR(rig.sticks[first] - rig.slips[0], slip_time, 3 * 1.4e-7) << "h = " << h;
            EXPECT_NEAR(rig.furthest, 1.060555, 1e-4);
        }
    }
}

TEST(Clutch, StickSlipByTheNextStepRuleIsOffAsIsKnownOfIt) {
    for (const Method method : {Method::etd3, Method::ark3}) {
        const double fine = StickSlip(method, 1e-3, Transition::next_step).worst,
                     coarse = StickSlip(method, 20e-3, Transition::next_step).worst;
        EXPECT_LT(fine, 3 * 4e-4);
        EXPECT_GT(fine, 4e-4 / 3);
        EXPECT_LT(coarse, 3 * 2.2e-2);
        EXPECT_GT(coarse, 2.2e-2 / 3);
    }
}

// v̇ = −14 + 2·10⁴ t from 4.5 mm/s against 4 Nm: zero at 0.5 ms, where the load has just vanished. It stays until the
// load is 4 Nm at 0.7 ms and has 0.9 mrad/s at 1 ms; passing through zero and back unseen it would have 0.5.
TEST(Clutch, SlipThatTouchesZeroWithinAStepLocks) {
    for (const int parts : {1, 16}) {
        Description d;
        d.name = "touch";
        d.maximum_parts = parts;
        d.masses = {mass("load", 1, 4.5e-3)};
        d.clutches = {clutch("brake", "load", "", 4)};
        Waveform ramp = constant(-10);
        ramp.pieces[0].from = 0;
        ramp.pieces[0].slope = 2e4;
        d.sources = {source("load", ramp)};
        Rig rig(d);
        rig.step();
        const auto locks = rig.times(EventKind::lock, "brake"),
                   goes = rig.times(EventKind::break_away, "brake");
        ASSERT_EQ(locks.size(), 1u);
        ASSERT_EQ(goes.size(), 1u);
        EXPECT_NEAR(locks[0], 5e-4, 1e-9);
        EXPECT_NEAR(goes[0], 7e-4, 1e-9);
        EXPECT_NEAR(rig.state.speeds()[0], 9e-4, 1e-8);
        EXPECT_EQ(rig.fall_backs, 0);
    }
}

// A torque wave of 4.2 Nm whose top alone is above 4 Nm, and which is 3.6 Nm at both ends of the step.
TEST(Clutch, TorqueThatIsTooMuchOnlyWithinAStepBreaksItLoose) {
    const double omega = 2 * (0.5 * pi - std::asin(3.6 / 4.2)) / 1e-3, lead = std::acos(4 / 4.2);
    for (const int parts : {1, 16}) {
        Description d;
        d.name = "peak";
        d.maximum_parts = parts;
        d.masses = {mass("load", 1)};
        d.clutches = {clutch("brake", "load", "", 4)};
        d.clutches[0].initially_locked = true;
        d.sources = {
            source("load", sine(4.2, omega / (2 * pi), -1e300, 1e300, -std::asin(3.6 / 4.2) / omega))};
        Rig rig(d);
        rig.step();
        const auto goes = rig.times(EventKind::break_away, "brake");
        ASSERT_EQ(goes.size(), 1u);
        EXPECT_NEAR(goes[0], 5e-4 - lead / omega, 1e-6);
        // ∫(4.2 cos ω(t − 0.5 ms) − 4) dt from there to the end of the step
        const double half = omega * 5e-4;
        const double speed = (4.2 * (std::sin(half) + std::sin(lead)) - 4 * (half + lead)) / omega;
        EXPECT_NEAR(rig.state.speeds()[0], speed, 1e-2 * speed);
    }
}

TEST(Clutch, NextStepRuleHasTheLargerErrorOfItsOrder) {
    Description d = two_inertias();
    d.transition = Transition::next_step;
    Rig rig(d);
    rig.run(0.2);
    const auto locks = rig.times(EventKind::lock, "C");
    ASSERT_EQ(locks.size(), 1u);
    EXPECT_NEAR(locks[0], 0.091, 1e-12);  // the end of the step in which the slip changed its sign
    EXPECT_NEAR(rig.out("mass.fast.speed"), 2.6 * 188.5 / 3.6, 1e-9);  // the join keeps momentum
    EXPECT_EQ(rig.outputs.certificate.fall_backs, 0);
}

// A gear that nothing joins to the rest; its power turns at 90.3 ms.
void put_beside(Description& d) {
    d.masses.push_back(mass("p", 1, 50));
    d.masses.push_back(mass("q", 1, 25));
    d.gears = {lossy_gear("G", "p", "q", 2, 0.9, 0)};
    d.sources = {source("p", Waveform{{{.from = 0, .offset = 100, .slope = -1107.4}}})};
}

// What comes later in a step than a reversal of power changes at its end all the same.
TEST(Clutch, NextStepRuleHeedsWhatComesAfterAReversalOfPower) {
    Description alone = two_inertias();
    alone.transition = Transition::next_step;
    Description beside = alone;
    put_beside(beside);
    Rig a(alone), b(beside);
    while (a.state.time() < 0.2 - 1e-9) {
        a.step();
        b.step();
        for (const char* name : {"mass.fast.speed", "mass.slow.speed"})
            ASSERT_EQ(a.out(name), b.out(name)) << name << " at " << a.state.time();
    }
    EXPECT_EQ(a.times(EventKind::lock, "C"), b.times(EventKind::lock, "C"));
    EXPECT_EQ(b.times(EventKind::drive_side, "G").size(), 1u);
}

// The reversal itself is corrected, and nothing to fall back for.
TEST(Clutch, OneNotLocatedBehindAReversalOfPowerIsAFallBack) {
    for (const bool locks : {false, true}) {
        Description d = two_inertias();
        d.maximum_events = 1;
        if (!locks) d.clutches.clear();
        d.masses.push_back(mass("first", 1, 90.2));
        d.masses.push_back(mass("other", 1));
        d.clutches.push_back(clutch("D", "first", "other", 500));  // takes the one event, at 90.2 ms
        put_beside(d);
        Rig rig(d);
        rig.run(0.12);
        EXPECT_EQ(rig.fall_backs, locks ? 1 : 0);
        EXPECT_NEAR(rig.times(EventKind::lock, "D").at(0), 0.0902, 1e-9);
        if (locks) {
            EXPECT_NEAR(rig.times(EventKind::lock, "C").at(0), 0.091, 1e-12);
        }
        EXPECT_EQ(rig.times(EventKind::drive_side, "G").size(), 1u);
    }
}

TEST(TieUp, ParallelClutchesShareInProportionToTheirCapacities) {
    Description d;
    d.name = "parallel";
    d.masses = {mass("a", 1), mass("b", 1)};
    d.clutches = {clutch("C10", "a", "b", 10), clutch("C30", "a", "b", 30)};
    d.clutches[0].initially_locked = d.clutches[1].initially_locked = true;
    d.sources = {source("a", constant(25))};
    Rig rig(d);
    rig.step();
    EXPECT_NEAR(rig.out("clutch.C10.torque"), 3.125, 1e-12);
    EXPECT_NEAR(rig.out("clutch.C30.torque"), 9.375, 1e-12);
    EXPECT_TRUE(rig.outputs.certificate.flags & 1);
    ASSERT_EQ(rig.outputs.event_count, 1);
    EXPECT_EQ(explain(rig.model, rig.outputs.events[0]),
              "t=0.0010000 C10 carries 3.1 of 10.0 Nm in the closed loop of C10, C30: how they share the "
              "torque is not unique");
}

TEST(TieUp, TwoPathsOfDifferentRatioBringEverythingToRest) {
    Description d;
    d.name = "two gears at once";
    d.masses = {mass("in", 1, 50), mass("p1", 0.1, 25), mass("p2", 0.1, 10), mass("out", 2, 10)};
    Gear g1, g2;
    g1.name = "g1", g1.a = "p1", g1.b = "out", g1.ratio = 2.5;
    g2.name = "g2", g2.a = "p2", g2.b = "out", g2.ratio = 1;
    d.gears = {g1, g2};
    d.clutches = {clutch("c1", "in", "p1", 200), clutch("c2", "in", "p2", 200)};
    Rig rig(d);
    rig.run(2);
    for (double speed : rig.state.speeds()) EXPECT_NEAR(speed, 0, 1e-12);
    EXPECT_EQ(rig.out("clutch.c1.state"), 0);
    EXPECT_EQ(rig.out("clutch.c2.state"), 0);
    EXPECT_NEAR(rig.out("energy.defect"), 0, 1e-6);
}

TEST(Standstill, ABrakeHoldsALoadWithoutCreepAndLetsItGoAboveItsCapacity) {
    Description d;
    d.name = "hoist";
    d.masses = {mass("drum", 3, 5)};
    d.clutches = {clutch("B", "drum", "", 100, 1.1, ActuationDirect{{}, 1})};
    TorqueSource load = source("drum", constant(-60));
    load.input = true;
    d.sources = {load};
    Rig rig(d);
    rig.run(100);
    EXPECT_EQ(rig.out("mass.drum.speed"), 0);
    EXPECT_NEAR(rig.out("clutch.B.torque"), -60, 1e-12);
    rig.in("source.drum_torque.torque") = -51;  // 111 Nm beyond 110 static
    rig.step();
    EXPECT_EQ(rig.out("clutch.B.state"), 1);
    EXPECT_NEAR(rig.out("mass.drum.speed"), -11. / 3 * 1e-3, 1e-12);
}

// The second brake would need 51 Nm of its 49.6, but for the mesh in front of it, whose loss takes the rest. That the first
// one, behind a shaft, is torn loose in the same instant is nothing to it.
TEST(Standstill, WhatNothingRigidJoinsSettlesForItself) {
    for (const Method method : {Method::etd3, Method::ark3}) {
        Description d;
        d.masses = {mass("torn", 1), mass("held", 1), mass("pushed", 1)};
        d.shafts = {{.name = "S", .a = "torn", .b = "held", .stiffness = 100, .damping = 1}};
        d.gears = {{.name = "G", .a = "pushed", .b = "held", .ratio = 1, .efficiency = 0.9, .options = {}}};
        d.clutches = {clutch("A", "torn", "", 7, 1.1), clutch("B", "held", "", 49.6 / 1.1, 1.1)};
        for (Clutch& brake : d.clutches) brake.initially_locked = true;
        d.sources = {source("torn", constant(200)), source("pushed", constant(51))};
        d.method = method;
        Rig rig(d);
        rig.step();
        EXPECT_EQ(rig.out("clutch.A.state"), 1);
        EXPECT_EQ(rig.out("clutch.B.state"), 0);
        EXPECT_EQ(rig.out("mass.held.speed"), 0);
        EXPECT_NEAR(rig.out("mass.torn.speed"), 0.193, 1e-3);
    }
}

}  // namespace
}  // namespace shiftrig::plant
