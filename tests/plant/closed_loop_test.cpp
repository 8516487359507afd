// Closed loops of friction devices: who shares a torque, what is told of it, and that nothing stays wedged in them.
#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "tests/plant/rig.h"

namespace shiftrig::plant {
namespace {

// Masses in a ring, a clutch between each and the next.
Description ring(std::mt19937& random) {
    Description d;
    d.name = "ring";
    const int n = 3 + static_cast<int>(random() % 3u);
    std::uniform_real_distribution<double> speed(-10, 10);
    for (int i = 0; i < n; ++i) {
        const std::string name = std::to_string(i);
        const double inertias[] = {0.1, 1, 3}, capacities[] = {50, 100, 300, 900};
        d.masses.push_back(mass("m" + name, inertias[random() % 3u], speed(random)));
        d.clutches.push_back(clutch("K" + name, "m" + name, "m" + std::to_string((i + 1) % n),
                                    capacities[random() % 4u], 1.2));
    }
    return d;
}

// The last clutches close in the same instant: what one brings to rest has not slipped on against itself.
TEST(ClosedLoop, ARingComesToRestWithoutTorqueInIt) {
    std::mt19937 random(5);
    for (int seed = 0; seed < 60; ++seed) {
        Description d = ring(random);
        for (const int events : {0, 1, 4}) {
            d.transition = events == 0 ? Transition::next_step : Transition::localised;
            d.maximum_events = std::max(events, 1);
            Rig rig(d);
            rig.run(3);
            for (const Event& event : rig.events) {
                if (event.kind != EventKind::break_away) continue;
                EXPECT_LT(margin(event), 1e-3 * event.capacity) << seed << ", " << events << " events";
            }
            for (const Clutch& clutch : d.clutches) {
                EXPECT_EQ(rig.out("clutch." + clutch.name + ".state"), 0)
                    << seed << ", " << events << " events";
                EXPECT_NEAR(rig.out("clutch." + clutch.name + ".torque"), 0, 1e-9);
            }
        }
    }
}

// Two ways from a to b, one through a slow shaft: they share by what their clutches hold, A = T·16 W_A/(16 W_A + W_B), whichever link
// of a gear is called the first, and however many rigid gears stand in the way.
TEST(ClosedLoop, GearsHaveNoSayInWhatIsShared) {
    const auto gear = [](const std::string& first, const std::string& second, double ratio, bool swapped) {
        return swapped ? lossy_gear(first + second, second, first, 1 / ratio, 1)
                       : lossy_gear(first + second, first, second, ratio, 1);
    };
    double shared[8] = {};
    for (int i = 0; i < 8; ++i) {
        Description d;
        d.name = "two ways";
        d.method = Method::etd3;
        for (const char* name : {"a", "x", "y", "b", "z"}) d.masses.push_back(mass(name, 1));
        d.clutches = {held("A", "a", "b", 100), held("B", "x", "y", 400)};
        d.gears = {gear("a", "x", 4, i & 1), gear("y", "z", 0.25, i & 2), gear("z", "b", 1, i & 4)};
        d.sources = {source("a", constant(50)), source("b", constant(-50))};
        Rig rig(d);
        rig.run(0.01);
        shared[i] = rig.out("clutch.A.torque");
        EXPECT_NEAR(shared[i], 40, 1e-4);
        EXPECT_NEAR(rig.out("clutch.B.torque"), 4 * (50 - shared[i]), 1e-9);
        EXPECT_NEAR(shared[i], shared[0], 1e-10);
    }
}

std::vector<Event> tie_ups(const Rig& rig) {
    std::vector<Event> list;
    std::copy_if(rig.events.begin(), rig.events.end(), std::back_inserter(list),
                 [](const Event& event) { return event.kind == EventKind::tie_up; });
    return list;
}

// Two loops one after the other, then two in the same step: each is told by itself.
TEST(ClosedLoop, EachLoopIsToldByItself) {
    Description d;
    d.name = "two loops";
    d.masses = {mass("a", 1), mass("b", 1), mass("c", 1)};
    const ActuationDirect commanded{{}, 0};
    d.clutches = {clutch("K1", "a", "b", 100, 1, ActuationDirect{{}, 1}),
                  clutch("K2", "a", "b", 100, 1, commanded), clutch("K3", "b", "c", 100, 1, commanded),
                  clutch("K4", "b", "c", 100, 1, ActuationDirect{{}, 1})};
    for (const bool together : {false, true}) {
        Rig rig(d);
        rig.run(0.01);
        EXPECT_TRUE(tie_ups(rig).empty());
        rig.in("clutch.K2.engagement") = 1;
        if (together) rig.in("clutch.K3.engagement") = 1;
        rig.run(0.02);
        rig.in("clutch.K3.engagement") = 1;
        rig.run(0.03);
        const std::vector<Event> told = tie_ups(rig);
        ASSERT_EQ(told.size(), 2u);
        EXPECT_NE(explain(rig.model, told[0]).find("closed loop of K1, K2:"), std::string::npos)
            << explain(rig.model, told[0]);
        EXPECT_NE(explain(rig.model, told[1]).find("closed loop of K3, K4:"), std::string::npos)
            << explain(rig.model, told[1]);
        EXPECT_TRUE(rig.flags & 1);
    }
}

// A ring that is closed by two brakes to the housing, on both engines; a third one makes the loop larger.
TEST(ClosedLoop, ALoopThatGrowsIsToldAgain) {
    for (const Method method : {Method::etd3, Method::ark3}) {
        Description d;
        d.name = "brakes";
        d.method = method;
        d.masses = {mass("a", 1), mass("b", 1), mass("far", 1)};
        d.clutches = {clutch("K", "a", "b", 100), clutch("A", "a", "", 100), clutch("B", "b", "", 100),
                      clutch("far", "far", "", 100), clutch("C", "b", "", 100, 1, ActuationDirect{{}, 0})};
        Rig rig(d);
        rig.run(0.01);
        rig.in("clutch.C.engagement") = 1;
        rig.run(0.02);
        const std::vector<Event> told = tie_ups(rig);
        ASSERT_EQ(told.size(), 2u);
        EXPECT_NE(explain(rig.model, told[0]).find("loop of K, A, B:"), std::string::npos);
        EXPECT_NE(explain(rig.model, told[1]).find("loop of K, A, B, C:"), std::string::npos);
    }
}

// Members behind 70 other clutches, and one that is too far from the first for its name to be told.
TEST(ClosedLoop, MembersAreNamedWhereverTheyStand) {
    Description d;
    d.name = "many";
    d.masses = {mass("a", 1), mass("b", 1)};
    const auto bystanders = [&](int count) {
        for (int i = 0; i < count; ++i) {
            const std::string name = "x" + std::to_string(d.masses.size());
            d.masses.push_back(mass(name, 1));
            d.clutches.push_back(clutch(name, name, "", 10, 1, ActuationDirect{{}, 0}));
        }
    };
    bystanders(70);
    d.clutches.push_back(clutch("K1", "a", "b", 100));
    d.clutches.push_back(clutch("K2", "a", "b", 100));
    {
        Rig rig(d);
        rig.run(0.01);
        ASSERT_EQ(tie_ups(rig).size(), 1u);
        EXPECT_NE(explain(rig.model, tie_ups(rig)[0])
                      .find("K1 carries 0.0 of 100.0 Nm in the closed loop of K1, K2:"),
                  std::string::npos);
    }
    bystanders(70);
    d.clutches.push_back(clutch("K3", "a", "b", 100));
    Rig rig(d);
    rig.run(0.01);
    ASSERT_EQ(tie_ups(rig).size(), 1u);
    EXPECT_NE(explain(rig.model, tie_ups(rig)[0]).find("loop of K1, K2 and others:"), std::string::npos);
}

// 70 brakes on one mass close in the first step: 71 changes with the loop, of which 63 can be told. The loop is told by the next step.
TEST(ClosedLoop, ALoopThatAStepCannotTellIsToldByTheNext) {
    Description d;
    d.name = "many brakes";
    d.masses = {mass("a", 1)};
    for (int i = 0; i < 70; ++i) d.clutches.push_back(clutch("B" + std::to_string(i), "a", "", 10));
    Rig rig(d);
    rig.step();
    EXPECT_TRUE(tie_ups(rig).empty());
    EXPECT_EQ(rig.events.back().kind, EventKind::untold);
    EXPECT_EQ(rig.events.back().value, 70 - 63);
    rig.step();
    EXPECT_EQ(tie_ups(rig).size(), 1u);
}

// Two brakes on one shaft; the weaker one breaks away under the load, and pushes on at rest when the load has gone: what is
// left between both hangs on what has been, and the certificate says so.
TEST(ClosedLoop, TorqueThatStaysWedgedIsFlagged) {
    Description d;
    d.name = "wedged";
    d.masses = {mass("a", 1)};
    d.clutches = {clutch("weak", "a", "", 10, 1), clutch("strong", "a", "", 100, 1)};
    TorqueSource load = source("a", constant(0));
    load.input = true;
    d.sources = {load};
    Rig rig(d);
    rig.in("source.a_torque.torque") = 105;  // shared 1 : 10 it would be 9.5 and 95.5
    rig.run(0.01);
    rig.in("clutch.weak.stuck") = 0;
    rig.in("source.a_torque.torque") = 109.9;
    rig.run(0.02);
    EXPECT_EQ(rig.outputs.certificate.flags & 1, 1);
    rig.in("source.a_torque.torque") = 0;
    rig.run(0.03);
    const double weak = rig.out("clutch.weak.torque"), strong = rig.out("clutch.strong.torque");
    EXPECT_NEAR(weak + strong, 0, 1e-9);
    EXPECT_EQ(rig.outputs.certificate.flags & 1, 1);
}

}  // namespace
}  // namespace shiftrig::plant
