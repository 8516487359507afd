// What the reference solver says about the plant: hard cases, wrong models, random machines.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/plant/comparison.h"
#include "tests/plant/random_vehicles.h"
#include "tests/plant/reference/cases.h"
#include "tests/plant/rig.h"

namespace shiftrig {
namespace {

using namespace plant;

Description two_masses(double j1, double j2, double m1, double m2, double capacity) {
    Description d;
    d.masses = {{.name = "first", .inertia = j1}, {.name = "second", .inertia = j2}};
    d.clutches = {clutch("clutch", "first", "second", capacity)};
    d.clutches[0].initially_locked = true;
    d.sources = {{.name = "drive", .mass = "first", .waveform = {{{.offset = m1}}}},
                 {.name = "load", .mass = "second", .waveform = {{{.offset = m2}}}}};
    return d;
}

// A ring of 1e-4 kg m² between 150 Nm on either side: 1.5e6 rad/s² if anything is switched a step late.
TEST(LightBody, FollowsTheReferenceWhileBrakeAndClutchHandOver) {
    const Description d = cases::light_body();
    const reference::System system(d);
    reference::Solver solver(system);
    const auto truth = solver.run(3.0, {.step = 1e-5});
    ASSERT_FALSE(truth.gave_up);
    Rig rig(d);
    double worst = 0;
    for (std::size_t k = 1; k < truth.samples.size(); ++k) {
        rig.step();
        for (int m = 0; m < 3; ++m)
            worst = std::max(
                worst, std::abs(rig.state.speeds()[static_cast<std::size_t>(m)] - truth.samples[k].z[m]));
    }
    EXPECT_LT(worst, 1e-3);
    EXPECT_EQ(rig.out("clutch.clutch.state"), 0);  // direct drive
}

// [Algin] eq. (2) compares the applied torque with the capacity. Here 1 Nm is applied, the capacity is 3 Nm, and
// the clutch would have to carry (J2 M1 − J1 M2)/(J1 + J2) = 9.1 Nm.
TEST(WrongModels, ComparingTheAppliedTorqueWouldHoldAClutchThatSlips) {
    const double j1 = 9, j2 = 1, m1 = 1, m2 = -10, capacity = 3;
    Rig rig(two_masses(j1, j2, m1, m2, capacity));
    for (int k = 0; k < 1000; ++k) rig.step();
    const double held = (m1 + m2) / (j1 + j2);  // the wrong model: |1| < 3, so both move as one
    EXPECT_NEAR(rig.out("mass.first.speed"), (m1 - capacity) / j1, 1e-9);
    EXPECT_NEAR(rig.out("mass.second.speed"), (m2 + capacity) / j2, 1e-9);
    EXPECT_GT(std::abs(rig.out("mass.second.speed") - held), 5);
    EXPECT_EQ(rig.out("clutch.clutch.state"), 1);
}

// … and the other way round: 10 Nm applied, 3 Nm capacity, 1.9 Nm carried.
TEST(WrongModels, ComparingTheAppliedTorqueWouldOpenAClutchThatHolds) {
    Rig rig(two_masses(9, 1, 10, -1, 3));
    for (int k = 0; k < 100; ++k) {
        rig.step();
        EXPECT_EQ(rig.out("clutch.clutch.state"), 0);
    }
    EXPECT_NEAR(rig.out("clutch.clutch.torque"), 1.9, 1e-12);
}

// [Algin] eq. (1) closes where |Δω| < ε. Slip passes such a band within a step (2.08 rad/s each), and is then driven
// to and fro across zero for ever; or the band is wide, and what closes is not yet equal.
TEST(WrongModels, ASmallSlipIsNoReasonToClose) {
    const double j1 = 2.6, j2 = 1, capacity = 1500, h = 1e-3;
    const auto eq_1 = [&](double band, double* jump) {
        double w1 = 188.5, w2 = 0;
        for (int k = 0; k < 1000; ++k) {
            if (std::abs(w1 - w2) < band) {
                *jump = std::abs(w1 - w2);
                return true;
            }
            const double sign = w1 > w2 ? 1 : -1;
            w1 -= h * sign * capacity / j1;
            w2 += h * sign * capacity / j2;
        }
        return false;
    };
    double jump = 0;
    EXPECT_FALSE(eq_1(0.3, &jump));
    EXPECT_TRUE(eq_1(5, &jump));
    EXPECT_GT(jump, 0.5);
    Rig rig(cases::two_inertias());
    rig.run(0.2);
    EXPECT_NEAR(rig.times(EventKind::lock, "clutch").at(0), 188.5 / (capacity / j1 + capacity / j2), 1e-9);
    EXPECT_EQ(rig.out("clutch.clutch.slip"), 0);
}

// [Algin] eq. (9) against eq. (15): accelerations and torques together, or torques alone.
TEST(KinematicMethod, AgreesWithTheMethodOfInternalTorques) {
    Description
        d;  // the article's Fig. 5 with F1 closed (its row then turns as a block), a lossy gear before it
    d.masses = {{.name = "m1", .inertia = 1.3},
                {.name = "m2", .inertia = 0.4},
                {.name = "m3", .inertia = 2.1},
                {.name = "m4", .inertia = 5},
                {.name = "input", .inertia = 0.7}};
    Gear gear;
    gear.name = "G";
    gear.a = "input";
    gear.b = "m1";
    gear.ratio = 1.7;
    gear.efficiency = 0.95;
    d.gears = {gear};
    d.shafts = {{.name = "E", .a = "m3", .b = "m4", .stiffness = 900}};
    d.dampers = {{.name = "K", .a = "m3", .b = "m4", .damping = 3}};
    Planetary row;
    row.name = "D";
    row.sun = "m1";
    row.ring = "m2";
    row.carrier = "m3";
    row.ratio = -2;
    d.planetaries = {row};
    d.clutches = {clutch("F1", "m1", "m2", 500)};
    d.clutches[0].initially_locked = true;
    d.sources = {{.name = "drive", .mass = "input", .waveform = {{{.offset = 40}}}},
                 {.name = "load", .mass = "m4", .waveform = {{{.offset = -15}}}}};
    const reference::System system(d);
    reference::Solver solver(system);
    const auto truth = solver.run(0.1, {.step = 1e-5});
    Rig rig(d);
    for (int k = 1; k <= 100; ++k) {
        rig.step();
        const auto& sample = truth.samples[static_cast<std::size_t>(k)];
        ASSERT_NEAR(rig.out("clutch.F1.torque"), sample.friction_torque[0], 1e-8) << k;
        ASSERT_NEAR(rig.out("gear.G.torque"), sample.mesh_torque[0], 1e-8) << k;
        ASSERT_NEAR(rig.out("row.D.sun"), sample.mesh_torque[1], 1e-8) << k;
    }
}

void expect_agreement(const RandomSystem& system, std::uint64_t seed, const Comparison& c) {
    EXPECT_TRUE(c.broken.empty()) << "seed " << seed << ": " << c.broken.front();
    EXPECT_TRUE(c.outcome == Outcome::agrees || c.outcome == Outcome::sensitive)
        << "seed " << seed << " " << name(c.outcome) << ": " << c.worst << " tolerances on " << c.worst_signal
        << " at " << c.worst_time << " s\n"
        << describe(system.description);
}

TEST(RandomSystems, AFixedSubsetAgreesWithTheReferenceSolver) {
    const ComparisonOptions options;
    int agreeing = 0;
    for (std::uint64_t seed = 1; seed <= 60; ++seed) {
        const RandomSystem system = random_system(seed, options.seconds);
        const Comparison c = compare(system, seed, options);
        expect_agreement(system, seed, c);
        agreeing += c.outcome == Outcome::agrees;
    }
    EXPECT_GE(agreeing, 59);
}

TEST(RandomSystems, WithFreewheelsAgreeWithTheReferenceSolver) {
    const ComparisonOptions options;
    int agreeing = 0, compared = 0, freewheels = 0;
    for (std::uint64_t seed = 1; seed <= 60; ++seed) {
        const RandomSystem system = random_system_with_freewheels(seed, options.seconds);
        if (system.description.freewheels.empty()) continue;
        freewheels += static_cast<int>(system.description.freewheels.size());
        const Comparison c = compare(system, seed, options);
        expect_agreement(system, seed, c);
        ++compared;
        agreeing += c.outcome == Outcome::agrees;
    }
    EXPECT_GE(freewheels, 60);
    EXPECT_GE(agreeing, compared - 2);
}

// In 140 a clutch at rest between four lossy gears is held, in the one mesh that stands for all of them, by more than it could lose.
TEST(RandomSystems, OnSpringsToTheHousingAgreeWithTheReferenceSolver) {
    const ComparisonOptions options;
    const auto check = [&](const RandomSystem& system, std::uint64_t seed) {
        const RandomSystem mounted = with_mounts(system, seed);
        const Comparison c = compare(mounted, seed, options);
        EXPECT_TRUE(c.broken.empty()) << "seed " << seed << ": " << c.broken.front();
        EXPECT_EQ(name(c.outcome), std::string("agrees"))
            << "seed " << seed << ": " << c.worst << " tolerances on " << c.worst_signal << " at "
            << c.worst_time << " s\n"
            << describe(mounted.description);
    };
    for (std::uint64_t seed = 1; seed <= 25; ++seed) check(random_system(seed, options.seconds), seed);
    check(random_system(140, options.seconds), 140);
    for (std::uint64_t seed = 1; seed <= 10; ++seed)
        check(random_system_with_backlashes(seed, options.seconds), seed);
}

// Closed loops of pairs and lossy meshes at rest, where it takes several devices together to see what moves: two pairs
// with the mesh between them (3043, 4844), a pair driven back by others that engage (610), a pair that breaks away before another
// that could hold (203, 521), freewheels whose share of a load has no sign of its own (324, 388, 536, 1492), changes within one step that
// come in another order than their first estimates (957, 1180), torques at the very kink of a mesh's losses (278, 954).
TEST(RandomSystems, LoopsAtRestLetGoTogether) {
    const ComparisonOptions options;
    const auto check = [&](const RandomSystem& system, std::uint64_t seed) {
        const Comparison c = compare(system, seed, options);
        EXPECT_TRUE(c.broken.empty()) << "seed " << seed << ": " << c.broken.front();
        EXPECT_EQ(name(c.outcome), std::string("agrees"))
            << "seed " << seed << ": " << c.worst << " tolerances";
        EXPECT_EQ(c.fall_backs, 0) << "seed " << seed;
    };
    for (const std::uint64_t seed : {3043u, 4844u, 610u, 203u, 521u})
        check(random_system(seed, options.seconds), seed);
    for (const std::uint64_t seed : {324u, 388u, 536u, 1492u, 957u, 1180u, 278u, 954u})
        check(random_system_with_freewheels(seed, options.seconds), seed);
}

// A slip on a light mass, where friction falls by its slope within 25 µs, grows out of a torque that nobody sees.
TEST(RandomSystems, SlipsThatGrowByThemselvesAreFollowedFromTheStart) {
    const ComparisonOptions options;
    for (const std::uint64_t seed : {51046u, 51060u, 51095u}) {
        const Comparison c =
            compare(random_system_with_friction_tables(seed, options.seconds), seed, options);
        EXPECT_EQ(name(c.outcome), std::string("agrees"))
            << "seed " << seed << ": " << c.worst << " tolerances";
    }
}

// Motion that dies out within a step or two: three points of a step show too little of its power.
TEST(RandomSystems, TheLedgerClosesWhereMotionDiesOutWithinAStep) {
    const ComparisonOptions options;
    const Comparison c = compare(random_system(90747, options.seconds), 90747, options);
    EXPECT_EQ(name(c.outcome), std::string("agrees"));
    EXPECT_LT(c.energy_defect, 1e-4);
}

// Power that turns from no torque at all in the midst of a step: a clutch that begins to press along a sine.
TEST(RandomSystems, PowerTurnsWhereAClutchBeginsToPress) {
    const ComparisonOptions options;
    const Comparison c = compare(random_system(9125, options.seconds), 9125, options);
    EXPECT_EQ(name(c.outcome), std::string("agrees"));
    EXPECT_LT(c.worst, 0.01);
}

// What locks, slips or gives way in one machine is nothing to another that stands beside it: both move as they do alone, but for
// the instants at which the steps of both are cut. More than K changes in a step may fall back, and say so.
TEST(RandomSystems, AMachineFeelsNothingOfAnotherBesideIt) {
    constexpr double seconds = 0.2, tolerance = 1e-4;
    for (std::uint64_t seed = 1; seed <= 200; ++seed) {
        Description a = random_system(seed, seconds).description,
                    b = random_system(seed + 5000, seconds).description;
        Description together = side_by_side(a, b);
        a.method = b.method = together.method = Method::etd3;
        Rig first(a), second(b), both(together);
        const std::size_t alone = a.masses.size(), masses = together.masses.size();
        std::vector<double> low(masses, 1e300), high(masses, -1e300), difference(masses, 0);
        for (int k = 0; k < 200; ++k) {
            for (Rig* rig : {&first, &second, &both}) rig->step();
            for (std::size_t j = 0; j < masses; ++j) {
                const double speed = j < alone ? first.state.speeds()[j] : second.state.speeds()[j - alone];
                low[j] = std::min(low[j], speed);
                high[j] = std::max(high[j], speed);
                difference[j] = std::max(difference[j], std::abs(both.state.speeds()[j] - speed));
            }
        }
        double largest = 0;
        for (std::size_t j = 0; j < masses; ++j) largest = std::max(largest, high[j] - low[j]);
        for (std::size_t j = 0; j < masses; ++j) {
            EXPECT_LE(difference[j], tolerance * std::max(high[j] - low[j], 1e-3 * largest))
                << "seed " << seed << ", " << together.masses[j].name;
        }
    }
}

// Friction that rises over the slip damps, and light bodies are damped faster than a part of a step is long (25, 69).
TEST(RandomSystems, WithFrictionTablesAgreeWithTheReferenceSolver) {
    const ComparisonOptions options;
    for (const std::uint64_t seed :
         {1u, 2u, 3u, 4u, 5u, 6u, 7u, 8u, 9u, 10u, 25u, 69u, 74u, 88u, 170u, 194u, 241u}) {
        const Comparison c =
            compare(random_system_with_friction_tables(seed, options.seconds), seed, options);
        EXPECT_TRUE(c.broken.empty()) << "seed " << seed << ": " << c.broken.front();
        EXPECT_EQ(name(c.outcome), std::string("agrees"))
            << "seed " << seed << ": " << c.worst << " tolerances on " << c.worst_signal;
        EXPECT_EQ(c.fall_backs, 0) << "seed " << seed;
    }
}

// How loops at rest share a load is left open, and with it what gives way first: the reference may have its own answer. The
// plant's is the same whichever way the load points (in `broken`), and needs no fall-back.
TEST(RandomSystems, BrakesThatHoldTogetherGiveWayAlikeInBothSenses) {
    const ComparisonOptions options;
    int agreeing = 0;
    for (std::uint64_t seed = 1; seed <= 100; ++seed) {
        const RandomSystem system = random_system_of_brakes(seed, options.seconds);
        const Comparison c = compare(system, seed, options);
        EXPECT_TRUE(c.broken.empty()) << "seed " << seed << ": " << c.broken.front() << "\n"
                                      << describe(system.description);
        EXPECT_EQ(c.fall_backs, 0) << "seed " << seed;
        agreeing += c.outcome == Outcome::agrees;
    }
    EXPECT_GE(agreeing, 95);
}

// Two meshes hold a ring of two ratios at rest by what they can lose (72644); torques of converters and tyres that are small beside
// those behind a large reduction (72, 3139, 72089).
TEST(RandomSystems, VehiclesThatAskMuchAgreeWithTheReferenceSolver) {
    const ComparisonOptions options;
    for (const std::uint64_t seed : {72u, 3139u, 72089u, 72644u}) {
        const RandomSystem system = random_vehicle(seed, options.seconds);
        const Comparison c = compare(system, seed, options);
        expect_agreement(system, seed, c);
    }
}

TEST(RandomSystems, WithBacklashesAgreeWithTheReferenceSolver) {
    const ComparisonOptions options;
    int agreeing = 0, compared = 0, backlashes = 0;
    for (std::uint64_t seed = 1; seed <= 60; ++seed) {
        const RandomSystem system = random_system_with_backlashes(seed, options.seconds);
        if (system.description.backlashes.empty()) continue;
        backlashes += static_cast<int>(system.description.backlashes.size());
        const Comparison c = compare(system, seed, options);
        expect_agreement(system, seed, c);
        ++compared;
        agreeing += c.outcome == Outcome::agrees;
    }
    EXPECT_GE(backlashes, 40);
    EXPECT_GE(agreeing, compared - 3);
}

// Up to a thousand contacts of flanks of up to 12000 rad/s, each on time; power that turns where a flank lets go (2507); a
// touch that ends strained (2523); one that lets go and presses again within a part (908).
TEST(RandomSystems, HundredsOfContactsOfFlanksAddUpToNoDifference) {
    const ComparisonOptions options;
    for (const std::uint64_t seed : {169u, 335u, 367u, 908u, 1157u, 2507u, 2523u}) {
        const Comparison c = compare(random_system_with_backlashes(seed, options.seconds), seed, options);
        EXPECT_EQ(name(c.outcome), std::string("agrees")) << seed << ": " << c.worst << " tolerances on "
                                                          << c.worst_signal << " at " << c.worst_time << " s";
        EXPECT_EQ(c.fall_backs, 0) << seed;
    }
}

// A light body that bounces between two masses triples every difference from contact to contact, a million times in 0.2 s:
// of four choices of signs for a perturbation by 1e-9 two move it by 40 tolerances.
TEST(RandomSystems, AChaoticRattleCountsAsSensitiveNotAsADifference) {
    const ComparisonOptions options;
    const Comparison c = compare(random_system_with_backlashes(208, options.seconds), 208, options);
    EXPECT_EQ(name(c.outcome), std::string("sensitive"));
    EXPECT_TRUE(c.broken.empty());
}

TEST(RandomVehicles, AFixedSubsetAgreesWithTheReferenceSolver) {
    ComparisonOptions options;
    options.quick = true;
    int agreeing = 0;
    for (std::uint64_t seed = 1; seed <= 30; ++seed) {
        const RandomSystem system = random_vehicle(seed, options.seconds);
        const Comparison c = compare(system, seed, options);
        expect_agreement(system, seed, c);
        EXPECT_EQ(c.fall_backs, 0) << "seed " << seed;
        agreeing += c.outcome == Outcome::agrees;
    }
    EXPECT_GE(agreeing, 29);
}

// Turbines of 2…10 g m² near synchronous speed answer within 15…150 µs (9, 85); one is turned backwards faster than its pump (36).
TEST(RandomVehicles, LightTurbinesAndTurbinesTurnedBackwardsAgreeWithTheReference) {
    ComparisonOptions options;
    options.quick = true;
    for (const std::uint64_t seed : {9u, 36u, 85u}) {
        const Comparison c = compare(random_vehicle(seed, options.seconds), seed, options);
        EXPECT_EQ(name(c.outcome), std::string("agrees"))
            << "seed " << seed << ": " << c.worst << " tolerances on " << c.worst_signal;
    }
}

// A wheel that swings at 1150 rad/s on its tyre: twice a turn the last stage takes the forces for what they are, and one step in
// thirty was taken whole that needs sixteen parts (1183). Knots between the samples of a step: of the converter's tables (953, 882),
// of the engine's curve and where its governor leaves it (91, 863).
TEST(RandomVehicles, WheelsThatSwingOnTheirTyresAndKnotsOfLawsAgreeWithTheReference) {
    ComparisonOptions options;
    options.quick = true;
    for (const std::uint64_t seed : {91u, 863u, 882u, 953u, 1183u}) {
        const Comparison c = compare(random_vehicle(seed, options.seconds), seed, options);
        EXPECT_EQ(name(c.outcome), std::string("agrees"))
            << "seed " << seed << ": " << c.worst << " tolerances on " << c.worst_signal;
    }
}

// The torque of this one falls by half from a speed ratio of 0.89 to 0.93.
TEST(Fields, AConverterThatComesUponAKnotWithinAStepBendsThere) {
    RandomSystem system;
    Description& d = system.description;
    d.masses = {mass("pump", 1, 100), mass("turbine", 0.03, 60), mass("load", 1, 60)};
    d.shafts = {{"shaft", "turbine", "load", 4000, 5, 0}};
    d.sources = {source("pump", constant(300)), source("load", constant(-20))};
    TorqueConverter c;
    c.name = "converter", c.pump = "pump", c.turbine = "turbine";
    c.k_over_speed_ratio = {{0, 8}, {0.89, 9}, {0.93, 12.5}, {1, 16}};
    c.torque_ratio_over_speed_ratio = {{0, 2}, {0.85, 1}};
    d.converters = {c};
    const Comparison result = compare(system, 1, {});
    EXPECT_EQ(name(result.outcome), std::string("agrees"));
    EXPECT_LT(result.worst, 0.2) << result.worst_signal << " at " << result.worst_time;
    EXPECT_EQ(result.coarse, 0);
}

TEST(RandomVehicles, WithWetClutchesBehindValvesAgreeWithTheReference) {
    ComparisonOptions options;
    options.quick = true;
    int agreeing = 0;
    for (std::uint64_t seed = 1; seed <= 15; ++seed) {
        const RandomSystem system = random_vehicle_with_wet_clutches(seed, options.seconds);
        const Comparison c = compare(system, seed, options);
        expect_agreement(system, seed, c);
        agreeing += c.outcome == Outcome::agrees;
    }
    EXPECT_GE(agreeing, 14);
}

// The reference is as good as its steps are short: with a quarter of them it moves by less than a hundredth of the tolerance.
TEST(RandomVehicles, TheReferenceHasConverged) {
    const ComparisonOptions options;
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
        const RandomSystem system = random_vehicle(seed, options.seconds);
        const auto solve = [&](int refinement) {
            return run_reference(system.description, options, reference::Sharing::free, refinement,
                                 system.inputs);
        };
        const Deviation d = deviation(system.description, solve(4), solve(1), options);
        EXPECT_LT(d.worst, 0.01) << "seed " << seed << ": " << d.signal << " at " << d.time;
    }
}

TEST(RandomSystems, AreTheSameForTheSameSeed) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed)
        EXPECT_EQ(describe(random_system(seed, 0.2).description),
                  describe(random_system(seed, 0.2).description));
    EXPECT_NE(describe(random_system(1, 0.2).description), describe(random_system(2, 0.2).description));
}

// The comparison must be able to fail: a clutch 2 % weaker is another machine.
TEST(RandomSystems, TheComparisonSeesASmallFault) {
    ComparisonOptions options;
    int seen = 0, machines = 0;
    for (std::uint64_t seed = 5; seed <= 20; ++seed) {
        const RandomSystem system = random_system(seed, options.seconds);
        if (system.description.clutches.empty()) continue;
        ++machines;
        Description other = perturbed(system.description, 0.02, seed);
        seen += deviation(system.description, run_reference(system.description, options),
                          run_reference(other, options), options)
                    .worst > 1;
    }
    EXPECT_GT(machines, 5);
    EXPECT_EQ(seen, machines);
}

}  // namespace
}  // namespace shiftrig
