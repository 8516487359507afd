// Statics against [Algin] Tables 1 and 2, Fig. 5 and the worked cases with losses of docs/mechanics.md.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>

#include "plant/plant.h"
#include "plant/statics.h"
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

// ---- Table 2 --------------------------------------------------------------------------------------

struct Rows {
    double value[3][3];  // row, (sun, ring, carrier)
};

void expect_rows(const StaticsResult& result, const Rows& expected, double tolerance) {
    const auto torque = torques(result);
    const char* links[] = {"sun", "ring", "carrier"};
    for (int r = 0; r < 3; ++r) {
        for (int l = 0; l < 3; ++l) {
            const std::string name = "row" + std::to_string(r + 1) + "." + links[l];
            EXPECT_NEAR(torque.at(name), expected.value[r][l], tolerance) << name;
        }
    }
    EXPECT_LT(result.worst_residual, 1e-9);
}

TEST(Table2, IdealRowsOfGearIIIAndVComeOut) {
    const Description d = machines::wt_gearbox();
    const Rows third{{{0.294, 0.523, -0.817}, {0.259, 0.816, -1.075}, {0.447, 1.077, -1.524}}};
    const Rows fifth{{{-0.209, -0.372, 0.581}, {-0.184, -0.580, 0.764}, {0.184, 0.443, -0.627}}};
    expect_rows(solve_statics(d, problem({"C1", "C3"}, "input", 1, true)), third, 0.002);
    expect_rows(solve_statics(d, problem({"C2", "C3"}, "input", 1, true)), fifth, 0.002);
}

TEST(Table2, RowsWithLossesOfGearIIIComeOut) {
    const Rows third{{{0.291, 0.502, -0.793}, {0.259, 0.791, -1.050}, {0.450, 1.052, -1.502}}};
    expect_rows(solve_statics(machines::wt_gearbox(), problem({"C1", "C3"}, "input", 1)), third, 0.002);
}

// The printed ring and carrier of rows 1 and 2 in gear V (−0.364, 0.575, −0.562, 0.746) belong to η¹, their
// suns to η⁻¹: they do not balance. Recomputed with x = (−1, −1, +1) throughout.
TEST(Table2, RowsWithLossesOfGearVComeOutWithFourEntriesRecomputed) {
    const StaticsResult result = solve_statics(machines::wt_gearbox(), problem({"C2", "C3"}, "input", 1));
    const Rows recomputed{
        {{-0.2107, -0.3865, 0.5973}, {-0.1839, -0.5973, 0.7811}, {0.1839, 0.4296, -0.6135}}};
    expect_rows(result, recomputed, 0.0005 / 5);
    ASSERT_EQ(result.meshes.size(), 3u);
    EXPECT_EQ(result.meshes[0].x, -1);
    EXPECT_EQ(result.meshes[1].x, -1);
    EXPECT_EQ(result.meshes[2].x, +1);
    const double printed_node = 0.575 - 0.562, printed_input = -0.211 + 0.746 + 0.430;
    EXPECT_GT(std::fabs(printed_node), 0.01) << "the printed carrier 1 and ring 2 would not balance";
    EXPECT_GT(std::fabs(printed_input - 1), 0.03) << "nor would the printed input node";
    EXPECT_LT(std::fabs(result.output_torque), 0.6283) << "no energy from nothing";
}

TEST(Table2, RatiosOfAllSevenGearsFollow) {
    const Description d = machines::wt_gearbox();
    const std::map<std::string, double> ratios{{"I", 3.4090}, {"II", 2.1571}, {"III", 1.5230}, {"IV", 1.0000},
                                               {"V", 0.6283}, {"VI", 0.5197}, {"R", -3.0065}};
    for (const GearPath& path : d.gear_paths) {
        const StaticsResult result = solve_statics(d, problem(path.closed, "input", 1, true));
        EXPECT_NEAR(result.ratio.value(), ratios.at(path.name), 5e-5) << path.name;
        EXPECT_NEAR(result.output_torque, -ratios.at(path.name), 5e-5) << path.name;
        EXPECT_NEAR(result.efficiency.value(), 1, 1e-12) << path.name;
    }
}

