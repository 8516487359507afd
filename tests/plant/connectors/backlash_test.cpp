// Elastic shafts with play: closed forms of flight and contact, flanks that never pull, momentum and energy.
#include <algorithm>
#include <numbers>

#include "io/model_file.h"
#include "plant/modal.h"
#include "plant/statics.h"
#include "tests/plant/rig.h"

namespace shiftrig::plant {
namespace {

constexpr double pi = std::numbers::pi;

// Two masses and a gap between them, undisturbed: only their relative motion, of the reduced inertia, is of interest.
struct Pair {
    double j1 = 0.4, j2 = 1.2, stiffness = 3000, damping = 0, half_gap = 0.01, speed = 2;

    double reduced() const { return j1 * j2 / (j1 + j2); }
    double omega() const { return std::sqrt(stiffness / reduced()); }
    Description description() const {
        Description d;
        d.name = "gap";
        d.masses = {mass("1", j1, 50 + speed * j2 / (j1 + j2)), mass("2", j2, 50 - speed * j1 / (j1 + j2))};
        d.backlashes = {{"B", "1", "2", stiffness, damping, 2 * half_gap, 0}};
        return d;
    }
    double relative_energy() const { return 0.5 * reduced() * speed * speed; }
};

class EachStep : public ::testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Steps, EachStep, ::testing::Values(1e-3, 1e-4),
                         [](const auto& test) { return test.param > 5e-4 ? "1ms" : "100us"; });

// Flight through the play 2δ/v, half a period π/ω on each flank: closes at δ/v + n (2δ/v + π/ω).
void expect_bounces(const Pair& pair, double h, double seconds, double time_tolerance) {
    Rig rig(pair.description(), {h, KernelKind::automatic});
    rig.run(seconds);
    const auto closes = rig.times(EventKind::flank_closes, "B"),
               opens = rig.times(EventKind::flank_opens, "B");
    const double flight = 2 * pair.half_gap / pair.speed, contact = pi / pair.omega();
    const double first = pair.half_gap / pair.speed;
    const auto expected = static_cast<std::size_t>(std::floor((seconds - first) / (flight + contact))) + 1;
    ASSERT_GE(closes.size(), expected - 1);
    ASSERT_LE(closes.size(), expected + 1);
    for (std::size_t n = 0; n < std::min(opens.size(), expected - 1); ++n) {
        const double touch = first + static_cast<double>(n) * (flight + contact);
        ASSERT_NEAR(closes[n], touch, time_tolerance * (1 + static_cast<double>(n))) << n;
        ASSERT_NEAR(opens[n], touch + contact, time_tolerance * (1 + static_cast<double>(n))) << n;
    }
    EXPECT_EQ(rig.fall_backs, 0);
    // A step is exact to 2e-14 of what it moves, whose kinetic energy is a thousand times that of the bouncing.
    const double rounding = 2e-14 * static_cast<double>(rig.state.steps()),
                 momentum = 50 * (pair.j1 + pair.j2);
    EXPECT_NEAR(pair.j1 * rig.out("mass.1.speed") + pair.j2 * rig.out("mass.2.speed"), momentum,
                rounding * momentum);
    // Whatever instants are missed by is strain that changes hands: 1e-9 of a step's way, squared.
    EXPECT_NEAR(rig.out("energy.dissipated"), 0,
                1e-11 * pair.relative_energy() * static_cast<double>(closes.size()));
    EXPECT_NEAR(rig.out("energy.defect"), 0, rounding * 0.5 * 50 * momentum);
}

TEST_P(EachStep, AMassBouncesInAGapWithThePeriodOfFlightAndContact) {
    expect_bounces(Pair{}, GetParam(), 2, 1e-12);
}

// ωh = 18 at 1 ms: six contacts could begin and end within one step.
TEST_P(EachStep, TeethStifferThanTheStepBounceWithTheSamePeriod) {
    Pair pair;
    pair.stiffness = 1e8;
    pair.half_gap = 1e-3;
    expect_bounces(pair, GetParam(), 0.5, 2e-12);
}

// Let go by one flank and stopped by the other within half a part.
TEST_P(EachStep, APlayCrossedWithinAPartOfAStepIsNoPlaceToChatter) {
    for (const double half_gap : {1e-4, 1e-5, 1e-6, 1e-8}) {
        Pair pair;
        pair.half_gap = half_gap;
        expect_bounces(pair, GetParam(), 2, 1e-12);
    }
}

// A thrown mass driven back beyond the flank, from which at the end of the step it recedes faster than the damped flank
// follows: open half way and at the end, and yet there was a contact.
TEST_P(EachStep, ATouchIsSeenThatIsOverButStillStrainedAtTheEndOfTheStep) {
    const double h = GetParam();
    Pair pair;
    pair.damping = 4;
    const double a = pair.speed / (0.85 * h);  // turns round at 0.85 h
    pair.half_gap = 0.5 * a * h * h * (0.85 * 0.85 - 0.2 * 0.2);
    Description d = pair.description();
    d.sources = {source("1", constant(-a * pair.reduced())), source("2", constant(a * pair.reduced()))};
    Rig rig(d, {h, KernelKind::automatic});
    rig.run(h);
    const auto closes = rig.times(EventKind::flank_closes, "B");
    ASSERT_EQ(closes.size(), 1u);
    EXPECT_NEAR(closes[0], 0.65 * h, 1e-8 * h);
    EXPECT_EQ(rig.times(EventKind::flank_opens, "B").size(), 1u);
}

// What lets the flank go takes the torque from the lossy gear behind it: both change in one instant.
TEST_P(EachStep, AFlankLetsGoOnTimeThoughTheGearBehindItTurns) {
    Pair pair;
    pair.j2 = 0.2;
    Description d = pair.description();
    d.masses = {mass("1", pair.j1, 52), mass("2", pair.j2, 50), mass("3", 0.5, 25)};
    Gear gear;
    gear.name = "g", gear.a = "2", gear.b = "3", gear.ratio = 2, gear.efficiency = 0.9;
    d.gears = {gear};
    pair.j2 += 0.5 / (4 * 0.9);  // with that of the wheel, which the gear moves with û = ηu
    const double zeta = 0.1, damped = pair.omega() * std::sqrt(1 - zeta * zeta);
    d.backlashes[0].damping = 2 * zeta * std::sqrt(pair.stiffness * pair.reduced());
    Rig rig(d, {GetParam(), KernelKind::automatic});
    const double touch = pair.half_gap / pair.speed, contact = (pi - 2 * std::asin(zeta)) / damped;
    rig.run(touch + contact + 1e-3);
    const auto opens = rig.times(EventKind::flank_opens, "B");
    ASSERT_EQ(opens.size(), 1u);
    EXPECT_NEAR(opens[0], touch + contact, 1e-8 * GetParam());
}

// Each impact leaves the same share of the speed before it. A damped flank begins with a jump of its torque: what its
// instant is late by acts on all that follow.
TEST_P(EachStep, HundredDampedImpactsAreEachOnTime) {
    Pair pair;
    const double zeta = 0.01;
    pair.stiffness = 1e7;
    pair.half_gap = 1e-3;
    pair.damping = 2 * zeta * std::sqrt(pair.stiffness * pair.reduced());
    Rig rig(pair.description(), {GetParam(), KernelKind::automatic});
    rig.run(0.8);
    const auto closes = rig.times(EventKind::flank_closes, "B");
    ASSERT_GE(closes.size(), 100u);
    const double damped = pair.omega() * std::sqrt(1 - zeta * zeta);
    const double contact = (pi - 2 * std::asin(zeta)) / damped;
    const double restitution = std::exp(-zeta * pair.omega() * contact);
    const double strain =
        2 * zeta / pair.omega();  // time to fly through what the spring holds when the flank opens
    double touch = pair.half_gap / pair.speed, speed = pair.speed;
    for (std::size_t n = 0; n < 100; ++n) {
        ASSERT_NEAR(closes[n], touch, 4e-9 * GetParam() / 1e-3) << n;
        touch += contact + 2 * pair.half_gap / (speed * restitution) + strain;
        speed *= restitution;
    }
    EXPECT_EQ(rig.fall_backs, 0);
}

TEST_P(EachStep, ADampedImpactLastsAndRestoresWhatTheClosedFormSays) {
    Pair pair;
    const double zeta = 0.2;
    pair.damping = 2 * zeta * std::sqrt(pair.stiffness * pair.reduced());
    Rig rig(pair.description(), {GetParam(), KernelKind::automatic});
    const double touch = pair.half_gap / pair.speed, damped = pair.omega() * std::sqrt(1 - zeta * zeta);
    const double contact = (pi - 2 * std::asin(zeta)) / damped;
    rig.run(touch + contact + 3e-3);
    const auto closes = rig.times(EventKind::flank_closes, "B"),
               opens = rig.times(EventKind::flank_opens, "B");
    ASSERT_EQ(closes.size(), 1u);
    ASSERT_EQ(opens.size(), 1u);
    EXPECT_NEAR(closes[0], touch, 1e-9 * GetParam());
    EXPECT_NEAR(opens[0], touch + contact, 1e-8 * GetParam());
    // ψ̇ at M = 0, with ψ = v/ω_d e^(−ζωt) sin ω_d t.
    const double decay = std::exp(-zeta * pair.omega() * contact);
    const double left =
        pair.speed * decay *
        (std::cos(damped * contact) - zeta * pair.omega() / damped * std::sin(damped * contact));
    EXPECT_NEAR(rig.out("mass.1.speed") - rig.out("mass.2.speed"), left, 1e-11);
    // All that is gone was lost in the flank: while it was closed, and with the strain it still had when it opened.
    EXPECT_NEAR(rig.out("energy.dissipated"), pair.relative_energy() - 0.5 * pair.reduced() * left * left,
                1e-5 * pair.relative_energy());
    EXPECT_NEAR(rig.out("energy.defect"), 0,
                3e4 * std::pow(GetParam(), 4) + 1e-8);  // Simpson, and rounding of 2 kJ
}

// At rest under T, which turns to −T at 0.1 s: cos ωt = 1/2 when the flank opens, then free flight under −T, then contact.
TEST_P(EachStep, AReversalOfTorqueCrossesThePlayInTheTimeOfFreeFlight) {
    Pair pair;
    pair.speed = 0;
    const double torque = 25;
    Description d = pair.description();
    d.backlashes[0].initial_twist = pair.half_gap + torque / pair.stiffness;
    // Torques that move both masses against each other only.
    const auto reversed = [&](double value) {
        Waveform w;
        w.pieces = {{.until = 0.1, .offset = value}, {.from = 0.1, .offset = -value}};
        return w;
    };
    d.sources = {source("1", reversed(torque)), source("2", reversed(-torque))};
    Rig rig(d, {GetParam(), KernelKind::automatic});
    rig.run(0.1 - GetParam());
    EXPECT_NEAR(rig.out("backlash.B.torque"), torque, 1e-9);
    EXPECT_EQ(rig.out("backlash.B.state"), 1);
    rig.run(0.3);
    const double opening = 0.1 + pi / 3 / pair.omega();
    const double speed = 2 * torque / pair.stiffness * pair.omega() * std::sin(pi / 3),
                 a = torque / pair.reduced();
    const double flight = (-speed + std::sqrt(speed * speed + 4 * a * pair.half_gap)) / a;
    const auto closes = rig.times(EventKind::flank_closes, "B"),
               opens = rig.times(EventKind::flank_opens, "B");
    ASSERT_GE(opens.size(), 1u);
    ASSERT_GE(closes.size(), 1u);
    EXPECT_NEAR(opens[0], opening, 1e-8 * GetParam());
    EXPECT_NEAR(closes[0], opening + flight, 1e-8 * GetParam());
}

TEST_P(EachStep, FlanksPressNeverPullAndCarryNothingInThePlay) {
    Pair pair;
    pair.damping = 4;
    Description d = pair.description();
    d.sources = {source("1", sine(20, 7)), source("2", sine(12, 3))};
    Rig rig(d, {GetParam(), KernelKind::automatic});
    int open = 0, forward = 0, backward = 0;
    while (rig.state.time() < 3 - 1e-9) {
        rig.step();
        const double state = rig.out("backlash.B.state"), torque = rig.out("backlash.B.torque"),
                     twist = rig.out("backlash.B.twist");
        (state == 0 ? open : state > 0 ? forward : backward)++;
        if (state == 0) {
            ASSERT_EQ(torque, 0);
        } else {
            ASSERT_GE(state * torque, -1e-3);  // 1e-5 of what a step changes
            ASSERT_GE(state * twist, pair.half_gap - 1e-7);
        }
    }
    EXPECT_GT(open, 10);
    EXPECT_GT(forward, 10);
    EXPECT_GT(backward, 10);
    EXPECT_EQ(rig.fall_backs, 0);
    EXPECT_NEAR(rig.out("energy.defect"), 0, 1e-8 + 3e5 * std::pow(GetParam(), 3));
}

TEST(Backlash, TheOrderAcrossItsEventsIsThatOfTheMethod) {
    const auto final_state = [](double h) {
        Pair pair;
        pair.stiffness = 800;
        pair.damping = 0.5;
        Description d = pair.description();
        d.masses.push_back(mass("3", 0.3, 50));
        d.shafts = {{"s", "2", "3", 900, 1, 0}};
        d.sources = {source("1", sine(20, 4)), source("3", constant(2))};
        d.sources[0].quadratic = 0.01;
        d.maximum_parts = 1;
        Rig rig(d, {h, KernelKind::automatic});
        rig.run(0.4 * (1 + 1e-12));
        EXPECT_GE(rig.times(EventKind::flank_opens, "B").size(), 3u);
        return std::vector<double>{rig.out("mass.1.speed"), rig.out("mass.2.speed"),
                                   30 * rig.out("backlash.B.twist")};
    };
    const auto truth = final_state(0.4 / 65536);
    std::vector<double> errors;
    for (const int steps : {100, 200, 400, 800}) {
        const auto now = final_state(0.4 / steps);
        double error = 0;
        for (std::size_t i = 0; i < truth.size(); ++i) error = std::max(error, std::fabs(now[i] - truth[i]));
        errors.push_back(error);
    }
    const double order = std::log2(errors.front() / errors.back()) / 3;
    EXPECT_GT(order, 2.5) << errors[0] << ' ' << errors[1] << ' ' << errors[2] << ' ' << errors[3];
}

// A load that grows with speed swings with each contact, here of ωh = 11 at 1 ms: forces that a part of the step takes by
// three samples.
TEST(Backlash, ALoadThatSwingsWithTheContactsShiftsNoInstant) {
    const auto closes = [](double h) {
        Pair pair;
        pair.j1 = 0.09, pair.j2 = 0.04, pair.stiffness = 3.4e6, pair.half_gap = 3e-6, pair.speed = 0.15;
        Description d = pair.description();
        d.sources = {source("1", constant(-20)), source("2", constant(20))};
        d.sources[0].quadratic = 0.002;
        Rig rig(d, {h, KernelKind::automatic});
        rig.run(0.2);
        return rig.times(EventKind::flank_closes, "B");
    };
    const auto coarse = closes(1e-3), fine = closes(1e-5);
    ASSERT_GE(fine.size(), 300u);
    ASSERT_EQ(coarse.size(), fine.size());
    for (std::size_t n = 0; n < fine.size(); ++n) ASSERT_NEAR(coarse[n], fine[n], 2e-8) << n;
}

// The gap of a thousandth of a step's way, and an impulse that arrives through a clutch that closes.
TEST(Backlash, MeetsClutchesGearsAndOtherGapsInOneMachine) {
    Description d;
    d.name = "rattling box";
    d.masses = {mass("engine", 1, 100), mass("input", 0.1, 80), mass("pinion", 0.02, 80),
                mass("wheel", 0.5, 40), mass("axle", 3, 40)};
    d.clutches = {clutch("C", "engine", "input", 80, 1.1)};
    d.backlashes = {{"B1", "input", "pinion", 2e5, 5, 2e-3, 0}, {"B2", "wheel", "axle", 5e4, 20, 1e-2, 0}};
    Gear gear;
    gear.name = "g", gear.a = "pinion", gear.b = "wheel", gear.ratio = 2, gear.efficiency = 0.97;
    d.gears = {gear};
    d.sources = {source("engine", sine(60, 6)), source("axle", constant(-30))};
    for (const double h : {1e-3, 1e-4}) {
        Rig rig(d, {h, KernelKind::automatic});
        while (rig.state.time() < 2 - 1e-9) {
            rig.step();
            ASSERT_LT(rig.outputs.certificate.constraint_violation, 1e-11);
            ASSERT_LT(rig.outputs.certificate.torque_residual, 1e-9);
        }
        EXPECT_EQ(rig.fall_backs, 0);
        EXPECT_EQ(rig.flags, 0);
        EXPECT_NEAR(rig.out("energy.defect"), 0, h > 5e-4 ? 0.05 : 1e-4);
        EXPECT_GE(rig.times(EventKind::flank_closes, "B1").size(), 5u);
    }
}

TEST(Backlash, DroppedOperatorsAndScratchChangeNoBit) {
    Pair pair;
    pair.damping = 3;
    Description d = pair.description();
    d.sources = {source("1", sine(20, 7))};
    Rig a(d), b(d);
    for (int i = 0; i < 800; ++i) {
        a.step();
        b.operators.drop();
        b.scratch.fill_with_nan();
        b.step();
    }
    EXPECT_TRUE(std::equal(a.state.bytes().begin(), a.state.bytes().end(), b.state.bytes().begin()));
}

// What cannot be located within the bound is made safe: a flank takes no strain that nobody worked for.
TEST(Backlash, TheNextStepRuleGivesNoEnergy) {
    Pair pair;
    pair.stiffness = 1e7;
    pair.half_gap = 1e-3;
    Description d = pair.description();
    d.transition = Transition::next_step;
    Rig rig(d);
    rig.step();
    double last = rig.out("energy.stored");
    while (rig.state.time() < 1) {
        rig.step();
        ASSERT_LE(rig.out("energy.stored"), last + 1e-9);
        last = rig.out("energy.stored");
    }
    EXPECT_NEAR(rig.out("energy.defect"), 0, 1e-7);
}

// The power of a gear that nothing joins to it turns 40 µs before the flank is reached, in the same step.
TEST(Backlash, TheNextStepRuleHeedsAFlankBehindAReversalOfPower) {
    Pair pair;
    pair.half_gap = 0.0101;
    Description alone = pair.description();
    alone.transition = Transition::next_step;
    Description beside = alone;
    beside.masses.push_back(mass("p", 1, 50));
    beside.masses.push_back(mass("q", 1, 25));
    beside.gears = {lossy_gear("G", "p", "q", 2, 0.9, 0)};
    beside.sources = {source("p", Waveform{{{.from = 0, .offset = 100, .slope = -100 / 5.01e-3}}})};
    Rig a(alone), b(beside);
    a.run(0.02);
    b.run(0.02);
    EXPECT_EQ(b.times(EventKind::drive_side, "G").size(), 1u);
    EXPECT_EQ(a.times(EventKind::flank_closes, "B"), b.times(EventKind::flank_closes, "B"));
    EXPECT_NEAR(a.times(EventKind::flank_closes, "B").at(0), 6e-3, 1e-12);
}

TEST(Backlash, ALongChainFallsBackToTheDenseEngineOrSaysWhy) {
    Description d = Pair{}.description();
    d.method = Method::ark3;
    try {
        Model::build(d);
        FAIL();
    } catch (const ModelError& error) {
        EXPECT_STREQ(error.what(),
                     "model \"gap\": method = ark3 needs a machine without loops: backlash \"B\" changes its "
                     "stiffness");
    }
    d.method = Method::automatic;
    for (int i = 3; i < 30; ++i) {
        const std::string name = std::to_string(i), before = std::to_string(i - 1);
        d.masses.push_back(mass(name, 1, 50));
        d.shafts.push_back({"s" + name, before, name, 1e3, 1, 0});
    }
    EXPECT_EQ(Model::build(d).engine(), "etd3");
}

TEST(Backlash, IsExplainedInWords) {
    Rig rig(Pair{}.description());
    rig.run(0.08);
    ASSERT_GE(rig.events.size(), 3u);
    EXPECT_EQ(explain(rig.model, rig.events[0]), "t=0.0050000 B closes its forward flank at 2.000 rad/s");
    EXPECT_EQ(explain(rig.model, rig.events[1]).substr(12), "B opens its forward flank at -2.000 rad/s");
    EXPECT_EQ(explain(rig.model, rig.events[2]).substr(12), "B closes its backward flank at -2.000 rad/s");
}

TEST(Backlash, TheModalViewHoldsItClosedUnlessToldOtherwise) {
    const Pair pair;
    EXPECT_NEAR(natural_modes(pair.description(), {}).modes.at(0).frequency, pair.omega() / (2 * pi), 1e-9);
    ModalOptions options;
    options.closed_flanks = false;
    const ModalResult open = natural_modes(pair.description(), {}, options);
    EXPECT_TRUE(open.modes.empty());
    EXPECT_EQ(open.rigid_motions, 2);
}

TEST(Backlash, StaticsGoesThroughTheClosedFlank) {
    StaticsProblem problem;
    problem.inputs = {{"1", 12}};
    problem.output = "2";
    EXPECT_NEAR(solve_statics(Pair{}.description(), problem).output_torque, -12, 1e-12);
}

std::string refusal(const std::string& line) {
    try {
        io::parse_model(
            "name: m\nmasses:\n  a: {inertia_kg_m2: 1}\n  b: {inertia_kg_m2: 1}\nbacklashes:\n  B: " + line +
                "\n",
            "m.yaml");
    } catch (const std::exception& error) {
        return error.what();
    }
    return "";
}

TEST(Backlash, IsReadFromItsStanzaOrRefusedInOneLine) {
    const auto file = io::parse_model(
        "name: m\nmasses:\n  a: {inertia_kg_m2: 1}\n  b: {inertia_kg_m2: 1}\nbacklashes:\n"
        "  B: {a: a, b: b, stiffness_nm_per_rad: 9000, damping_nm_s_per_rad: 3, gap_rad: 0.02, "
        "initial_twist_rad: -0.01}\n",
        "m.yaml");
    const Backlash& b = file.description.backlashes.at(0);
    EXPECT_EQ(b.stiffness, 9000);
    EXPECT_EQ(b.damping, 3);
    EXPECT_EQ(b.gap, 0.02);
    EXPECT_EQ(b.initial_twist, -0.01);
    EXPECT_EQ(refusal("{a: a, b: b, stiffness_nm_per_rad: 1, damping_nm_s_per_rad: 0, gap_rad: 0}"),
              "m.yaml:6:69: backlash \"B\": gap_rad = 0; must be > 0");
    EXPECT_EQ(refusal("{a: a, b: hub, stiffness_nm_per_rad: 1, damping_nm_s_per_rad: 0, gap_rad: 1}"),
              "m.yaml:6:13: backlash \"B\": b = \"hub\" is not a mass; nearest: b");
    EXPECT_EQ(refusal("{a: a, b: b, stiffness_nm_per_rad: 1, damping_nm_s_per_rad: 0, gap_deg: 1}"),
              "m.yaml:6:69: backlash \"B\": gap_deg is not a known key; nearest: gap_rad");
}

}  // namespace
}  // namespace shiftrig::plant
