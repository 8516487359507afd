// What `check` warns about: each warning word for word, where it is due and where it is not; and that the step does go wrong
// where it is said to, and does not where the advice is taken.
#include "plant/warnings.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/plant/machines.h"
#include "tests/plant/rig.h"

namespace shiftrig::plant {
namespace {

using Lines = std::vector<std::string>;
using machines::gear;
using machines::mass;
using machines::shaft;

Lines warnings_of(const Description& d, double step_size = 1e-3) {
    BuildOptions options;
    options.step_size = step_size;
    return model_warnings(Model::build(d, options));
}

// ---- losses, loops ----------------------------------------------------------------------------------

TEST(Warnings, NameEfficiencyInertiaAndTieUp) {
    Description d = machines::wt_gearbox();
    d.planetaries[1].efficiency = 0.4;
    d.masses[2].inertia = 1e-8;
    d.clutches.push_back(machines::clutch("C1b", "input", "sun23"));
    d.gear_paths = {{"double", {"C1", "C1b", "C3"}}};
    EXPECT_EQ(
        warnings_of(d),
        (Lines{"planetary row \"row2\": efficiency 0.4 is below 0.5: the losses of several such meshes may "
               "agree with no directions of power, or with two; a real one as poor mostly holds itself when "
               "driven backwards, which one efficiency for both ways does not show",
               "masses \"ring1\" and \"output\": inertia ratio 5e+07 is beyond 1e7: joins and internal "
               "torques lose digits",
               "gear double: the loop of C1, C1b is closed twice: the split of torque is not unique"}));
}

Description worm(double efficiency, double backward) {
    Description d;
    d.masses = {mass("motor", 0.02), mass("drum", 3)};
    d.gears = {gear("worm", "motor", "drum", 30, efficiency)};
    d.gears[0].backward_efficiency = backward;
    return d;
}

TEST(Warnings, OfAPoorGearDoNotClaimThatItHoldsItselfHere) {
    EXPECT_EQ(
        warnings_of(worm(0.3, 0)),
        Lines{"gear \"worm\": efficiency 0.3 is below 0.5: the losses of several such meshes may agree with "
              "no directions of power, or with two; a real one as poor mostly holds itself when driven "
              "backwards, which one efficiency for both ways does not show (backward_efficiency does)"});
    EXPECT_EQ(
        warnings_of(worm(0.6, 0.02)),
        Lines{"gear \"worm\": backward_efficiency 0.02 is below 0.5: the losses of several such meshes may "
              "agree with no directions of power, or with two"});
    // Nor does it: the load turns the motor with what the gear leaves of its torque.
    Description d = worm(0.3, 0);
    TorqueSource load;
    load.name = "load", load.mass = "drum", load.waveform.pieces = {{.offset = -400}};
    d.sources = {load};
    Rig rig(d);
    rig.run(0.1);
    const double acceleration = -30 * 400 / (3 + 0.02 * 30 * 30 / 0.3);
    EXPECT_NEAR(rig.out("mass.motor.speed"), 0.1 * acceleration, 1e-6);
}

// What does hold itself is a row in which power circulates: û = 0.98/0.95 is beyond 1, and 1 − û turns its sign.
TEST(Warnings, AreNotNeededForARowThatHoldsItself) {
    Description d;
    d.masses = {mass("sun", 1), mass("ring", 1), mass("carrier", 0.01)};
    d.planetaries = {machines::row("row", "sun", "ring", "carrier", 0.98, 0.95)};
    d.clutches = {machines::clutch("B", "ring", "", 1e4)};
    d.clutches[0].initially_locked = true;
    TorqueSource source;
    source.name = "q", source.mass = "sun", source.waveform.pieces = {{.offset = 10}};
    d.sources = {source};
    EXPECT_EQ(warnings_of(d), Lines{});
    const auto carrier_after = [&d] {
        Rig rig(d);
        rig.run(0.5);
        return rig.out("mass.carrier.speed");
    };
    EXPECT_EQ(carrier_after(), 0);
    d.sources[0].mass = "carrier";
    EXPECT_GT(carrier_after(), 100);
    d.sources[0].mass = "sun";
    d.planetaries[0].efficiency = 0.995;
    EXPECT_GT(carrier_after(), 1);
}

// ---- rigid parts that contradict one another --------------------------------------------------------

Description twice_geared(double first, double second) {
    Description d;
    d.masses = {mass("a", 1), mass("b", 1), mass("c", 1)};
    d.gears = {gear("g", "a", "b", first), gear("h", "a", "b", second)};
    return d;
}

TEST(Warnings, NameGearsThatLeaveNoMotion) {
    EXPECT_EQ(
        warnings_of(twice_geared(2, 3)),
        Lines{"gear \"g\", gear \"h\" contradict one another: \"a\", \"b\" can only stand still, for ever"});
    EXPECT_EQ(warnings_of(twice_geared(2, 2)),
              Lines{"all open: the loop of g, h is closed twice: the split of torque is not unique"});
    // A row between two gears that say otherwise; two separate knots are told apart.
    Description d = twice_geared(2, 3);
    for (const char* name : {"s", "r", "k"}) d.masses.push_back(mass(name, 1));
    d.planetaries = {machines::row("row", "s", "r", "k", -2)};
    d.gears.push_back(gear("i", "s", "r", 5));
    EXPECT_EQ(warnings_of(d).size(), 1u);  // the row turns as a block of other ratios
    d.gears.push_back(gear("j", "r", "k", 5));
    const Lines lines = warnings_of(d);
    ASSERT_EQ(lines.size(), 2u);
    EXPECT_EQ(
        lines[1],
        "gear \"i\", gear \"j\", planetary row \"row\" contradict one another: \"s\", \"r\", \"k\" can only "
        "stand still, for ever");
}

TEST(Warnings, SayWithWhichOptionGearsLeaveNoMotion) {
    Description d = twice_geared(2, 2);
    d.gears[1].options = {{"L", 2}, {"H", 1}};
    EXPECT_EQ(warnings_of(d),
              (Lines{"with h H: gear \"g\", gear \"h\" contradict one another: \"a\", \"b\" can only stand "
                     "still, for ever",
                     "all open/L: the loop of g, h is closed twice: the split of torque is not unique"}));
}

// J-weighted projection onto ω_a = 2 ω_b: the momentum 1·10 along (2, 1) of the inertia 5.
TEST(Warnings, SayWhatTheRunBeginsWithWhereInitialSpeedsContradictAGear) {
    Description d;
    d.masses = {mass("a", 1), mass("b", 1)};
    d.masses[0].initial_speed = 10;
    d.gears = {gear("g", "a", "b", 2)};
    const std::string line =
        "initial speeds contradict gear \"g\": the run begins with \"a\" at 8 rad/s instead of 10, \"b\" at "
        "4 "
        "rad/s instead of 0";
    EXPECT_EQ(warnings_of(d), Lines{line});
    EXPECT_EQ(initial_speed_warning(Model::build(d)), line);
    d.masses[1].initial_speed = 5;
    EXPECT_EQ(warnings_of(d), Lines{});
}

TEST(Warnings, SayThatInitialSpeedsContradictALockedClutch) {
    Description d;
    d.masses = {mass("a", 1), mass("b", 3)};
    d.masses[0].initial_speed = 10;
    d.clutches = {machines::clutch("K", "a", "b")};
    EXPECT_EQ(warnings_of(d), Lines{});
    d.clutches[0].initially_locked = true;
    EXPECT_EQ(
        warnings_of(d),
        Lines{"initial speeds contradict locked \"K\": the run begins with \"a\" at 2.5 rad/s instead of 10, "
              "\"b\" at 2.5 rad/s instead of 0"});
}

// ---- resonances ---------------------------------------------------------------------------------------

// 59.55 Hz.
Description engine_on_a_shaft() {
    constexpr double rpm = 3.14159265358979323846 / 30;
    Description d;
    d.masses = {mass("engine", 2), mass("load", 5)};
    d.shafts = {shaft("s", "engine", "load", 200000, 2)};
    Engine engine;
    engine.name = engine.mass = "engine";
    engine.full_load = {{70, 500}, {200, 500}};
    engine.governor_slope = 100;
    engine.low_idle = 800 * rpm;
    engine.high_idle = 2500 * rpm;
    d.engines = {engine};
    return d;
}

TEST(Warnings, EngineOrderMeetsAModeWithGearPathsAndWithout) {
    Description d = engine_on_a_shaft();
    const std::string said = "engine order 3 meets the mode at 59.6 Hz at 1191 rpm (damping ratio 0.00)";
    EXPECT_EQ(warnings_of(d), Lines{"all open: " + said});
    d.gear_paths = {{"g", {}}};
    EXPECT_EQ(warnings_of(d), (Lines{"gear g: " + said, "all open: " + said}));
    d.gear_paths.clear();
    d.masses.push_back(mass("tail", 5));
    d.clutches = {machines::clutch("K", "load", "tail")};
    const Lines lines = warnings_of(d);
    ASSERT_EQ(lines.size(), 2u);
    EXPECT_EQ(lines[0],
              "all closed: engine order 3 meets the mode at 55.1 Hz at 1103 rpm (damping ratio 0.00)");
    EXPECT_EQ(lines[1], "all open: " + said);
}

TEST(Warnings, MainOrderIsHalfTheNumberOfCylinders) {
    Description d = engine_on_a_shaft();
    d.engines[0].cylinders = 4;
    EXPECT_EQ(warnings_of(d),
              Lines{"all open: engine order 2 meets the mode at 59.6 Hz at 1787 rpm (damping ratio 0.00)"});
    d.engines[0].cylinders = 3;
    EXPECT_EQ(warnings_of(d),
              Lines{"all open: engine order 1.5 meets the mode at 59.6 Hz at 2382 rpm (damping ratio 0.00)"});
    d.engines[0].cylinders = 12;  // 596 rpm, below idle
    EXPECT_EQ(warnings_of(d), Lines{});
    d.engines[0].cylinders = 0;
    EXPECT_THROW(warnings_of(d), ModelError);
}

// The load is nearly held: 50.33 Hz were it quite. Undamped it would be 59.6 Hz and, as the shape is then, overdamped.
TEST(Warnings, EngineOrderMeetsTheModeThatAStrongDamperLeaves) {
    Description d = engine_on_a_shaft();
    d.dampers = {{"D", "load", "", 20000}};
    EXPECT_EQ(warnings_of(d),
              Lines{"all open: engine order 3 meets the mode at 50.4 Hz at 1008 rpm (damping ratio 0.02)"});
}

TEST(Warnings, EngineOrderIsNotSaidToMeetWhatItHardlyExcites) {
    Description d = engine_on_a_shaft();
    const double critical = 2 * std::sqrt(200000 / (1 / 2. + 1 / 5.));
    d.shafts[0].damping = 0.49 * critical;
    EXPECT_EQ(warnings_of(d).size(), 1u);
    d.shafts[0].damping = 0.51 * critical;
    EXPECT_EQ(warnings_of(d), Lines{});
    // 2 and 5 on a shaft beside the engine: it has J₁/(J₁ + J_e) of what the near mass has.
    d = engine_on_a_shaft();
    d.masses = {mass("engine", 2e4), mass("near", 2), mass("load", 5)};
    d.shafts = {shaft("s", "near", "load", 200000, 0), shaft("soft", "engine", "near", 10, 0)};
    EXPECT_EQ(warnings_of(d), Lines{});
}

// ---- gears that block themselves ----------------------------------------------------------------------

TEST(Warnings, NameAGearPathThatBlocksItsOutputAndByWhat) {
    Description d;
    d.masses = {mass("a", 1), mass("b", 1), mass("o", 3)};
    d.gears = {gear("g1", "a", "b", 2), gear("g2", "a", "o", 3)};
    d.clutches = {machines::clutch("K", "b", "o"), machines::clutch("B", "o", "")};
    d.gear_paths = {{"one", {"K"}}, {"two", {}}, {"three", {"B"}}};
    d.input_mass = "a";
    d.output_mass = "o";
    EXPECT_EQ(warnings_of(d), (Lines{"gear one: the output \"o\" is blocked by g1, g2, K",
                                     "gear three: the output \"o\" is blocked by B"}));
    // Through a shaft as well; what gears alone hold is told of them once.
    d.masses.push_back(mass("t", 1));
    d.clutches[1].a = "t";
    d.shafts = {shaft("s", "o", "t", 1000, 1)};
    EXPECT_EQ(warnings_of(d).back(), "gear three: the output \"o\" is blocked by B, s");
    d.gears.push_back(gear("g3", "a", "b", 3));
    for (const std::string& line : warnings_of(d))
        EXPECT_EQ(line.find("is blocked by"), std::string::npos) << line;
}

// ---- what steps do not resolve ------------------------------------------------------------------------

// 20 Nm more per 0.1 rad/s on 1e-4 kg m²: gone within 0.5 µs.
TEST(Warnings, NameFrictionThatIsTooSteep) {
    Description d;
    d.masses = {mass("light", 1e-4), mass("heavy", 1)};
    d.clutches = {machines::clutch("F", "light", "heavy", 40), machines::clutch("G", "heavy", "", 40)};
    for (Clutch& clutch : d.clutches)
        std::get<DryFriction>(clutch.friction).factor_over_slip = {{0, 0.5}, {0.1, 1}};
    EXPECT_EQ(
        warnings_of(d),
        Lines{"clutch \"F\": its friction rises by 200 Nm s/rad and so slows its lighter mass within 0.5 µs; "
              "a step of 1 ms resolves no less than 3.91 µs"});
    EXPECT_EQ(warnings_of(d, 1e-4), Lines{});
}

// Wet plates as well: 3089 Nm per 0.13 at full pressure, of which 0.05 comes within 0.1 m/s at 98 mm.
TEST(Warnings, NameWetFrictionThatIsTooSteep) {
    Description d;
    d.masses = {mass("light", 1e-3), mass("heavy", 1)};
    Clutch c = machines::clutch("F", "light", "heavy");
    WetPlates plates = powershift_plates();
    plates.mu_sliding = 0.13;
    plates.mu_rise = -0.05;
    plates.mu_speed = 0.1;
    c.friction = plates;
    ActuationHydraulic valve;
    valve.natural_frequency = 60;
    valve.damping_ratio = 0.8;
    valve.slew = 150e5;
    valve.maximum_pressure = 18e5;
    c.actuation = valve;
    d.clutches = {c};
    d.maximum_parts = 1;
    const Lines lines = warnings_of(d);
    ASSERT_EQ(lines.size(), 1u);
    EXPECT_EQ(lines[0].rfind("clutch \"F\": its friction rises by ", 0), 0u) << lines[0];
    std::get<WetPlates>(d.clutches[0].friction).mu_rise = 0.025;
    std::get<WetPlates>(d.clutches[0].friction).mu_static = 0.16;
    EXPECT_EQ(warnings_of(d), Lines{});
}

TEST(Warnings, NameBodiesOfVeryDifferentMass) {
    Description d;
    d.masses = {machines::mass("dust", 1e-6, Motion::translating),
                machines::mass("barge", 1e6, Motion::translating), mass("rotor", 1)};
    EXPECT_EQ(warnings_of(d), Lines{"masses \"dust\" and \"barge\": inertia ratio 1e+12 is beyond 1e7: joins "
                                    "and internal torques lose digits"});
}

TEST(Warnings, NameForcesThatAnswerSpeedTooFast) {
    Description d = engine_on_a_shaft();
    d.shafts.clear();
    EXPECT_EQ(warnings_of(d), Lines{});
    d.masses[0].inertia = 1e-3;
    EXPECT_EQ(warnings_of(d),
              Lines{"engine \"engine\": its governor corrects the speed within 10 µs; a step of 1 ms "
                    "resolves no less than 62.5 µs"});
    d.engines[0].actuator_lag = 1e-2;  // swings at 3162 rad/s
    EXPECT_EQ(warnings_of(d), Lines{});
    d.engines[0].actuator_lag = 1e-5;
    EXPECT_EQ(warnings_of(d).size(), 2u);
    d.engines.clear();
    TorqueSource drag;
    drag.name = "fan", drag.mass = "engine", drag.quadratic = 0.1;
    d.sources = {drag};
    EXPECT_EQ(warnings_of(d), Lines{"source \"fan\": its drag above 80 rad/s slows mass \"engine\" faster "
                                    "than a step of 1 ms resolves"});
    EXPECT_EQ(warnings_of(d, 5e-5), Lines{});
}

// 25 (ω/12.4)² of torque per share of slip near synchronous speed, steeper than the square of the speed elsewhere.
TEST(Warnings, NameATurbineThatIsTooLightForItsConverter) {
    Description d;
    d.masses = {mass("pump", 1), mass("turbine", 1e-4)};
    TorqueConverter c;
    c.name = "converter", c.pump = "pump", c.turbine = "turbine";
    c.k_over_speed_ratio = {{0, 6.6}, {1, 12.4}};
    c.torque_ratio_over_speed_ratio = {{0, 2.5}, {0.85, 1}};
    d.converters = {c};
    EXPECT_EQ(warnings_of(d),
              Lines{"converter \"converter\": its torque above 74.4 rad/s slows mass \"turbine\" "
                    "faster than a step of 1 ms resolves"});
    d.masses[1].inertia = 2e-3;  // parts of 1/256 of a step
    EXPECT_EQ(warnings_of(d), Lines{});
    d.maximum_parts = 1;
    EXPECT_EQ(warnings_of(d).size(), 1u);
}

TEST(Warnings, NameATyreOnAWheelThatIsTooLight) {
    Description d;
    d.masses = {mass("wheel", 0.0642), mass("body", 3000, Motion::translating)};
    BrixiusTyre tyre;
    tyre.name = "tyre", tyre.wheel = "wheel", tyre.body = "body";
    tyre.radius = 0.5;
    tyre.mobility_number = 55;
    tyre.relaxation_length = 0.3;
    tyre.weight = 30000;
    tyre.slip_damping_time = 0.05;
    d.tyres = {tyre};
    EXPECT_EQ(warnings_of(d),
              Lines{"tyre \"tyre\": its force answers the slip of its wheel within 7.81 µs; a step of "
                    "1 ms resolves no less than 62.5 µs"});
    d.masses[0].inertia = 10;
    EXPECT_EQ(warnings_of(d), Lines{});
}

// 1 | 1e-5 | 1 kg m² between shafts, a brake on the light one: it swings at 12.3 kHz.
Description light_mass_with_brake(double damping = 1e-3, int parts = 16) {
    Description d;
    d.masses = {mass("a", 1), mass("t", 1e-5), mass("b", 1)};
    d.shafts = {shaft("s", "a", "t", 30000, damping), shaft("r", "t", "b", 30000, damping)};
    d.clutches = {machines::clutch("K", "t", "", 1, 1.2)};
    d.gear_paths = {{"g", {}}, {"h", {"K"}}};
    TorqueSource source;
    source.name = "q", source.mass = "t", source.waveform.pieces = {{.amplitude = 5, .frequency = 30}};
    d.sources = {source};
    d.maximum_parts = parts;
    return d;
}

TEST(Warnings, NameAModeThatTurnsFrictionRoundFasterThanTheStepResolves) {
    EXPECT_EQ(warnings_of(light_mass_with_brake()),
              Lines{"gear g, all open: mode at 12328 Hz of \"t\" (ωh = 77.5, damping ratio 0.0013): a step "
                    "of 1 ms (its shortest "
                    "part: 62.5 µs) does not resolve how it turns the friction of \"K\" round; take steps of "
                    "0.413 ms or "
                    "maximum_parts 64, damp it, or make the mass part of its neighbour"});
    EXPECT_EQ(warnings_of(light_mass_with_brake(), 0.41e-3), Lines{});
    // Only what a model file may have is advised.
    const Lines coarse = warnings_of(light_mass_with_brake(), 10e-3);
    ASSERT_EQ(coarse.size(), 1u);
    EXPECT_EQ(coarse[0].find("maximum_parts"), std::string::npos) << coarse[0];
    EXPECT_EQ(warnings_of(light_mass_with_brake(1e-3, 64)), Lines{});
    EXPECT_EQ(warnings_of(light_mass_with_brake(1)), Lines{});
    Description d = light_mass_with_brake();
    d.masses[1].inertia = 1e-3;
    EXPECT_EQ(warnings_of(d), Lines{});
    d.method = Method::ark3;  // whose shafts are not exact
    EXPECT_EQ(warnings_of(d).size(), 1u);
    d = light_mass_with_brake();
    d.clutches[0].a = "a";  // which the mode hardly moves
    EXPECT_EQ(warnings_of(d), Lines{});
}

// Largest difference of the light mass's speed from a run at 20 µs, of the range of that.
double error_of(const Description& d, double step_size) {
    BuildOptions fine, coarse;
    fine.step_size = 2e-5;
    coarse.step_size = step_size;
    Rig reference(d, fine), rig(d, coarse);
    double low = 0, high = 0, worst = 0;
    while (rig.state.time() < 0.25 - 1e-9) {
        rig.step();
        reference.run(rig.state.time());
        const double speed = reference.out("mass.t.speed");
        low = std::min(low, speed);
        high = std::max(high, speed);
        worst = std::max(worst, std::fabs(rig.out("mass.t.speed") - speed));
    }
    return worst / (high - low);
}

TEST(Warnings, AreTrueOfTheModeThatTurnsFrictionRoundAndSoIsTheirAdvice) {
    EXPECT_GT(error_of(light_mass_with_brake(), 2e-3), 0.2);  // ω times the shortest part: 9.7
    EXPECT_LT(error_of(light_mass_with_brake(), 0.4e-3), 0.01);
    EXPECT_LT(error_of(light_mass_with_brake(1e-3, 64), 1e-3), 0.01);
    EXPECT_LT(error_of(light_mass_with_brake(1), 1e-3), 0.01);
}

// ---- dampers along a chain --------------------------------------------------------------------------

TEST(Warnings, NameADamperThatTheAccountAlongAChainDoesNotFollow) {
    Description d;
    d.masses = {mass("a", 1), mass("b", 0.01), mass("c", 1)};
    d.masses[1].initial_speed = 50;
    d.dampers = {{.name = "k", .a = "a", .b = "b", .damping = 100}};
    const auto defect = [&] {
        Rig rig(d);
        rig.run(0.01);
        return std::fabs(rig.out("energy.defect"));
    };
    d.method = Method::ark3;
    EXPECT_EQ(
        warnings_of(d),
        (Lines{"damping of \"k\": a slip there dies out within 0.099 ms, a step is 1 ms: on the engine for "
               "long chains the account of energy does not follow that (energy.defect tells)"}));
    EXPECT_GT(defect(), 10);
    EXPECT_EQ(warnings_of(d, 5e-5), Lines{});
    d.method = Method::etd3;
    EXPECT_EQ(warnings_of(d), Lines{});
    EXPECT_LT(defect(), 5e-3);
    // Behind a gear to a heavy mass it is slow.
    d.method = Method::ark3;
    d.gears = {gear("G", "b", "c", 1)};
    d.masses[2].initial_speed = 50;
    EXPECT_EQ(warnings_of(d), Lines{});
}

}  // namespace
}  // namespace shiftrig::plant
