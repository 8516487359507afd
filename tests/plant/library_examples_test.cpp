// Drive trains of the kind that the Modelica Standard Library shows in Mechanics.Rotational.Examples, built from their published
// definitions ([MSL], docs/references.md) and compared with the reference solver. No curve of that library is used here.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/plant/comparison.h"
#include "tests/plant/rig.h"

namespace shiftrig {
namespace {

using namespace plant;

Actuation pressed(Waveform engagement) {
    return ActuationDirect{.profile = std::move(engagement)};
}

// Where a machine hangs on the housing by an elastic link.
void hold(Description& d, const char* ground) {
    d.masses.push_back(mass(ground, 1));
    d.clutches.push_back(clutch("holds the ground", ground, "", 1e7));
    d.clutches.back().initially_locked = true;
}

Freewheel freewheel(const char* a, const char* b) {
    return {.name = "freewheel", .a = a, .b = b, .rated_torque = 1e4, .sliding_share = 1};
}

// A mesh of η = 0.5 and a bearing whose friction rises with speed: both can be at rest, and share what holds them.
Description gear_with_bearing() {
    Description d;
    d.name = "LossyGearDemo2";
    d.masses = {mass("1", 1), mass("2", 1.5)};
    d.gears = {{.name = "gear", .a = "1", .b = "2", .ratio = 2, .efficiency = 0.5, .options = {}}};
    d.clutches = {clutch("bearing", "1", "", 1)};
    std::get<DryFriction>(d.clutches[0].friction).factor_over_slip = {{0, 0.5}, {1, 1}};
    d.sources = {source("1", {{{.amplitude = 10, .frequency = 1}}}),
                 source("2", {{{.from = 0, .offset = -10, .slope = 2.5}}})};
    return d;
}

// η = 0.25 with bearing losses that differ by driving side, between equal masses: neither side is obviously the driving one.
Description gear_without_a_driving_side() {
    Description d;
    d.name = "LossyGearDemo3";
    d.masses = {mass("1", 1e-3, 10), mass("2", 1e-3, 10)};
    d.gears = {{.name = "gear",
                .a = "1",
                .b = "2",
                .ratio = 1,
                .efficiency = 0.25,
                .bearing_torque = 0.625,
                .backward_efficiency = 0.25,
                .backward_bearing_torque = 2.5,
                .options = {}}};
    d.sources = {source("2", {{{.from = 0.5, .offset = 1}}})};
    return d;
}

// A clutch that engages beside a freewheel: where both hold, how they share the torque is not unique.
Description freewheel_beside_a_clutch() {
    Description d;
    d.name = "OneWayClutch";
    d.masses = {mass("in", 1, -0.5), mass("out", 1)};
    d.freewheels = {freewheel("in", "out")};
    d.clutches = {clutch("clutch", "in", "out", 1.5, 25,
                         pressed({{{.from = 0.3, .until = 0.95, .offset = 1}, {.from = 1.6, .offset = 1}}}))};
    d.sources = {source("in", {{{.amplitude = 10, .frequency = 3}}})};
    return d;
}

Description freewheel_alone() {
    Description d;
    d.name = "OneWayClutchDisengaged";
    d.masses = {mass("in", 1, -0.5), mass("out", 1)};
    d.freewheels = {freewheel("in", "out")};
    d.sources = {source("in", {{{.offset = 0.3, .amplitude = 10, .frequency = 2}}}),
                 source("out", {{{.offset = -0.3}}})};
    return d;
}

// Released from a twist of 90°, through a gap of 45°.
Description play_to_the_housing() {
    Description d;
    d.name = "Backlash";
    d.masses = {mass("inertia", 5)};
    hold(d, "ground");
    d.backlashes = {{.name = "play",
                     .a = "inertia",
                     .b = "ground",
                     .stiffness = 2e4,
                     .damping = 50,
                     .gap = std::numbers::pi / 4,
                     .initial_twist = std::numbers::pi / 2}};
    return d;
}

// Brake and clutch of a row change places in 0.1 s; a ring of 1e-4 kg m² where the original has none.
Description shift_by_a_row() {
    Description d;
    d.name = "SimpleGearShift";
    d.masses = {mass("engine", 1), mass("ring", 1e-4), mass("load", 10)};
    d.planetaries = {{.name = "row", .sun = "engine", .ring = "ring", .carrier = "load", .ratio = -1.5}};
    d.clutches = {
        clutch("clutch", "engine", "ring", 100, 1,
               pressed({{{.from = 2, .until = 2.1, .slope = 10}, {.from = 2.1, .offset = 1}}})),
        clutch("brake", "ring", "", 100, 1,
               pressed({{{.until = 2, .offset = 1}, {.from = 2, .until = 2.1, .offset = 1, .slope = -10}}}))};
    const double nominal = 10.471975511966;  // 100/min
    d.sources = {source("engine", {{{.from = 0.5, .offset = 20}}}), source("load", {})};
    d.sources[1].quadratic = 20 / (nominal * nominal);
    return d;
}

// The housing of a gear of ratio 3 on an elastic mount. ω_shaft = 3 ω_out − 2 ω_housing; 1e-3 kg m² where the original has none.
Description gear_in_an_elastic_housing() {
    Description d;
    d.name = "ElasticBearing";
    d.masses = {mass("shaft", 1), mass("out", 1e-3), mass("load", 50), mass("housing", 5)};
    hold(d, "ground");
    d.planetaries = {{.name = "gear", .sun = "shaft", .ring = "out", .carrier = "housing", .ratio = 3}};
    d.shafts = {{.name = "spring", .a = "out", .b = "load", .stiffness = 1e3},
                {.name = "mount", .a = "housing", .b = "ground", .stiffness = 1e5, .damping = 5}};
    d.sources = {source("shaft", {{{.from = 0, .until = 5, .slope = 20}, {.from = 5, .offset = 100}}})};
    return d;
}

// Everything that loses energy in one line: dampers, play, bearing friction, a lossy gear, a clutch, a freewheel beside another
// one, a brake, all three pressed by the same sine. The gear's losses do not depend on speed here.
Description everything_in_one_line() {
    Description d;
    d.name = "HeatLosses";
    d.masses = {mass("1", 2), mass("2", 2), mass("3", 2),          mass("4", 2),
                mass("5", 2), mass("6", 2), mass("gear out", 0.01)};
    d.dampers = {{.name = "damper", .a = "1", .b = "", .damping = 10}};
    d.shafts = {{.name = "spring damper", .a = "1", .b = "2", .stiffness = 1e4, .damping = 20},
                {.name = "spring", .a = "3", .b = "4", .stiffness = 1e4}};
    d.backlashes = {{.name = "play", .a = "2", .b = "3", .stiffness = 1e5, .damping = 100, .gap = 1e-3}};
    d.gears = {{.name = "gear",
                .a = "4",
                .b = "gear out",
                .ratio = 2,
                .efficiency = 0.8,
                .bearing_torque = 1,
                .options = {}}};
    const Actuation wave = pressed(sine(1, 0.2));
    d.clutches = {clutch("bearing", "3", "", 0.5), clutch("clutch", "gear out", "5", 5, 1, wave),
                  clutch("one-way clutch", "5", "6", 0.5, 1, wave), clutch("brake", "6", "", 1, 1, wave)};
    d.freewheels = {freewheel("5", "6")};
    d.sources = {source("1", {{{.amplitude = 20, .frequency = 5}}})};
    return d;
}

// `worst` in units of 1e-4 of a signal's range, at most ten times what was measured.
void expect_agreement(const Description& description, double seconds, double worst, int events) {
    ComparisonOptions options;
    options.seconds = seconds;
    RandomSystem system;
    system.description = description;
    system.traits = description.name;
    const Comparison c = compare(system, 1, options);
    EXPECT_TRUE(c.broken.empty()) << c.broken.front();
    EXPECT_EQ(name(c.outcome), std::string("agrees")) << c.worst_signal << " at " << c.worst_time << " s";
    EXPECT_LT(c.worst, worst) << c.worst_signal << " at " << c.worst_time << " s";
    EXPECT_EQ(c.fall_backs, 0);
    EXPECT_GE(c.events, events);
}

TEST(LibraryExamples, AgreeWithTheReferenceSolver) {
    expect_agreement(gear_with_bearing(), 0.5, 8e-5, 4);
    expect_agreement(gear_without_a_driving_side(), 1, 4e-9, 1);
    expect_agreement(freewheel_beside_a_clutch(), 2, 5e-6, 8);
    expect_agreement(freewheel_alone(), 2, 2e-6, 8);
    expect_agreement(play_to_the_housing(), 1, 0.03, 20);
    expect_agreement(shift_by_a_row(), 5, 5e-6, 2);
    expect_agreement(gear_in_an_elastic_housing(), 3, 3e-8, 0);
    expect_agreement(everything_in_one_line(), 1, 0.02, 50);
}

TEST(LibraryExamples, AgreeOnTheTreeAsWell) {
    for (Description d : {gear_with_bearing(), gear_without_a_driving_side(), freewheel_alone()}) {
        d.method = Method::ark3;
        expect_agreement(d, 0.5, 8e-4, 1);
    }
    // Past the knots of a friction table, one at 1 and one at 2 rad/s.
    Description d = gear_with_bearing();
    std::get<DryFriction>(d.clutches[0].friction).factor_over_slip = {{0, 0.5}, {1, 2}, {2, 1}};
    d.method = Method::ark3;
    expect_agreement(d, 1, 0.1, 1);
    Rig plain(d), forgetful(d);
    while (plain.state.time() < 1) {
        forgetful.scratch.fill_with_nan();
        plain.step();
        forgetful.step();
        ASSERT_EQ(plain.state.speeds()[0], forgetful.state.speeds()[0]) << plain.state.time();
    }
    EXPECT_LT(plain.state.speeds()[0], -2);
}

// At rest, bearing and mesh share what holds them, and no torque but the sum is known. They give way forward where the
// drive has both against it: 10 sin 2πt − 0.5 = M_1, and half of M_1 carries 5 − 1.25 t.
TEST(LibraryExamples, BearingAndMeshAtRestGiveWayTogether) {
    const auto surplus = [](double t) {
        return 10 * std::sin(2 * std::numbers::pi * t) - 0.5 - 2 * (5 - 1.25 * t);
    };
    double low = 0.2, high = 0.25;
    for (int i = 0; i < 60; ++i) (surplus(0.5 * (low + high)) < 0 ? low : high) = 0.5 * (low + high);
    Rig rig(gear_with_bearing());
    while (rig.state.speeds()[0] <= 0) rig.step();
    EXPECT_NEAR(rig.times(EventKind::break_away, "bearing").back(), low, 1e-6);
}

}  // namespace
}  // namespace shiftrig
