// Shafts, also such as end on the housing, against closed forms and against the same machine with a mass that does not move.
#include "plant/connectors/shaft.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/plant/rig.h"

namespace shiftrig::plant {
namespace {

Shaft mount(const char* a, const char* b, double stiffness, double damping = 0) {
    return {.name = "mount", .a = a, .b = b, .stiffness = stiffness, .damping = damping};
}

// ω² = k/J, ζ = d/(2 √(k J)); let go at a twist of 0.1. The engine for long chains is of order 4, ωh = 0.02 here.
TEST(Shaft, ToTheHousingSwingsAsTheClosedFormDoes) {
    for (const Method method : {Method::etd3, Method::ark3}) {
        const bool exact = method == Method::etd3;
        Description d;
        d.method = method;
        d.masses = {mass("m", 2)};
        d.shafts = {mount("m", "", 800, 4)};
        d.shafts[0].initial_twist = 0.1;
        Rig rig(d);
        rig.run(1);
        const double omega = 20, zeta = 4 / (2 * std::sqrt(800. * 2)),
                     damped = omega * std::sqrt(1 - zeta * zeta);
        const double envelope = 0.1 * std::exp(-zeta * omega), phase = damped;
        EXPECT_NEAR(rig.out("shaft.mount.twist"),
                    envelope * (std::cos(phase) + zeta * omega / damped * std::sin(phase)),
                    exact ? 1e-12 : 1e-7);
        EXPECT_NEAR(rig.out("mass.m.speed"), -envelope * omega * omega / damped * std::sin(phase),
                    exact ? 1e-11 : 1e-6);
        EXPECT_NEAR(rig.out("energy.defect"), 0, exact ? 1e-9 : 1e-6);
        EXPECT_NEAR(rig.out("energy.stored") + rig.out("energy.dissipated"), 0.5 * 800 * 0.01,
                    exact ? 1e-9 : 1e-6);
    }
}

// More springs than pairs and gears: two masses that have nothing to do with them, and the clutch that closes between them, go
// their own way. The clutch passes 100 t Nm at most, 110 t Nm locked; a load of 50 Nm tears it loose at once, and it closes when
// ∫(50 − 2 · 100 t) dt = 0, at 0.5 s.
TEST(Shaft, ManyToTheHousingLeaveOthersAlone) {
    for (const Method method : {Method::etd3, Method::ark3}) {
        for (int mounts = 0; mounts <= 9; ++mounts) {
            Description d;
            d.method = method;
            d.masses = {mass("a", 1), mass("b", 1)};
            for (int j = 0; j < mounts; ++j) {
                const std::string name = "m" + std::to_string(j);
                d.masses.push_back(mass(name, 1));
                d.shafts.push_back(mount(name.c_str(), "", 1000, 1));
                d.shafts.back().name += name;
                d.shafts.back().initial_twist = 0.01;
            }
            d.clutches = {
                clutch("c", "a", "b", 100, 1.1, ActuationDirect{Waveform{{{.from = 0, .slope = 1}}}, 0})};
            d.sources = {source("b", constant(50))};
            Rig rig(d);
            rig.run(1);
            const auto locks = rig.times(EventKind::lock, "c");
            ASSERT_FALSE(locks.empty()) << mounts;
            EXPECT_NEAR(locks.back(), 0.5, 1e-6) << mounts;
            EXPECT_NEAR(rig.out("mass.a.speed"), 25, 1e-9) << mounts << ' ' << rig.model.engine();
            EXPECT_NEAR(rig.out("mass.b.speed"), 25, 1e-9) << mounts;
            EXPECT_LT(std::fabs(rig.out("energy.defect")), 1e-5) << mounts;
            EXPECT_EQ(rig.fall_backs, 0) << mounts;
        }
    }
}

// A brake on the mass takes what the spring has; a play in place of the spring lets it swing freely between its flanks.
TEST(Shaft, ToTheHousingIsOneToAMassThatDoesNotMove) {
    for (const double gap : {0., 0.02}) {
        Description held, grounded;
        for (Description* d : {&held, &grounded}) {
            const bool ground = d == &held;
            d->masses = {mass("in", 0.5, 3), mass("out", 1)};
            if (ground) d->masses.push_back(mass("ground", 1));
            d->gears = {lossy_gear("gear", "in", "out", 2, 0.9, 0.1)};
            d->clutches = {clutch("drag", "in", "", 0.5, 1.2)};
            if (ground) {
                d->clutches.push_back(clutch("holds", "ground", "", 1e9));
                d->clutches.back().initially_locked = true;
            }
            const char* const end = ground ? "ground" : "";
            if (gap > 0) {
                d->backlashes = {{.name = "mount",
                                  .a = "out",
                                  .b = end,
                                  .stiffness = 500,
                                  .damping = 1,
                                  .gap = gap,
                                  .initial_twist = 0}};
            } else {
                d->shafts = {mount("out", end, 500, 1)};
            }
            d->sources = {source("in", sine(8, 3))};
        }
        Rig a(held), b(grounded);
        while (a.state.time() < 1) {
            a.step();
            b.step();
            for (const char* name : {"mass.in.speed", "mass.out.speed", "gear.gear.torque", "energy.stored"})
                ASSERT_NEAR(a.out(name), b.out(name), 1e-9 * (1 + std::fabs(a.out(name))))
                    << name << " at " << a.state.time();
        }
        EXPECT_EQ(a.events.size(), b.events.size());
        EXPECT_GT(b.events.size(), 5u);
    }
}

TEST(Shaft, ToTheHousingHoldsAtTheStartWhatNobodyMoves) {
    Description d;
    d.masses = {mass("engine", 1), mass("ring", 0.1), mass("carrier", 1)};
    d.planetaries = {{.name = "row", .sun = "engine", .ring = "ring", .carrier = "carrier", .ratio = -2}};
    d.shafts = {mount("ring", "", 1e4, 5)};
    Rig rig(d);
    start(rig.model, rig.state, {{}, {{"engine", 90}}}, rig.inputs);
    EXPECT_NEAR(rig.state.speeds()[1], 0, 1e-12);
    EXPECT_NEAR(rig.state.speeds()[2], 30, 1e-12);
    start(rig.model, rig.state, {{}, {{"engine", 90}, {"ring", 6}}}, rig.inputs);
    EXPECT_NEAR(rig.state.speeds()[1], 6, 1e-12);

    // Also behind another shaft.
    Description line;
    line.masses = {mass("m", 1), mass("n", 1)};
    line.shafts = {mount("n", "", 1e4), {.name = "shaft", .a = "m", .b = "n", .stiffness = 1e3}};
    Rig two(line);
    start(two.model, two.state, {{}, {{"m", 4}}}, two.inputs);
    EXPECT_NEAR(two.state.speeds()[0], 4, 1e-12);
    EXPECT_NEAR(two.state.speeds()[1], 4, 1e-12);
}

TEST(Shaft, ToTheHousingWithPlayIsNotForTheEngineOfLongChains) {
    Description d;
    d.masses = {mass("m", 2)};
    d.method = Method::ark3;
    d.shafts = {mount("m", "", 800)};
    EXPECT_EQ(Model::build(d).engine(), "ark3");
    d.backlashes = {{.name = "play", .a = "m", .b = "", .stiffness = 500, .damping = 1, .gap = 0.1}};
    EXPECT_THROW(Model::build(d), ModelError);
}

}  // namespace
}  // namespace shiftrig::plant
