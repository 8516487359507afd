// What the plant says of each change of state.
#include <cmath>
#include <string>
#include <vector>

#include "tests/plant/rig.h"

namespace shiftrig::plant {
namespace {

Description driven_to_rest() {
    Description d;
    d.name = "two inertias";
    d.masses = {mass("fast", 2.6, 188.5), mass("slow", 1.0)};
    d.clutches = {clutch("C", "fast", "slow", 1500)};
    return d;
}

std::vector<std::string> told(Rig& rig, double seconds) {
    std::vector<std::string> lines;
    for (const double end = rig.state.time() + seconds; rig.state.time() < end - 1e-9;) {
        rig.step();
        for (int e = 0; e < rig.outputs.event_count; ++e) {
            lines.push_back(explain(rig.model, rig.outputs.events[static_cast<std::size_t>(e)]));
        }
    }
    return lines;
}

TEST(Explain, AClosingClutchIsToldWithTheTorqueItCarriesFromThenOn) {
    Description d = driven_to_rest();
    d.sources = {source("fast", constant(36))};  // M12 = 36·1/(2.6 + 1)
    Rig rig(d);
    const auto lines = told(rig, 0.2);
    ASSERT_FALSE(lines.empty());
    EXPECT_EQ(lines.back().find("t=0.0913684 C locks: slip "), 0u) << lines.back();
    EXPECT_NE(lines.back().find(", torque 10.0 of 1500.0 Nm static"), std::string::npos) << lines.back();
}

// η = 0.5, u = 1: a drives with 10 Nm, 8 Nm on b resist. Moving, M = 12 and ω̇ = −2 rad/s²; at rest M = 10, of which the
// mesh keeps 2 from b and could keep 5. Without the drive M = 0, no loss, and b is free to go.
TEST(Explain, AStuckMeshIsToldWithWhatItNeedsAndWhatItsLossAllows) {
    Description d;
    d.name = "gear";
    d.masses = {mass("a", 1, 1), mass("b", 1, 1)};
    d.gears = {lossy_gear("g", "a", "b", 1, 0.5)};
    TorqueSource drive = source("a", constant(10));
    drive.waveform.pieces[0].until = 0.6;
    d.sources = {drive, source("b", constant(-8))};
    Rig rig(d);
    EXPECT_EQ(told(rig, 0.7),
              (std::vector<std::string>{
                  "t=0.5000000 g sticks: rest needs 2.0 Nm of its losses, which allow 5.0",
                  "t=0.6000000 g moves again: rest would need 8.0 Nm of its losses, which allow 0.0",
                  "t=0.6010000 g is driven: torque on its first link 2.7 Nm"}));
}

// What begins to be pressed at rest can hold nothing in this instant: that is no locking, and no breaking away.
TEST(Explain, APairThatBeginsToPressAtRestEngagesAndLocksOnceItHoldsItsShare) {
    Description d;
    d.name = "held";
    d.masses = {mass("m", 1)};
    d.clutches = {
        held("holds", "m", "", 25),
        clutch("joins", "m", "", 10, 1, ActuationDirect{.profile = {{{.from = 0.01, .slope = 20}}}})};
    d.sources = {source("m", constant(8))};
    Rig rig(d);
    // Its share is 10/35 of the load, as nominal capacities are: after 11.43 ms.
    EXPECT_EQ(
        told(rig, 0.1),
        (std::vector<std::string>{
            "t=0.0100000 joins engages: slip 0.000 rad/s, capacity 0.0 Nm",
            "t=0.0214289 joins locks: slip 0, torque 2.3 of 2.3 Nm static",
            "t=0.0220000 holds carries 5.7 of 25.0 Nm in the closed loop of holds, joins: how they share "
            "the torque is not unique"}));
}

// 250 Nm s/s against 50: it gives way in the instant in which it is first pressed, in the sense in which the load will pull.
TEST(Explain, APairThatIsPressedUnderALoadThatGrowsFasterOnlyEngages) {
    for (const double sense : {1., -1.}) {
        Description d;
        d.name = "outgrown";
        d.masses = {mass("a", 0.6), mass("b", 0.04)};
        d.clutches = {
            clutch("K", "a", "b", 50, 1.2, ActuationDirect{.profile = {{{.from = 0.05, .slope = 1}}}})};
        TorqueSource load = source("b", constant(0));
        load.waveform.pieces = {{.from = 0.05, .slope = 300 * sense}};
        d.sources = {load};
        Rig rig(d);
        EXPECT_EQ(told(rig, 0.1),
                  (std::vector<std::string>{"t=0.0500000 K engages: slip 0.000 rad/s, capacity 0.0 Nm"}));
        const double square = 0.5 * 0.05 * 0.05;
        EXPECT_NEAR(rig.state.speeds()[0], sense * 50 / 0.6 * square, 1e-9);
        EXPECT_NEAR(rig.state.speeds()[1], sense * 250 / 0.04 * square, 1e-9);
        EXPECT_EQ(rig.fall_backs, 0);
    }
}

// Driven through no slip by more than it holds, it passes on as much the other way. It neither locks nor breaks away.
TEST(Explain, ASlipThatChangesItsSenseIsOneEvent) {
    Description d = driven_to_rest();
    d.clutches = {clutch("C", "fast", "slow", 100, 1.2)};
    d.sources = {source("fast", constant(-600))};
    Rig rig(d);
    // (600 + 100)/2.6 + 100/1 rad/s² between them; together 166.7 Nm of 120.
    EXPECT_EQ(told(rig, 1), (std::vector<std::string>{
                                "t=0.0000000 C engages: slip 188.500 rad/s, capacity 100.0 Nm",
                                "t=0.5105208 C slips the other way: torque -100.0 of 100.0 Nm sliding"}));
}

// At rest beside a locked brake a mesh may lean on it; it is told to move when the brake lets go.
TEST(Explain, AMeshThatABrakeHeldIsToldToMoveAgain) {
    Description d;
    d.name = "braked";
    d.masses = {mass("a", 1), mass("b", 3)};
    d.gears = {lossy_gear("g", "a", "b", 2, 0.9)};
    d.clutches = {held("B", "b", "", 50, 1.2)};
    TorqueSource drive = source("a", constant(0));
    drive.waveform.pieces = {{.from = 0, .slope = 20}};
    d.sources = {drive};
    Rig rig(d);
    // 60 Nm = 2·0.9·20 Nm/s·t
    EXPECT_EQ(told(rig, 2), (std::vector<std::string>{
                                "t=0.0000000 g sticks: rest needs 0.0 Nm of its losses, which allow 0.0",
                                "t=1.6666667 B breaks away: torque 60.0 at its limit of 60.0 Nm static",
                                "t=1.6666667 g moves again, with others that held it"}));
}

// Two meshes of one motion, and an axle at rest behind a shaft: each is told with what all the losses of its motion are.
TEST(Explain, MeshesThatGoTogetherAreToldWithWhatTheirMotionNeeds) {
    Description d;
    d.name = "axle";
    d.masses = {mass("p1", 0.02), mass("p2", 0.02), mass("o", 0.3), mass("c", 0.1), mass("l", 3)};
    d.gears = {lossy_gear("G1", "p1", "o", 3, 0.97, 0.05), lossy_gear("G2", "p2", "o", 2, 0.97, 0.05),
               lossy_gear("AX", "c", "l", 4, 0.95, 1)};
    Shaft half_shaft;
    half_shaft.name = "s", half_shaft.a = "o", half_shaft.b = "c";
    half_shaft.stiffness = 1000, half_shaft.damping = 1;
    d.shafts = {half_shaft};
    TorqueSource drive = source("p1", constant(0));
    drive.waveform.pieces = {{.from = 0.1, .slope = 1}};
    d.sources = {drive};
    Rig rig(d);
    std::vector<std::string> lines = told(rig, 0.2);
    ASSERT_GE(lines.size(), 2u);
    lines.erase(lines.begin(), lines.end() - 2);
    EXPECT_EQ(lines,
              (std::vector<std::string>{
                  "t=0.1859137 G1 moves again: rest would need 0.0859 Nm of its losses, which allow 0.0859",
                  "t=0.1859137 G2 moves again: rest would need 0.129 Nm of its losses, which allow 0.129"}));
}

// A brake drives its gear through rest: no loss could hold it, and none was asked.
TEST(Explain, AMeshThatOthersCarryThroughRestIsToldSo) {
    Description d;
    d.name = "carried";
    d.masses = {mass("a", 1, 8), mass("b", 1, 4)};
    d.gears = {lossy_gear("G", "a", "b", 2, 0.9)};
    d.clutches = {clutch("B", "b", "", 10)};
    d.sources = {source("a", constant(-50))};
    Rig rig(d);
    const std::vector<std::string> lines = told(rig, 0.2);
    ASSERT_GE(lines.size(), 3u);
    EXPECT_EQ(lines[1], "t=0.1798165 B slips the other way: torque -10.0 of 10.0 Nm sliding");
    EXPECT_EQ(lines[2], "t=0.1798165 G passes through rest, carried along by others");
}

// A brake is released at a tick, which tears another one loose that held beside it.
TEST(Explain, CausesAreToldBeforeWhatFollows) {
    Description d;
    d.name = "two brakes";
    d.masses = {mass("a", 1)};
    Waveform released = constant(1, -1e300, 1);
    Waveform applied;
    applied.pieces = {{.from = 0.5, .slope = 1}};
    d.clutches = {clutch("B2", "a", "", 30, 1.1, ActuationDirect{.profile = applied}),
                  held("B1", "a", "", 50, 1.3, ActuationDirect{.profile = released})};
    d.sources = {source("a", constant(30))};
    Rig rig(d);
    std::vector<std::string> lines = told(rig, 1.1);
    ASSERT_GE(lines.size(), 2u);
    lines.erase(lines.begin(), lines.end() - 2);
    EXPECT_EQ(lines,
              (std::vector<std::string>{"t=1.0000000 B1 is free: slip 0.000 rad/s",
                                        "t=1.0000000 B2 breaks away: torque 30.0 beyond 16.5 Nm static"}));
}

// Where a run's account begins, what rests is told, though it has rested before.
TEST(Explain, WhatRestsWhereTheAccountBeginsIsTold) {
    Description d;
    d.name = "gear";
    d.masses = {mass("a", 1), mass("b", 1)};
    d.gears = {lossy_gear("g", "a", "b", 1, 0.5)};
    d.sources = {source("a", constant(10)), source("b", constant(-8))};
    Rig rig(d);
    const std::vector<std::string> rests = {
        "t=0.0000000 g sticks: rest needs 2.0 Nm of its losses, which allow 5.0"};
    EXPECT_EQ(told(rig, 0.1), rests);
    begin_account(rig.model, rig.state);
    EXPECT_EQ(told(rig, 0.1), rests);
}

// A pinion that nothing loads turns its power to and fro with every swing; the loaded one is told once a reversal.
TEST(Explain, AReversalOfPowerIsToldOnceTheMeshIsLoaded) {
    Description d;
    d.name = "two pinions";
    d.masses = {mass("a", 1, 100), mass("b", 1, 100), mass("idle", 1e-3, 100)};
    Gear loaded, idle;
    loaded.name = "g", loaded.a = "a", loaded.b = "b", loaded.ratio = 1, loaded.efficiency = 0.98;
    idle = loaded;
    idle.name = "idling", idle.a = "idle";
    d.gears = {loaded, idle};
    d.clutches = {clutch("C", "idle", "", 50, 1, ActuationDirect{{}, 0})};
    Waveform wave;
    wave.pieces = {{.amplitude = 20, .frequency = 5}};
    d.sources = {source("a", wave)};
    Rig rig(d);
    const auto lines = told(rig, 0.4);
    ASSERT_EQ(lines.size(), 3u);  // at 0.1, 0.2 and 0.3 s, as soon as 0.5 Nm are on it
    for (const auto& line : lines) EXPECT_NE(line.find(" g "), std::string::npos) << line;
}

// The same gear, never in motion: it is told when the run begins, once.
TEST(Explain, AMeshAtRestFromTheBeginningIsTold) {
    Description d;
    d.name = "gear";
    d.masses = {mass("a", 1), mass("b", 1)};
    d.gears = {lossy_gear("g", "a", "b", 1, 0.5, 0)};
    d.sources = {source("a", constant(10)), source("b", constant(-8))};
    for (const Method method : {Method::etd3, Method::ark3}) {
        d.method = method;
        Rig rig(d);
        EXPECT_EQ(told(rig, 0.5),
                  (std::vector<std::string>{
                      "t=0.0000000 g sticks: rest needs 2.0 Nm of its losses, which allow 5.0"}));
    }
}

// Two gears of ratio 1 in a row are one motion. 10 Nm drive, and its mass is all at rest: η² = 0.25 of them come
// through, so that 2.5 … 10 Nm at the end are held. With 8 of these, 2 are needed; what is not there is not told of either gear.
TEST(Explain, GearsOfOneMotionAreToldWithAllTheirLosses) {
    Description d;
    d.name = "two gears";
    d.masses = {mass("a", 1), mass("b", 1), mass("c", 1)};
    d.gears = {lossy_gear("g", "a", "b", 1, 0.5, 0), lossy_gear("h", "b", "c", 2, 0.5, 0)};
    TorqueSource load = source("c", constant(-16));
    load.input = true;
    d.sources = {source("a", constant(10)), load};
    Rig rig(d);
    rig.step();
    ASSERT_EQ(rig.events.size(), 2u);
    // At g 2 are needed; as they go, b and c take 10 · 0.5 and, behind h, 5 · 2 · 0.5 of the 16: 5.5 more than drives them.
    EXPECT_NEAR(rig.events[0].torque, 2, 1e-9);
    EXPECT_NEAR(rig.events[1].torque, 2 / 1., 1e-9);
    for (const Event& event : rig.events) {
        EXPECT_EQ(event.kind, EventKind::mesh_sticks);
        EXPECT_GT(margin(event), 0);
    }
}

// Four gears without loss by load, 1 Nm in the bearing of each: the train takes 4 Nm, however little of it is needed.
TEST(Explain, WhatATrainAllowsDoesNotHangOnItsLoad) {
    for (const double load : {0., 0.01, 0.5, 3.}) {
        for (const Method method : {Method::etd3, Method::ark3}) {
            Description d;
            d.name = "train";
            d.method = method;
            d.masses = {mass("m0", 1)};
            for (int i = 1; i <= 4; ++i) {
                const std::string name = std::to_string(i);
                d.masses.push_back(mass("m" + name, 1));
                d.gears.push_back(lossy_gear("g" + name, "m" + std::to_string(i - 1), "m" + name, 1, 1, 1));
            }
            d.sources = {source("m0", constant(load))};
            Rig rig(d);
            rig.step();
            ASSERT_EQ(rig.events.size(), 4u);
            for (const Event& event : rig.events) {
                EXPECT_NEAR(event.torque, load, 1e-9);
                EXPECT_NEAR(event.capacity, 4, 1e-6) << load;
            }
        }
    }
}

// A load that swings through zero speed faster than any loss could hold it: one line, not "sticks" and "moves".
TEST(Explain, AMeshThatOnlyPassesThroughRestIsToldOnce) {
    Description d;
    d.name = "gear";
    d.masses = {mass("a", 1, 1), mass("b", 1, 1)};
    d.gears = {lossy_gear("g", "a", "b", 1, 0.9, 0)};
    d.sources = {source("b", constant(-10))};
    Rig rig(d);
    const auto lines = told(rig, 0.4);
    ASSERT_FALSE(lines.empty());
    EXPECT_NE(lines[0].find(" g passes through rest: rest would need "), std::string::npos) << lines[0];
    EXPECT_LT(margin(rig.events[0]), 0);
    EXPECT_TRUE(rig.times(EventKind::mesh_sticks, "g").empty());
}

TEST(Explain, SmallTorquesAreNotRoundedToNothing) {
    Description d = driven_to_rest();
    d.clutches[0] = clutch("C", "fast", "slow", 5e-4, 1.2);
    d.masses = {mass("fast", 1e-6, 10), mass("slow", 1e-6)};
    d.sources = {};
    Rig rig(d);
    const auto lines = told(rig, 0.2);
    EXPECT_NE(lines.back().find(" of 0.0006 Nm static"), std::string::npos) << lines.back();
}

TEST(Explain, ABodyThatMovesStraightOnHasForces) {
    Description d;
    d.name = "sledge";
    d.masses = {{"sledge", 10, Motion::translating, 1}};
    d.clutches = {clutch("skid", "sledge", "", 50, 1.2)};
    Rig rig(d);
    const auto lines = told(rig, 0.5);
    EXPECT_NE(lines.back().find(", force 0.0 of 60.0 N static"), std::string::npos) << lines.back();

    const auto unit = [&](const std::string& name) {
        for (const Signal& output : rig.model.outputs()) {
            if (output.name == name) return std::string(symbol(output.unit));
        }
        return "there is no " + name;
    };
    EXPECT_EQ(unit("clutch.skid.torque"), "N");
    EXPECT_EQ(unit("clutch.skid.capacity"), "N");
    EXPECT_EQ(unit("clutch.skid.slip"), "m/s");
    EXPECT_EQ(unit("clutch.skid.heat"), "J");
}

// More brakes than a step can tell of close in the first one.
TEST(Explain, WhatAStepCannotTellIsCounted) {
    Description d;
    d.name = "many";
    constexpr int brakes = 100;
    for (int i = 0; i < brakes; ++i) {
        const std::string name = std::to_string(i);
        d.masses.push_back(mass("m" + name, 1));
        d.clutches.push_back(clutch("c" + name, "m" + name, "", 10));
    }
    Rig rig(d);
    rig.step();
    EXPECT_EQ(rig.outputs.event_count, brakes);
    ASSERT_EQ(rig.events.size(), 64u);
    EXPECT_EQ(rig.events.back().kind, EventKind::untold);
    EXPECT_EQ(rig.events.back().value, brakes - 63);
    EXPECT_EQ(explain(rig.model, rig.events.back()),
              "t=0.0000000 model has 37 more changes of state in this step than it can tell");
}

}  // namespace
}  // namespace shiftrig::plant