TEST(Statics, DirectGearTurnsAsABlockWithoutLoss) {
    const StaticsResult result = solve_statics(machines::wt_gearbox(), problem({"C1", "C2"}, "input", 1));
    for (const auto& mesh : result.meshes) EXPECT_EQ(mesh.x, 0) << mesh.name;
    EXPECT_NEAR(result.efficiency.value(), 1, 1e-12);
    EXPECT_NEAR(result.output_torque, -1, 1e-12);
}

TEST(Statics, SpeedDirectionTurnsEveryPowerFlowAround) {
    StaticsProblem p = problem({"C2", "C3"}, "input", 1);
    p.speeds = {{"input", -2}};
    const StaticsResult result = solve_statics(machines::wt_gearbox(), p);
    EXPECT_EQ(result.meshes[0].x, +1);
    EXPECT_EQ(result.meshes[2].x, -1);
    EXPECT_GT(std::fabs(result.output_torque), 0.6283)
        << "the output drives: it must bring more than the ideal";
    EXPECT_GT(result.loss, 0);
    EXPECT_LT(result.efficiency.value(), 1);
}

// ---- worked cases with losses, [Algin] eq. (16)–(25) ------------------------------------------------

Description one_gear() {
    Description d;
    d.name = "one_gear";
    d.masses = {mass("a", 1), mass("b", 1)};
    d.gears = {gear("G", "a", "b", 2, 0.98)};
    d.output_mass = "b";
    return d;
}

TEST(Losses, GearDrivenAtLinkOneLosesAtLinkTwo) {
    const auto torque = torques(solve_statics(one_gear(), problem({}, "a", 1)));
    EXPECT_NEAR(torque.at("G.a"), 1, 1e-14);
    EXPECT_NEAR(torque.at("G.b"), -1.96, 1e-14);
}

TEST(Losses, GearDrivenAtLinkTwoDoesNotGainEfficiency) {
    StaticsProblem p = problem({}, "b", 1.96);
    p.output = "a";
    const auto torque = torques(solve_statics(one_gear(), p));
    EXPECT_NEAR(torque.at("G.b"), 1.96, 1e-14);
    EXPECT_NEAR(torque.at("G.a"), -0.9604, 1e-14);  // not −1, which would be an efficiency of 1.04
}

TEST(Losses, PlanetaryRowDrivenAtTheSun) {
    StaticsProblem p = problem({"B"}, "sun", 1);
    p.output = "carrier";
    const StaticsResult result = solve_statics(one_row(), p);
    EXPECT_NEAR(torques(result).at("D.carrier"), -2.94, 1e-13);
    EXPECT_NEAR(result.efficiency.value(), 0.98, 1e-13);
    EXPECT_NEAR(torques(result).at("B.a"), -1.94, 1e-13);  // the brake holds what the ring gets
}

TEST(Losses, PlanetaryRowDrivenAtTheCarrier) {
    StaticsProblem p = problem({"B"}, "carrier", 3);
    p.output = "sun";
    const StaticsResult result = solve_statics(one_row(), p);
    EXPECT_NEAR(torques(result).at("D.sun"), -3 / (1 + 2 / 0.97), 1e-13);
    EXPECT_NEAR(result.efficiency.value(), 0.98, 1e-3);
}

// ---- Fig. 5: the matrix -----------------------------------------------------------------------------

TEST(Fig5, StructuralDistributionMatrixEntryByEntry) {
    const double u = -2;
    const Structure s = build_structure(machines::article_fig5(u));
    Eigen::MatrixXd a(4, 5);
    a << s.pair_columns(), s.mesh_columns(), s.shaft_columns(), s.damper_columns();
    Eigen::MatrixXd expected(4, 5);
    expected << 1, 0, 1, 0, 0,  //
        -1, 1, -u, 0, 0,        //
        0, 0, -(1 - u), 1, 1,   //
        0, 0, 0, -1, -1;
    for (int i = 0; i < 4; ++i) {
        for (int k = 0; k < 5; ++k)
            EXPECT_EQ(a(i, k), expected(i, k)) << "mass " << i + 1 << ", device " << k + 1;
    }
}

// ---- Table 1 and the two methods -------------------------------------------------------------------

// (A_Rᵀ J⁻¹ Â_R) M = A_Rᵀ J⁻¹ M̃, [Algin] eq. (15).
Eigen::VectorXd internal_torques(const Eigen::MatrixXd& c, const Eigen::MatrixXd& force,
                                 const Eigen::VectorXd& inertia, const Eigen::VectorXd& load) {
    const Eigen::MatrixXd ct = c.transpose() * inertia.cwiseInverse().asDiagonal();
    return (ct * force).partialPivLu().solve(ct * load);
}

