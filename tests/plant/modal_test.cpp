// Gear table and natural frequencies against closed forms, another eigenvalue computation and the reference tractor.
#include "plant/modal.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <complex>

#include "plant/structure.h"
#include "tests/plant/machines.h"

namespace shiftrig::plant {
namespace {

constexpr double turn = 2 * 3.14159265358979323846;

Description two_inertias(double damping = 0) {
    Description d;
    d.masses = {machines::mass("a", 2), machines::mass("b", 3)};
    d.shafts = {machines::shaft("s", "a", "b", 1000, damping)};
    return d;
}

TEST(Modes, TwoInertiasOnAShaftSwingAtTheClosedForm) {
    const ModalResult result = natural_modes(two_inertias(), {});
    EXPECT_EQ(result.rigid_motions, 1);
    ASSERT_EQ(result.modes.size(), 1u);
    EXPECT_NEAR(result.modes[0].frequency, std::sqrt(1000 * (1. / 2 + 1. / 3)) / turn, 1e-12);
    EXPECT_NEAR(result.modes[0].shape[1], -2. / 3, 1e-12);  // momentum 0: 2·1 + 3·x = 0
    EXPECT_NEAR(result.modes[0].kinetic_share[0], 0.6, 1e-12);
    EXPECT_NEAR(result.modes[0].elastic_share[0].second, 1, 1e-12);
}

TEST(Modes, DampingRatioOfTwoInertiasIsTheClosedForm) {
    const double mu = 1 / (1. / 2 + 1. / 3), omega = std::sqrt(1000 / mu), zeta = 20 / (2 * mu * omega);
    const ModalResult result = natural_modes(two_inertias(20), {});
    ASSERT_EQ(result.damped.size(), 1u);
    EXPECT_NEAR(result.damped[0].frequency, omega / turn, 1e-10);
    EXPECT_NEAR(result.damped[0].damping_ratio, zeta, 1e-12);
    EXPECT_NEAR(result.modes[0].damping_ratio, zeta, 1e-12);
}

// 2 on a spring to 0.5, which a damper of 20000 holds: p(s) = (2s² + ds + k)(0.5s² + (d + D)s + k) − (ds + k)².
TEST(Modes, AStrongDamperHoldsWhatItJoinsAndTheRestSwings) {
    const double k = 444132.2, small = 1, strong = 20000;
    Description d;
    d.masses = {machines::mass("a", 2), machines::mass("b", 0.5)};
    d.shafts = {machines::shaft("s", "a", "b", k, small)};
    d.dampers = {{"D", "b", "", strong}};
    const ModalResult result = natural_modes(d, {});
    ASSERT_EQ(result.damped.size(), 1u);
    const DampedMode& mode = result.damped[0];
    const double size = mode.frequency * turn, zeta = mode.damping_ratio;
    const std::complex<double> s = size * std::complex<double>(-zeta, std::sqrt(1 - zeta * zeta));
    const auto a = 2. * s * s + small * s + k, b = 0.5 * s * s + (small + strong) * s + k,
               coupling = small * s + k;
    EXPECT_LT(std::abs(a * b - coupling * coupling), 1e-9 * std::abs(coupling * coupling));
    EXPECT_NEAR(mode.frequency, std::sqrt(k / 2) / turn, 0.03);  // nearly as if b were held
    EXPECT_NEAR(zeta, k / (2 * strong * std::sqrt(k / 2)), 1e-3);
    EXPECT_GT(mode.kinetic_share[0], 0.99);
    EXPECT_NEAR(result.modes.at(0).frequency, std::sqrt(k * 2.5) / turn, 1e-9);
    EXPECT_TRUE(result.damping_shifts());
    EXPECT_FALSE(natural_modes(two_inertias(2), {}).damping_shifts());
}

TEST(Modes, GearBetweenShaftsTransformsStiffness) {
    // a –s– b –gear u– c –t– d: the chain seen from a has inertia b + c/u², stiffness t/u², inertia d/u².
    Description d;
    d.masses = {machines::mass("a", 1), machines::mass("b", 0.2), machines::mass("c", 0.9),
                machines::mass("d", 50)};
    d.shafts = {machines::shaft("s", "a", "b", 400, 0), machines::shaft("t", "c", "d", 9000, 0)};
    d.gears = {machines::gear("g", "b", "c", 3, 0.9)};
    Eigen::Matrix3d k;
    k << 400, -400, 0, -400, 1400, -1000, 0, -1000, 1000;
    const Eigen::Vector3d inertia(1, 0.2 + 0.9 / 9, 50. / 9);
    const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::Matrix3d> other(
        k, Eigen::Matrix3d(inertia.asDiagonal()));
    const ModalResult result = natural_modes(d, {});
    ASSERT_EQ(result.modes.size(), 2u);
    for (int i = 0; i < 2; ++i) {
        EXPECT_NEAR(result.modes[static_cast<std::size_t>(i)].frequency,
                    std::sqrt(other.eigenvalues()[i + 1]) / turn, 1e-9);
    }
}

TEST(Modes, OpenClutchSeparatesTheMachine) {
    Description d = two_inertias();
    d.masses.push_back(machines::mass("c", 1));
    d.clutches = {machines::clutch("F", "b", "c")};
    EXPECT_EQ(natural_modes(d, {}).rigid_motions, 2);
    const ModalResult closed = natural_modes(d, {"F"});
    EXPECT_EQ(closed.rigid_motions, 1);
    EXPECT_NEAR(closed.modes.at(0).frequency, std::sqrt(1000 * (1. / 2 + 1. / 4)) / turn, 1e-12);
}

// ---- the reference tractor, written here by hand from its parameter page ------------------------------

Description tractor() {
    using machines::gear;
    using machines::mass;
    Description d;
    d.name = "tractor";
    d.masses = {mass("engine", 2.6),
                mass("disc", 0.15),
                mass("input", 0.3),
                mass("p1", 0.02),
                mass("p2", 0.02),
                mass("p3", 0.02),
                mass("p4", 0.02),
                mass("output", 0.25),
                mass("range_out", 0.05),
                mass("crown", 1.0),
                mass("axle_input", 5.0),
                mass("wheels", 550),
                mass("vehicle", 14000, Motion::translating)};
    d.shafts = {machines::shaft("damper", "disc", "input", 12000, 15),
                machines::shaft("pinion", "range_out", "crown", 80000, 60),
                machines::shaft("axle", "axle_input", "wheels", 2.8e6, 8000)};
    d.clutches = {machines::clutch("Fc", "engine", "disc"), machines::clutch("F1", "input", "p1"),
                  machines::clutch("F2", "input", "p2"), machines::clutch("F3", "input", "p3"),
                  machines::clutch("F4", "input", "p4")};
    d.gears = {gear("P1", "p1", "output", 41. / 30, 0.98),
               gear("P2", "p2", "output", 38. / 33, 0.98),
               gear("P3", "p3", "output", 35. / 36, 0.98),
               gear("P4", "p4", "output", 32. / 39, 0.98),
               gear("range", "output", "range_out", 3.024, 0.9604),
               gear("final", "crown", "axle_input", 205. / 9, 0.9467)};
    d.gears[4].options = {{"L", 6.048}, {"M", 3.024}, {"H", 1.008}};
    BrixiusTyre tyre;
    tyre.name = "tyre";
    tyre.wheel = "wheels";
    tyre.body = "vehicle";
    tyre.radius = 0.935;
    tyre.mobility_number = 55;
    tyre.relaxation_length = 0.6;
    tyre.weight = 14000 * 9.80665;
    tyre.slip_damping_time = 0.05;
    d.tyres = {tyre};
    d.gear_paths = {{"F1", {"Fc", "F1"}}, {"F2", {"Fc", "F2"}}, {"F3", {"Fc", "F3"}}, {"F4", {"Fc", "F4"}}};
    d.input_mass = "engine";
    d.output_mass = "wheels";
    return d;
}

struct TableRow {
    const char* name;
    double ratio, kmh1800, kmh2100;
    double modes[4];
};
constexpr TableRow table[] = {{"F1/M", 94.14, 6.74, 7.86, {1.60, 13.4, 26.9, 50.3}},
                              {"F2/M", 79.32, 8.00, 9.33, {1.69, 13.4, 25.4, 51.0}},
                              {"F3/M", 66.97, 9.48, 11.05, {1.80, 13.4, 23.9, 51.7}},
                              {"F4/M", 56.52, 11.23, 13.10, {1.92, 13.3, 22.3, 52.3}}};

GearVariant find(const std::vector<GearVariant>& gears, const std::string& name) {
    for (const GearVariant& gear : gears) {
        if (gear.name == name) return gear;
    }
    ADD_FAILURE() << name << " is missing";
    return gears.front();
}

TEST(Tractor, RatiosAndRoadSpeedsOfTheTable) {
    const auto gears = gear_variants(tractor());
    EXPECT_EQ(gears.size(), 12u);
    for (const TableRow& row : table) {
        const GearVariant gear = find(gears, row.name);
        ASSERT_TRUE(gear.ratio.has_value()) << row.name;
        EXPECT_NEAR(*gear.ratio, row.ratio, 0.005 * row.ratio) << row.name;
        EXPECT_NEAR(gear.kmh(1800), row.kmh1800, 0.005 * row.kmh1800) << row.name;
        EXPECT_NEAR(gear.kmh(2100), row.kmh2100, 0.005 * row.kmh2100) << row.name;
        EXPECT_TRUE(gear.tie_ups.empty());
    }
}

TEST(Tractor, LowestModesAreWithinEightPercentOfTheLumpedTable) {
    const auto gears = gear_variants(tractor());
    for (const TableRow& row : table) {
        const GearVariant gear = find(gears, row.name);
        const ModalResult result = natural_modes(gear.description, gear.closed);
        ASSERT_GE(result.modes.size(), 4u);
        for (std::size_t i = 0; i < 4; ++i) {
            EXPECT_NEAR(result.modes[i].frequency, row.modes[i], 0.08 * row.modes[i])
                << row.name << " mode " << i + 1;
        }
    }
}

// The same frequencies from another computation: eliminate the rigid constraints by hand (every mass follows one of
// five coordinates), then the eigenvalues of M⁻¹K by the unsymmetric QR algorithm.
TEST(Tractor, FrequenciesAgreeWithHandEliminatedCoordinates) {
    const Description d = tractor();
    const double u2 = 38. / 33, range = 3.024, final_drive = 205. / 9;
    // Coordinates: disc side, output, crown, wheels, vehicle; every mass moves with one of them.
    Eigen::MatrixXd follow = Eigen::MatrixXd::Zero(13, 5);
    follow(0, 0) = follow(1, 0) = 1;
    follow(2, 1) = u2;
    follow(3, 1) = 41. / 30;
    follow(4, 1) = u2;
    follow(5, 1) = 35. / 36;
    follow(6, 1) = 32. / 39;
    follow(7, 1) = 1;
    follow(8, 1) = 1 / range;
    follow(9, 2) = 1;
    follow(10, 2) = 1 / final_drive;
    follow(11, 3) = 1;
    follow(12, 4) = 1;
    Eigen::VectorXd inertia(13);
    for (int j = 0; j < 13; ++j) inertia[j] = d.masses[static_cast<std::size_t>(j)].inertia;
    const double tyre = 7.5 * 0.88 * (1 - std::exp(-5.5)) * 14000 * 9.80665 * 0.935 * 0.935 / 0.6;
    Eigen::MatrixXd twist = Eigen::MatrixXd::Zero(4, 13);
    twist(0, 1) = 1, twist(0, 2) = -1;
    twist(1, 8) = 1, twist(1, 9) = -1;
    twist(2, 10) = 1, twist(2, 11) = -1;
    twist(3, 11) = 1, twist(3, 12) = -1 / 0.935;
    const Eigen::Vector4d stiffness(12000, 80000, 2.8e6, tyre);
    const Eigen::MatrixXd m = follow.transpose() * inertia.asDiagonal() * follow;
    const Eigen::MatrixXd t = twist * follow;
    const Eigen::MatrixXd k = t.transpose() * stiffness.asDiagonal() * t;
    Eigen::VectorXcd squares = Eigen::EigenSolver<Eigen::MatrixXd>(m.inverse() * k).eigenvalues();
    std::vector<double> other;
    for (const auto& square : squares) {
        if (square.real() > 1) other.push_back(std::sqrt(square.real()) / turn);
    }
    std::sort(other.begin(), other.end());
    const ModalResult result = natural_modes(d, {"Fc", "F2"});
    ASSERT_EQ(result.modes.size(), other.size());
    for (std::size_t i = 0; i < other.size(); ++i) {
        EXPECT_NEAR(result.modes[i].frequency, other[i], 1e-9 * other[i]) << "mode " << i + 1;
    }
}

TEST(Tractor, DampedModesOfTheShaftsAreLightlyDamped) {
    Description d = tractor();
    d.tyres[0].slip_damping_time = 0;
    const ModalResult result = natural_modes(d, {"Fc", "F2"});
    ASSERT_EQ(result.damped.size(), result.modes.size());
    double largest = 0;
    for (const Mode& mode : result.modes) largest = std::max(largest, mode.damping_ratio);
    EXPECT_LT(largest, 0.2);
    for (std::size_t i = 0; i < result.modes.size(); ++i) {
        // The modal ratio is first order: damping that couples modes shifts both by the order of the largest squared.
        const double zeta = result.modes[i].damping_ratio, shift = largest * largest;
        EXPECT_GT(zeta, 0);
        EXPECT_NEAR(result.damped[i].damping_ratio, zeta, shift) << "mode " << i + 1;
        EXPECT_NEAR(result.damped[i].frequency, result.modes[i].frequency, shift * result.modes[i].frequency);
    }
}

TEST(Tractor, RollingTyreDampsTheLowestMode) {
    Description d = tractor();
    d.tyres[0].slip_damping_time = 0;
    ModalOptions rolling;
    rolling.body_speed = 2;
    EXPECT_LT(natural_modes(d, {"Fc", "F2"}).damped.at(0).damping_ratio, 0.05);
    EXPECT_GT(natural_modes(d, {"Fc", "F2"}, rolling).damped.at(0).damping_ratio, 0.1);
}

// ---- loops and what they block ------------------------------------------------------------------------

using Names = std::vector<std::string>;

Description in_and_out() {
    Description d;
    d.masses = {machines::mass("a", 1), machines::mass("o", 3)};
    d.input_mass = "a";
    d.output_mass = "o";
    return d;
}

GearVariant only_gear(Description d, const Names& closed) {
    d.gear_paths = {{"one", closed}};
    return gear_variants(d).at(0);
}

TEST(TieUps, ALoopWithAShaftOrAPlayInItSharesByStiffness) {
    Description d = in_and_out();
    d.shafts = {machines::shaft("s", "a", "o", 1000, 1), machines::shaft("t", "a", "o", 2000, 1)};
    EXPECT_TRUE(only_gear(d, {}).tie_ups.empty());
    d.shafts.pop_back();
    d.clutches = {machines::clutch("K", "a", "o"), machines::clutch("L", "a", "o")};
    EXPECT_TRUE(only_gear(d, {"K"}).tie_ups.empty());
    const auto tied = only_gear(d, {"K", "L"}).tie_ups;
    ASSERT_EQ(tied.size(), 1u);
    EXPECT_EQ(tied[0].devices, (Names{"K", "L"}));
    Backlash play;
    play.name = "B", play.a = "a", play.b = "o", play.stiffness = 1e5, play.gap = 0.01;
    d.shafts.clear();
    d.backlashes = {play};
    EXPECT_TRUE(only_gear(d, {"K"}).tie_ups.empty());
}

// Two gears to twin countershafts, two from them: the loop gives in the countershafts, unless these are clutches.
TEST(TieUps, TwinCountershaftsAreTiedUpOnlyWhereTheyAreRigid) {
    Description d = in_and_out();
    for (const char* name : {"c1", "c2", "d1", "d2"}) d.masses.push_back(machines::mass(name, 0.1));
    d.gears = {machines::gear("g1", "a", "c1", -2), machines::gear("g2", "a", "c2", -2),
               machines::gear("h1", "d1", "o", -2), machines::gear("h2", "d2", "o", -2)};
    d.shafts = {machines::shaft("s1", "c1", "d1", 1e4, 1), machines::shaft("s2", "c2", "d2", 1.5e4, 1)};
    EXPECT_TRUE(only_gear(d, {}).tie_ups.empty());
    EXPECT_NEAR(only_gear(d, {}).ratio.value(), 4, 1e-12);
    d.shafts.clear();
    d.clutches = {machines::clutch("K1", "c1", "d1"), machines::clutch("K2", "c2", "d2")};
    ASSERT_EQ(only_gear(d, {"K1", "K2"}).tie_ups.size(), 1u);
    EXPECT_EQ(only_gear(d, {"K1", "K2"}).tie_ups[0].devices, (Names{"g1", "g2", "h1", "h2", "K1", "K2"}));
    // With other ratios they let nothing turn, and no shaft that gives changes that.
    d.gears[3].ratio = -3;
    EXPECT_EQ(only_gear(d, {"K1", "K2"}).blocked_by, (Names{"g1", "g2", "h1", "h2", "K1", "K2"}));
    d.clutches.pop_back();
    EXPECT_TRUE(only_gear(d, {"K1"}).blocked_by.empty());
    d.shafts = {machines::shaft("s2", "c2", "d2", 1.5e4, 1)};
    EXPECT_EQ(only_gear(d, {"K1"}).blocked_by, (Names{"g1", "g2", "h1", "h2", "K1", "s2"}));
}

TEST(TieUps, LoopsAreThoseThatTheMemberCloses) {
    Description d = in_and_out();
    d.masses.push_back(machines::mass("x", 1));
    d.gears = {machines::gear("g", "a", "x", 2), machines::gear("h", "a", "x", 2)};
    d.clutches = {machines::clutch("K", "a", "o"), machines::clutch("L", "a", "o")};
    const Structure s = build_structure(d);
    const auto loop = [&](const Names& closed, const std::string& member) {
        const auto found = loop_through(rigid_set(d, s, closed, rigid_alone), s.inertia, member);
        return found ? found->devices : Names{};
    };
    EXPECT_EQ(loop({"K"}, "K"), Names{});
    EXPECT_EQ(loop({"K", "L"}, "L"), (Names{"K", "L"}));
    EXPECT_EQ(loop({"K", "L"}, "g"), (Names{"g", "h"}));
    EXPECT_EQ(loop({"K", "L"}, "nobody"), Names{});
    EXPECT_EQ(tie_ups(rigid_set(d, s, {"K", "L"}, rigid_alone), s.inertia).size(), 2u);
}

// A tyre slips: one that rolls at another speed holds nothing, a brake on the wheel holds the body.
TEST(TieUps, TyresBlockNothingBrakesOfTheirWheelsDo) {
    Description d = tractor();
    d.output_mass = "vehicle";
    d.masses.push_back(machines::mass("front", 100));
    d.gears.push_back(machines::gear("lead", "axle_input", "front", 0.6));
    d.tyres.push_back(d.tyres[0]);
    d.tyres[1].name = "front_tyre";
    d.tyres[1].wheel = "front";
    d.clutches.push_back(machines::clutch("brake", "wheels", ""));
    EXPECT_TRUE(only_gear(d, {"Fc", "F2"}).blocked_by.empty());
    EXPECT_TRUE(only_gear(d, {"Fc", "F2"}).tie_ups.empty());
    EXPECT_EQ(only_gear(d, {"Fc", "F2", "brake"}).blocked_by, Names{"brake"});
}

// ---- states beside the gears ------------------------------------------------------------------------

std::vector<std::string> names_of(const std::vector<GearVariant>& states) {
    std::vector<std::string> names;
    for (const GearVariant& state : states) names.push_back(state.name);
    return names;
}

TEST(OtherStates, AreTheOpenMachineBesideGearPathsElseAlsoTheStartAndAllClosed) {
    Description d = tractor();
    EXPECT_EQ(names_of(other_states(d)), Names{"all open"});
    d.gear_paths.clear();
    EXPECT_EQ(names_of(other_states(d)), (Names{"all closed/L", "all closed/M", "all closed/H", "all open/L",
                                                "all open/M", "all open/H"}));
    d.gears[4].options.clear();
    d.clutches[0].initially_locked = true;
    const auto states = other_states(d);
    EXPECT_EQ(names_of(states), (Names{"as it starts", "all closed", "all open"}));
    EXPECT_EQ(states[0].closed, Names{"Fc"});
    EXPECT_EQ(states[1].closed, (Names{"Fc", "F1", "F2", "F3", "F4"}));
    for (Clutch& clutch : d.clutches) clutch.initially_locked = true;
    EXPECT_EQ(names_of(other_states(d)), (Names{"all closed", "all open"}));
    EXPECT_EQ(names_of(other_states(two_inertias())), Names{"all open"});
}

}  // namespace
}  // namespace shiftrig::plant
