// Statics beyond the article's tables: balance with losses, self-locking, rest, loops, tie-ups, wrong questions.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "plant/structure.h"
#include "tests/plant/machines.h"
#include "tests/plant/statics_questions.h"

namespace shiftrig::plant {
namespace {

using machines::clutch;
using machines::gear;
using machines::mass;
using machines::row;
using machines::shaft;

// ---- several motions: loads in balance with the losses ----------------------------------------------

// A row that nothing holds: torque on the sun 30, u = −2, η = 0.96. The sun drives the mesh (30 (40 − 80/3) > 0), so the ring
// stands in balance with 2·0.96·30 = 57.6 and the carrier takes 30 + 57.6.
StaticsProblem sun_and_ring(double ring) {
    StaticsProblem p;
    p.inputs = {{"sun", 30}, {"ring", ring}};
    p.speeds = {{"sun", 40}, {"ring", 20}};
    p.output = "carrier";
    return p;
}

Description free_row() {
    Description d = one_row();
    d.planetaries[0].efficiency = 0.96;
    return d;
}

TEST(Balance, LoadsInBalanceWithTheLossesAreAccepted) {
    const StaticsResult result = solve_statics(free_row(), sun_and_ring(57.6));
    EXPECT_NEAR(torques(result).at("D.sun"), 30, 1e-12);
    EXPECT_NEAR(torques(result).at("D.ring"), 57.6, 1e-12);
    EXPECT_NEAR(result.output_torque, -87.6, 1e-12);
    // The mesh passes 30·(40 − 80/3) = 400 W and loses 4 % of it, of 30·40 + 57.6·20 = 2352 W put in.
    EXPECT_NEAR(result.loss, 16, 1e-10);
    EXPECT_NEAR(result.efficiency.value(), 1 - 16 / 2352., 1e-12);
}

// With 60 on the ring the sun would need 60/1.92 = 31.25.
TEST(Balance, LoadsOutOfBalanceAreToldWhatWouldBalance) {
    EXPECT_EQ(
        error_of(free_row(), sun_and_ring(60)),
        "statics \"one_row\": closed = nothing is under-determined: nothing holds the torque at node "
        "\"sun\", it would accelerate; close another clutch or brake, or balance it: sun = 31.25 Nm (30 "
        "given) or ring = 57.6 Nm (60 given)");
    StaticsProblem ideal = sun_and_ring(57.6);
    ideal.ideal = true;
    EXPECT_EQ(
        error_of(free_row(), ideal),
        "statics \"one_row\": closed = nothing is under-determined: nothing holds the torque at node "
        "\"sun\", it would accelerate; close another clutch or brake, or balance it: without losses sun = "
        "28.8 Nm (30 given) or ring = 60 Nm (57.6 given)");
}

TEST(Balance, WithoutTheSpeedThatTheLossesNeedItIsAskedFor) {
    StaticsProblem p = sun_and_ring(57.6);
    p.speeds = {{"sun", 40}};
    EXPECT_EQ(
        error_of(free_row(), p),
        "statics \"one_row\": closed = nothing is under-determined: nothing holds the torque at node "
        "\"sun\", it would accelerate; close another clutch or brake, or balance it: without losses sun = "
        "28.8 Nm (30 given) or ring = 60 Nm (57.6 given); with losses it depends on the speed of link 1 of "
        "\"D\": give another NODE=SPEED");
}

// Two rows on one shaft of their own: 30 on both suns, nothing on the rings. No single torque mends both.
TEST(Balance, TwoMotionsOutOfBalanceAreNotMendedByOneTorque) {
    Description d = free_row();
    for (const char* name : {"sun_2", "ring_2"}) d.masses.push_back(mass(name, 1));
    d.planetaries.push_back(row("E", "sun_2", "ring_2", "carrier", -2, 0.96));
    StaticsProblem p;
    p.inputs = {{"sun", 30}, {"sun_2", 30}};
    p.speeds = {{"sun", 40}, {"ring", 20}, {"ring_2", 20}};
    p.output = "carrier";
    const std::string error = error_of(d, p);
    EXPECT_NE(error.find("close another clutch or brake, no single torque would balance it"),
              std::string::npos)
        << error;
}

// Random rows and gears with losses and several motions. Torques and speeds are drawn, and with x = sign(M_1 ω_rel) the
// loads that keep them in balance follow: they are accepted. Mostly the same torques come back; where power circulates,
// another set of directions may balance the same loads.
TEST(Balance, RandomTrainsInBalanceAreAccepted) {
    std::mt19937_64 random(11);
    std::uniform_real_distribution<double> real(0, 1);
    int solved = 0, came_back = 0;
    for (int trial = 0; trial < 2000; ++trial) {
        Description d;
        d.name = "random";
        const int n = 4 + static_cast<int>(random() % 5);
        std::vector<std::string> names;
        for (int j = 0; j < n; ++j) {
            names.push_back("m" + std::to_string(j));
            d.masses.push_back(mass(names.back(), std::pow(10, 4 * real(random) - 2)));
        }
        const int devices = 1 + static_cast<int>(random() % static_cast<unsigned>(n - 2));
        for (int k = 0; k < devices; ++k) {
            std::shuffle(names.begin(), names.end(), random);
            const double u = (real(random) < 0.5 ? -1 : 1) * (1.2 + 3 * real(random)),
                         efficiency = 0.8 + 0.2 * real(random);
            if (real(random) < 0.3)
                d.gears.push_back(gear("g" + std::to_string(k), names[0], names[1], u, efficiency));
            else
                d.planetaries.push_back(
                    row("p" + std::to_string(k), names[0], names[1], names[2], u, efficiency));
        }
        const Structure s = build_structure(d);
        const Eigen::MatrixXd c = s.mesh_columns();
        const Eigen::FullPivLU<Eigen::MatrixXd> lu(c.transpose());
        if (lu.rank() < devices) continue;  // a loop: the split is not unique
        const Eigen::MatrixXd basis = lu.kernel();
        Eigen::VectorXd q(basis.cols());
        for (double& part : q) part = 2 * real(random) - 1;
        const Eigen::VectorXd speed = basis * q;
        if (speed.cwiseAbs().minCoeff() < 1e-3) continue;
        Eigen::VectorXd torque(devices);
        std::vector<int> x;
        for (int k = 0; k < devices; ++k) {
            const Mesh& m = s.meshes[static_cast<std::size_t>(k)];
            torque[k] = 20 * real(random) - 10;
            x.push_back(torque[k] * (speed[m.first] - (m.carrier < 0 ? 0 : speed[m.carrier])) > 0 ? 1 : -1);
        }
        const Eigen::VectorXd load = s.mesh_force_columns(x) * torque;
        StaticsProblem p;
        p.output = "m0";
        for (int j = 0; j < n; ++j) {
            p.speeds.emplace_back("m" + std::to_string(j), speed[j]);
            if (j > 0) p.inputs.emplace_back("m" + std::to_string(j), load[j]);
        }
        ++solved;
        try {
            const StaticsResult result = solve_statics(d, p);
            EXPECT_LT(result.worst_residual, 1e-9) << "trial " << trial;
            EXPECT_TRUE(result.directions_settled) << "trial " << trial;
            for (const auto& mesh : result.meshes) EXPECT_GE(mesh.loss, -1e-9) << "trial " << trial;
            came_back += std::fabs(result.output_torque - load[0]) < 1e-6;
        } catch (const ModelError& error) {
            ADD_FAILURE() << "trial " << trial << ": " << error.what();
        }
    }
    EXPECT_GT(came_back, 0.9 * solved);
    EXPECT_GT(solved, 1000);
}

// ---- self-locking -------------------------------------------------------------------------------------

// u = 0.99, η = 0.97, the sun held, 100 Nm on the ring, which turns at 1: the carrier turns at −99. The sun is driven in the mesh,
// so û = 0.99/0.97, M = −100·0.97/0.99 = −97.98, the carrier gets −M − 100 = −2.0202 from outside, which is +200 W beside the
// 100 W of the ring: 300 W of loss, 3 % of the 10 kW that the mesh takes in.
TEST(SelfLocking, OutputThatHasToBeDrivenIsNoEfficiency) {
    Description d = one_row();
    d.planetaries[0].ratio = 0.99;
    d.clutches = {clutch("B", "sun", "")};
    StaticsProblem p = problem({"B"}, "ring", 100);
    p.output = "carrier";
    StaticsResult result = solve_statics(d, p);
    EXPECT_TRUE(result.output_driven);
    EXPECT_FALSE(result.efficiency);
    EXPECT_NEAR(result.output_torque, 97 / 0.99 - 100, 1e-10);
    EXPECT_NEAR(result.loss, 300, 1e-9);
    EXPECT_NEAR(result.power_in, 300, 1e-9);
    // Driven at the carrier it turns: now the sun drives, û = 0.99·0.97, and 100 W at the ring cost 100·99 (1 − û)/û.
    p = problem({"B"}, "carrier", -1);
    p.speeds = {{"carrier", -99}};
    p.output = "ring";
    result = solve_statics(d, p);
    EXPECT_FALSE(result.output_driven);
    EXPECT_NEAR(result.efficiency.value(), 0.9603 / (99 * 0.0397), 1e-10);
}

// The same row, asked to give 10 W at the carrier out of the ring: with x = +1 (û = 0.9603) M = −10/0.0397, which is x = −1;
// with x = −1 (û = 1.0206) M = 10/0.0206, which is x = +1. There is no such motion.
TEST(SelfLocking, PowerThatCannotComeOutSettlesOnNoDirections) {
    Description d = one_row();
    d.planetaries[0].ratio = 0.99;
    d.clutches = {clutch("B", "sun", "")};
    StaticsProblem p = problem({"B"}, "carrier", 10);
    p.speeds = {{"carrier", -1}};
    p.output = "ring";
    const StaticsResult result = solve_statics(d, p);
    EXPECT_FALSE(result.directions_settled);
    EXPECT_FALSE(result.efficiency);
    EXPECT_FALSE(result.output_driven);
}

// ---- at rest --------------------------------------------------------------------------------------------

Description gears_against_a_brake() {
    Description d;
    d.name = "held";
    d.masses = {mass("J1", 1), mass("J2", 0.5), mass("J3", 0.3)};
    d.gears = {gear("g1", "J1", "J2", 2, 0.9), gear("g2", "J2", "J3", 3, 0.8)};
    d.clutches = {clutch("B", "J3", "", 300)};
    d.output_mass = "J3";
    return d;
}

// 30 on J1 through 2 and 3: the brake holds 180, and the held output absorbs nothing.
TEST(AtRest, ClosedBrakeHoldsTheMachine) {
    StaticsProblem p = problem({"B"}, "J1", 30);
    p.speeds = {{"J1", 0}};
    const StaticsResult result = solve_statics(gears_against_a_brake(), p);
    EXPECT_TRUE(result.at_rest);
    EXPECT_TRUE(result.output_held);
    EXPECT_NEAR(torques(result).at("B.a"), 180, 1e-12);
    EXPECT_EQ(result.output_torque, 0);
    EXPECT_FALSE(result.efficiency);
    EXPECT_FALSE(result.ratio);
    EXPECT_FALSE(result.split_not_unique);
    EXPECT_EQ(result.loss_at_rest, (std::vector<std::string>{"g1", "g2"}));
    p.ideal = true;
    EXPECT_TRUE(solve_statics(gears_against_a_brake(), p).loss_at_rest.empty());
}

// The brake in the middle holds what the input puts in; the output hangs behind it, unloaded.
TEST(AtRest, WhatHangsBehindAHeldMassIsUnloaded) {
    Description d;
    d.name = "middle";
    d.masses = {mass("A", 1), mass("M", 0.5), mass("Z", 2)};
    d.shafts = {shaft("s1", "A", "M", 500, 0.5), shaft("s2", "M", "Z", 800, 0.8)};
    d.clutches = {clutch("B", "M", "", 400)};
    d.output_mass = "Z";
    StaticsProblem p = problem({"B"}, "A", 30);
    p.speeds = {{"A", 0}};
    const auto torque = torques(solve_statics(d, p));
    EXPECT_NEAR(torque.at("s1.a"), 30, 1e-12);
    EXPECT_NEAR(torque.at("B.a"), 30, 1e-12);
    EXPECT_NEAR(torque.at("s2.a"), 0, 1e-12);
}

TEST(AtRest, MachineThatCouldTurnShowsTheLosslessTorquesAndSaysSo) {
    StaticsProblem p = problem({"C1", "C3"}, "input", 1);
    p.speeds = {{"input", 0}};
    const StaticsResult result = solve_statics(machines::wt_gearbox(), p);
    EXPECT_NEAR(result.output_torque, -1.5230, 5e-5);
    EXPECT_TRUE(result.at_rest);
    EXPECT_FALSE(result.output_held);
    EXPECT_FALSE(result.efficiency);
    EXPECT_EQ(result.loss_at_rest, (std::vector<std::string>{"row1", "row2", "row3"}));
}

// ---- loops with shafts ----------------------------------------------------------------------------------

// A–s1–B, B and C by gear 2, C and D by gear 0.5, D–s2–A: round the loop θ1 + θ2 = 0 and at A M1 − M2 = 30, so that
// M1 = 30·2000/(2000 + 3000) = 12 and M2 = −18. With losses g1 gives 2·0.97·12 = 23.28; g2 is driven by D with 18, so C gets
// 2·0.97·18 = 34.92 of it.
TEST(Loops, ShaftsInParallelShareByStiffness) {
    Description d;
    d.name = "loop";
    d.masses = {mass("A", 1), mass("B", 0.5), mass("C", 0.5), mass("D", 0.4)};
    d.gears = {gear("g1", "B", "C", 2, 0.97), gear("g2", "C", "D", 0.5, 0.97)};
    d.shafts = {shaft("s1", "A", "B", 2000, 1), shaft("s2", "D", "A", 3000, 1)};
    d.output_mass = "C";
    const StaticsResult result = solve_statics(d, problem({}, "A", 30));
    const auto torque = torques(result);
    EXPECT_NEAR(torque.at("s1.a"), 12, 1e-11);
    EXPECT_NEAR(torque.at("s2.a"), -18, 1e-11);
    EXPECT_NEAR(torque.at("g1.b"), -23.28, 1e-11);
    EXPECT_NEAR(torque.at("g2.a"), -34.92, 1e-11);
    EXPECT_FALSE(result.split_not_unique);
    EXPECT_EQ(result.shared_by_stiffness, (std::vector<std::string>{"g1", "g2", "s1", "s2"}));
}

// Held at both ends through shafts of 100 and 300: 40 in the middle is 10 and 30.
TEST(Loops, ShaftsBetweenTwoBrakesShareByStiffness) {
    Description d;
    d.name = "between";
    d.masses = {mass("L", 1), mass("M", 1), mass("R", 1)};
    d.shafts = {shaft("l", "L", "M", 100, 0), shaft("r", "M", "R", 300, 0)};
    d.clutches = {clutch("BL", "L", ""), clutch("BR", "R", "")};
    d.output_mass = "R";
    StaticsProblem p = problem({"BL", "BR"}, "M", 40);
    p.speeds = {{"M", 0}};
    const auto torque = torques(solve_statics(d, p));
    EXPECT_NEAR(torque.at("l.a"), -10, 1e-12);
    EXPECT_NEAR(torque.at("r.a"), 30, 1e-12);
    EXPECT_NEAR(torque.at("BL.a"), 10, 1e-12);
}

// A rigid path beside a shaft lets it not twist: it carries all. Of two rigid ones capacity decides, and only of these two the
// split is said to be open.
TEST(Loops, RigidPathsBesideAShaftTakeItAll) {
    Description d;
    d.name = "beside";
    d.masses = {mass("in", 1), mass("out", 1)};
    d.shafts = {shaft("s", "in", "out", 1000, 0)};
    d.clutches = {clutch("A", "in", "out", 10), clutch("B", "in", "out", 30)};
    d.output_mass = "out";
    StaticsResult result = solve_statics(d, problem({"A"}, "in", 12));
    EXPECT_NEAR(torques(result).at("A.a"), 12, 1e-12);
    EXPECT_NEAR(torques(result).at("s.a"), 0, 1e-12);
    EXPECT_FALSE(result.split_not_unique);
    result = solve_statics(d, problem({"A", "B"}, "in", 12));
    EXPECT_NEAR(torques(result).at("A.a"), 3, 1e-9);
    EXPECT_NEAR(torques(result).at("B.a"), 9, 1e-9);
    EXPECT_EQ(result.tie_up, (std::vector<std::string>{"A", "B"}));
    EXPECT_EQ(result.shared_by_stiffness, (std::vector<std::string>{"s"}));
}

// Two pairs of clutches and a shaft between them that is in no loop: rounding does not make it part of one.
TEST(Loops, ShaftBetweenTieUpsDecidesNothing) {
    Description d;
    d.name = "two_loops";
    d.masses = {mass("a", 1), mass("b", 1), mass("c", 1), mass("d", 1)};
    d.shafts = {shaft("s", "b", "c", 100, 5)};
    d.clutches = {clutch("K1", "a", "b", 10), clutch("K2", "a", "b", 30), clutch("K3", "c", "d", 10),
                  clutch("K4", "c", "d", 30)};
    d.output_mass = "d";
    const StaticsResult result = solve_statics(d, problem({"K1", "K2", "K3", "K4"}, "a", 10));
    const auto torque = torques(result);
    for (const char* link : {"K1.a", "K3.a"}) EXPECT_NEAR(torque.at(link), 2.5, 1e-12) << link;
    for (const char* link : {"K2.a", "K4.a"}) EXPECT_NEAR(torque.at(link), 7.5, 1e-12) << link;
    EXPECT_NEAR(torque.at("s.a"), 10, 1e-12);
    EXPECT_TRUE(result.shared_by_stiffness.empty());
    EXPECT_EQ(result.tie_up, (std::vector<std::string>{"K1", "K2", "K3", "K4"}));
}

// Random nets of shafts without losses: of all torques in balance those with the least energy Σ M²/2k (Castigliano).
TEST(Loops, RandomNetsHaveTheLeastEnergy) {
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> real(0, 1);
    for (int trial = 0; trial < 200; ++trial) {
        Description d;
        d.name = "net";
        const int n = 3 + static_cast<int>(random() % 4), shafts = n + static_cast<int>(random() % 4);
        for (int j = 0; j < n; ++j)
            d.masses.push_back(mass("m" + std::to_string(j), std::pow(10, 4 * real(random) - 2)));
        for (int k = 0; k < shafts; ++k) {  // the first n − 1 make it one piece
            const int b = k < n - 1 ? k + 1 : 1 + static_cast<int>(random() % static_cast<unsigned>(n - 1)),
                      a = static_cast<int>(random() % static_cast<unsigned>(b));
            d.shafts.push_back(shaft("s" + std::to_string(k), "m" + std::to_string(a),
                                     "m" + std::to_string(b), std::pow(10, 2 + 4 * real(random)), 0));
        }
        d.output_mass = "m0";
        const StaticsResult result = solve_statics(d, problem({}, "m1", 10));
        // [F Aᵀ; A 0] [M; −θ] = [0; load], the output's row left out: it takes what arrives.
        const Eigen::MatrixXd a = build_structure(d).shaft_columns().bottomRows(n - 1);
        Eigen::MatrixXd kkt = Eigen::MatrixXd::Zero(shafts + n - 1, shafts + n - 1);
        for (int k = 0; k < shafts; ++k) kkt(k, k) = 1 / d.shafts[static_cast<std::size_t>(k)].stiffness;
        kkt.topRightCorner(shafts, n - 1) = a.transpose();
        kkt.bottomLeftCorner(n - 1, shafts) = a;
        Eigen::VectorXd right = Eigen::VectorXd::Zero(shafts + n - 1);
        right[shafts] = 10;
        const Eigen::VectorXd expected = kkt.fullPivLu().solve(right);
        const auto torque = torques(result);
        for (int k = 0; k < shafts; ++k)
            EXPECT_NEAR(torque.at("s" + std::to_string(k) + ".a"), expected[k], 1e-8)
                << "trial " << trial << ", s" << k;
        EXPECT_FALSE(result.split_not_unique) << "trial " << trial;
    }
}

// ---- tie-ups and errors -----------------------------------------------------------------------------

TEST(Statics, ParallelClutchesShareByCapacityAndAreFlagged) {
    Description d;
    d.name = "parallel";
    d.masses = {mass("in", 1), mass("out", 1)};
    d.clutches = {clutch("A", "in", "out", 10), clutch("B", "in", "out", 30)};
    d.output_mass = "out";
    const StaticsResult result = solve_statics(d, problem({"A", "B"}, "in", 12.5));
    EXPECT_TRUE(result.split_not_unique);
    EXPECT_EQ(result.tie_up, (std::vector<std::string>{"A", "B"}));
    EXPECT_NEAR(torques(result).at("A.a"), 3.125, 1e-9);
    EXPECT_NEAR(torques(result).at("B.a"), 9.375, 1e-9);
}

TEST(StaticsErrors, NameWhatIsWrong) {
    const Description d = machines::wt_gearbox();
    EXPECT_EQ(error_of(d, problem({"C1", "C9"}, "input", 1)),
              "model \"wt_gearbox\": closed = \"C9\" is no clutch, brake or freewheel");
    EXPECT_EQ(error_of(d, problem({"C1", "C3"}, "inlet", 1)),
              "statics \"wt_gearbox\": input = \"inlet\" is no mass of the model");
    EXPECT_EQ(
        error_of(d, problem({"C1", "C2", "C3"}, "input", 1)),
        "statics \"wt_gearbox\": closed = C1,C2,C3 locks node \"input\": over-determined, it cannot turn; "
        "speed input = 0 asks for the torques at rest");
    EXPECT_EQ(error_of(d, problem({"C1"}, "input", 1, true))
                      .find("is under-determined: nothing holds the torque at") == std::string::npos,
              false);
    const double infinite = std::numeric_limits<double>::infinity(), no_number = std::nan("");
    EXPECT_EQ(error_of(d, problem({"C1", "C3"}, "input", infinite)),
              "statics \"wt_gearbox\": input \"input\" = inf; must be finite, at most 1e100 in size");
    StaticsProblem no_speed = problem({"C1", "C3"}, "input", 1);
    no_speed.speeds = {{"input", no_number}};
    EXPECT_EQ(error_of(d, no_speed),
              "statics \"wt_gearbox\": speed \"input\" = nan; must be finite, at most 1e100 in size");
    StaticsProblem contradiction = problem({"C1", "C2"}, "input", 1);
    contradiction.speeds = {{"input", 1}, {"output", 2}};
    EXPECT_EQ(error_of(d, contradiction),
              "statics \"wt_gearbox\": speed contradicts the kinematics of the closed set C1,C2");
}

}  // namespace
}  // namespace shiftrig::plant