// Accelerations and torques together, [Algin] eq. (9): J ω̇ + Ĉ M = M̃, Cᵀ ω̇ = 0.
Eigen::VectorXd kinematic_method(const Eigen::MatrixXd& c, const Eigen::MatrixXd& force,
                                 const Eigen::VectorXd& inertia, const Eigen::VectorXd& load) {
    const Eigen::Index n = c.rows(), r = c.cols();
    Eigen::MatrixXd kkt = Eigen::MatrixXd::Zero(n + r, n + r);
    kkt.topLeftCorner(n, n) = inertia.asDiagonal();
    kkt.topRightCorner(n, r) = force;
    kkt.bottomLeftCorner(r, n) = c.transpose();
    Eigen::VectorXd right = Eigen::VectorXd::Zero(n + r);
    right.head(n) = load;
    return Eigen::VectorXd(kkt.fullPivLu().solve(right)).tail(r);
}

struct Table1Row {
    double j1, j2, m1, m2, m12, quotient;
};

class Table1 : public testing::TestWithParam<Table1Row> {};

TEST_P(Table1, InternalTorqueLoadsTheClutch) {
    const Table1Row& t = GetParam();
    Description d;
    d.masses = {mass("1", t.j1), mass("2", t.j2)};
    d.clutches = {clutch("F", "1", "2")};
    const Structure s = build_structure(d);
    const Eigen::VectorXd inertia = Eigen::Vector2d(t.j1, t.j2), load = Eigen::Vector2d(t.m1, t.m2);
    const Eigen::MatrixXd c = s.pair_columns();
    const double m12 = internal_torques(c, c, inertia, load)[0];
    EXPECT_NEAR(m12, t.m12, 1e-14);
    EXPECT_NEAR(kinematic_method(c, c, inertia, load)[0], t.m12, 1e-13);
    EXPECT_NEAR(t.m1 / m12, t.quotient, 0.005);
}

INSTANTIATE_TEST_SUITE_P(
    Article, Table1,
    testing::Values(Table1Row{1, 1, 10, -1, 5.5, 1.82}, Table1Row{2, 1, 10, -1, 4.0, 2.50},
                    Table1Row{5, 1, 10, -1, 2.5, 4.00}, Table1Row{9, 1, 10, -1, 1.9, 5.26},
                    Table1Row{1, 9, 10, -1, 9.1, 1.10}, Table1Row{9, 1, 1, -1, 1.0, 1.00},
                    Table1Row{9, 1, 1, 1, -0.8, -1.25}));

// Random trains of gears and rows with losses: both methods give the same internal torques.
TEST(InternalTorques, KinematicMethodAgrees) {
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> real(0, 1);
    for (int trial = 0; trial < 200; ++trial) {
        Description d;
        const int n = 3 + static_cast<int>(random() % 5);
        for (int j = 0; j < n; ++j)
            d.masses.push_back(mass("m" + std::to_string(j), std::pow(10, 4 * real(random) - 2)));
        std::vector<int> x;
        for (int j = 1; j < n; ++j) {
            const std::string a = "m" + std::to_string(random() % static_cast<unsigned>(j)),
                              b = "m" + std::to_string(j);
            d.gears.push_back(gear("g" + b, a, b, (real(random) < 0.5 ? -1 : 1) * (0.3 + 3 * real(random)),
                                   0.5 + 0.5 * real(random)));
            x.push_back(real(random) < 0.5 ? -1 : 1);
        }
        const Structure s = build_structure(d);
        const Eigen::MatrixXd c = s.mesh_columns(), force = s.mesh_force_columns(x);
        const Eigen::VectorXd inertia = Eigen::Map<const Eigen::VectorXd>(s.inertia.data(), n);
        const Eigen::VectorXd load = Eigen::VectorXd::NullaryExpr(n, [&] { return 2 * real(random) - 1; });
        const Eigen::VectorXd eq15 = internal_torques(c, force, inertia, load);
        const Eigen::VectorXd eq9 = kinematic_method(c, force, inertia, load);
        EXPECT_LT((eq15 - eq9).norm(), 1e-9 * (1 + eq15.norm())) << "trial " << trial;
    }
}

}  // namespace
}  // namespace shiftrig::plant
