// One-way clutches: closed forms of their changes of state, complementarity at every step, momentum and energy.
#include <algorithm>
#include <functional>
#include <numbers>

#include "io/model_file.h"
#include "plant/modal.h"
#include "plant/statics.h"
#include "tests/plant/rig.h"

namespace shiftrig::plant {
namespace {

constexpr double pi = std::numbers::pi;

Freewheel freewheel(const std::string& name, const std::string& a, const std::string& b, double rated,
                    double drag = 0, Sense blocks = Sense::forward, double sliding_share = 0.8) {
    return {name, a, b, blocks, rated, sliding_share, drag};
}

double bisect(double low, double high, const std::function<double(double)>& f) {
    const bool rising = f(high) > 0;
    for (int i = 0; i < 200; ++i) {
        const double middle = 0.5 * (low + high);
        ((f(middle) > 0) == rising ? high : low) = middle;
    }
    return 0.5 * (low + high);
}

struct Case {
    double h;
    Method method;
};
class EachEngineAndStep : public ::testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(Steps, EachEngineAndStep,
                         ::testing::Values(Case{1e-3, Method::etd3}, Case{1e-4, Method::etd3},
                                           Case{1e-3, Method::ark3}, Case{1e-4, Method::ark3}),
                         [](const auto& test) {
                             return std::string(test.param.method == Method::etd3 ? "etd3_" : "ark3_") +
                                    (test.param.h > 5e-4 ? "1ms" : "100us");
                         });

// An alternating torque T sin Ωt on mass 1, a resistance c on mass 2, a freewheel that lets 1 not run ahead of 2. Locked,
// M = (J2 T sin Ωt + J1 c)/(J1 + J2) (eq. (10) of [Algin] with M2 = −c) reaches 0 at t1; from then on both go alone,
// until 1 has caught up with 2 at t2.
struct Alternating {
    static constexpr double j1 = 0.5, j2 = 2, torque = 40, resistance = 6, frequency = 5,
                            omega = 2 * pi * frequency;
    double t1, t2, joint1, joint2;

    static double impulse(double from, double to) {  // of the torque on 1
        return torque / omega * (std::cos(omega * from) - std::cos(omega * to));
    }
    Alternating() {
        t1 = (pi + std::asin(j1 * resistance / (j2 * torque))) / omega;
        joint1 = 20 + (impulse(0, t1) - resistance * t1) / (j1 + j2);
        const auto slip = [&](double t) { return impulse(t1, t) / j1 + resistance * (t - t1) / j2; };
        t2 = bisect(t1 + 0.5 / frequency, t1 + 1 / frequency, slip);
        joint2 = joint1 - resistance * (t2 - t1) / j2;
    }
    static Description description(Method method = Method::etd3) {
        Description d;
        d.name = "alternating";
        d.masses = {mass("1", j1, 20), mass("2", j2, 20)};
        d.freewheels = {freewheel("F", "1", "2", 500)};
        d.sources = {source("1", sine(torque, frequency)), source("2", constant(-resistance))};
        d.method = method;
        return d;
    }
};

TEST_P(EachEngineAndStep, AlternatingTorqueSwitchesWhenTheClosedFormSays) {
    const Alternating exact;
    const double h = GetParam().h;
    Rig rig(Alternating::description(GetParam().method), {h, KernelKind::automatic});
    rig.run(0.35);
    const auto locks = rig.times(EventKind::lock, "F"), opens = rig.times(EventKind::break_away, "F");
    ASSERT_EQ(locks.size(), 2u);  // at the start as well
    ASSERT_EQ(opens.size(), 2u);
    // Letting go is found to 1e-3 of the step's torque, locking to 1e-5 of its slip; a quadratic part of the margin adds
    // (Ωh)² of a step at most. An error δ in letting go moves the speeds by Ṁ δ²/2J only.
    const double curved = std::pow(Alternating::omega * h, 2);
    EXPECT_NEAR(opens[0], exact.t1, h * (1e-3 + curved));
    EXPECT_NEAR(locks[1], exact.t2, h * (1e-4 + curved));
    // The joint speed at locking shows between t2 and the next letting go.
    Rig again(Alternating::description(GetParam().method), {h, KernelKind::automatic});
    again.run(0.3);
    ASSERT_LT(exact.t2, 0.3);
    const double joint =
        exact.joint2 + (Alternating::impulse(exact.t2, 0.3) - Alternating::resistance * (0.3 - exact.t2)) /
                           (Alternating::j1 + Alternating::j2);
    // Quadrature of the sine by Simpson is of order 4 with constant 1/2880 a step.
    EXPECT_NEAR(again.out("mass.1.speed"), joint, 2e-11 + 3e3 * std::pow(h, 4));
    EXPECT_EQ(again.out("freewheel.F.state"), 0);
    EXPECT_EQ(again.fall_backs, 0);
}

TEST_P(EachEngineAndStep, MomentumIsConservedByEveryLockingAndLettingGo) {
    const double h = GetParam().h;
    Rig rig(Alternating::description(GetParam().method), {h, KernelKind::automatic});
    for (int period = 1; period <= 5; ++period) {
        const double t = period / Alternating::frequency;
        rig.run(t);
        const double momentum =
            Alternating::j1 * rig.out("mass.1.speed") + Alternating::j2 * rig.out("mass.2.speed");
        const double exact = 20 * (Alternating::j1 + Alternating::j2) - Alternating::resistance * t;
        // Whole periods of the sine add nothing, and Simpson's error over them neither but where events cut a step.
        EXPECT_NEAR(momentum, exact, 1e-10 + 3e3 * std::pow(h, 4)) << period;
    }
}

TEST_P(EachEngineAndStep, ItNeverPullsAndNeverRunsAheadAndItsAccountCloses) {
    const double h = GetParam().h;
    Description d = Alternating::description(GetParam().method);
    d.freewheels[0].drag_torque = 1.5;
    Rig rig(d, {h, KernelKind::automatic});
    while (rig.state.time() < 1 - 1e-9) {
        rig.step();
        const double state = rig.out("freewheel.F.state"), slip = rig.out("freewheel.F.slip"),
                     torque = rig.out("freewheel.F.torque");
        if (state == 0) {
            ASSERT_LT(std::fabs(slip), 1e-12);
            ASSERT_GE(torque, -1.5 * (1 + 1e-8));
            ASSERT_LE(torque, 500);
        } else {
            ASSERT_EQ(state, 2);
            ASSERT_LE(slip, 1e-12);
            ASSERT_EQ(torque, -1.5);
        }
        ASSERT_LT(rig.outputs.certificate.constraint_violation, 1e-12);
    }
    EXPECT_GT(rig.out("freewheel.F.heat"), 1);
    EXPECT_NEAR(rig.out("energy.dissipated"), rig.out("freewheel.F.heat"), 1e-9);
    EXPECT_NEAR(rig.out("energy.defect"), 0,
                1e-9 + 6e4 * std::pow(h, 3));  // Simpson of drag and torque, cut by events
    EXPECT_EQ(rig.fall_backs, 0);
}

// Error of both speeds at 0.37 s, across four changes of state.
TEST(Freewheel, TheOrderAcrossItsChangesIsThatOfTheMethod) {
    const auto final_speeds = [](double h) {
        Description d = Alternating::description();
        d.sources[0].quadratic = 0.02;  // so that a step is not exact anyway
        d.freewheels[0].drag_torque = 2;
        d.maximum_parts = 1;
        Rig rig(d, {h, KernelKind::automatic});
        rig.run(0.37 * (1 + 1e-12));
        return std::pair{rig.out("mass.1.speed"), rig.out("mass.2.speed")};
    };
    const auto [a, b] = final_speeds(0.37 / 65536);
    std::vector<double> errors;
    for (const int steps : {64, 128, 256, 512}) {
        const auto [x, y] = final_speeds(0.37 / steps);
        errors.push_back(std::max(std::fabs(x - a), std::fabs(y - b)));
    }
    const double order = std::log2(errors.front() / errors.back()) / 3;
    EXPECT_GT(order, 2.5) << errors[0] << ' ' << errors[1] << ' ' << errors[2] << ' ' << errors[3];
}

// T on a drum that a sprag keeps from falling back: held up to the rated torque, let go in the other sense, and beyond
// the rated torque it slips with its share.
TEST_P(EachEngineAndStep, ASpragHoldsALoadOnOneSideAndSlipsBeyondItsRating) {
    Description d;
    d.name = "hoist";
    d.masses = {mass("drum", 3)};
    d.freewheels = {freewheel("S", "drum", "", 100, 0, Sense::backward, 0.75)};
    TorqueSource load = source("drum", constant(-60));
    load.input = true;
    d.sources = {load};
    d.method = GetParam().method;
    const double h = GetParam().h;
    Rig rig(d, {h, KernelKind::automatic});
    rig.run(1);
    EXPECT_EQ(rig.out("mass.drum.speed"), 0);
    EXPECT_NEAR(rig.out("freewheel.S.torque"), -60, 1e-12);
    EXPECT_EQ(rig.out("freewheel.S.state"), 0);

    rig.in("source.drum_torque.torque") = 90;  // 30 Nm upwards
    rig.run(1.5);
    EXPECT_NEAR(rig.out("mass.drum.speed"), 30. / 3 * 0.5, 1e-11);
    EXPECT_EQ(rig.out("freewheel.S.state"), 2);
    EXPECT_EQ(rig.out("freewheel.S.torque"), 0);

    rig.in("source.drum_torque.torque") = 0;  // −60 Nm: at rest after 5/20 s
    rig.run(2);
    EXPECT_EQ(rig.out("mass.drum.speed"), 0);
    EXPECT_NEAR(rig.times(EventKind::lock, "S").back(), 1.75, 1e-4 * h);

    rig.in("source.drum_torque.torque") = -60;  // −120 Nm beyond 100: it slips with 75
    rig.run(2.1);
    EXPECT_NEAR(rig.out("mass.drum.speed"), -45. / 3 * 0.1, 1e-11);
    EXPECT_EQ(rig.out("freewheel.S.state"), 1);
    EXPECT_NEAR(rig.out("freewheel.S.torque"), -75, 1e-12);
    rig.in("source.drum_torque.torque") = 0;  // −60 Nm: 15 Nm slow it down, at rest after 0.3 s
    rig.run(3);
    EXPECT_EQ(rig.out("mass.drum.speed"), 0);
    EXPECT_NEAR(rig.times(EventKind::lock, "S").back(), 2.4, 1e-4 * h);
    EXPECT_NEAR(rig.out("freewheel.S.heat"), 75 * (0.5 * 1.5 * 0.1 + 0.5 * 1.5 * 0.3), 1e-9);
}

TEST_P(EachEngineAndStep, DragStopsWhatNothingDrivesAndHoldsItUpToTheDrag) {
    Description d;
    d.name = "coasting";
    d.masses = {mass("rotor", 2, -9)};
    d.freewheels = {freewheel("F", "rotor", "", 50, 6)};  // blocks forward: −9 rad/s is free
    TorqueSource push = source("rotor", constant(0));
    push.input = true;
    d.sources = {push};
    d.method = GetParam().method;
    Rig rig(d, {GetParam().h, KernelKind::automatic});
    rig.run(4);
    EXPECT_EQ(rig.out("mass.rotor.speed"), 0);
    EXPECT_NEAR(rig.times(EventKind::lock, "F").at(0), 3, 1e-4 * GetParam().h);
    EXPECT_NEAR(rig.out("freewheel.F.heat"), 0.5 * 2 * 81, 1e-9);
    rig.in("source.rotor_torque.torque") = -5.9;
    rig.run(4.5);
    EXPECT_EQ(rig.out("mass.rotor.speed"), 0);
    rig.in("source.rotor_torque.torque") = -8;
    rig.run(5.5);
    EXPECT_NEAR(rig.out("mass.rotor.speed"), -1, 1e-11);
}

// Two freewheels in opposite senses, one to the output and one to the housing: what swings becomes what turns.
TEST_P(EachEngineAndStep, APairOfThemRectifiesASwing) {
    Description d;
    d.name = "ratchet drive";
    d.masses = {mass("rocker", 0.2), mass("wheel", 1)};
    d.freewheels = {freewheel("drive", "rocker", "wheel", 200),
                    freewheel("hold", "wheel", "", 200, 0, Sense::backward)};
    d.sources = {source("rocker", sine(30, 4)), source("wheel", constant(-3))};
    d.method = GetParam().method;
    Rig rig(d, {GetParam().h, KernelKind::automatic});
    double last = 0;
    while (rig.state.time() < 3 - 1e-9) {
        rig.step();
        ASSERT_GE(rig.out("mass.wheel.speed"), -1e-12);
        ASSERT_LE(rig.out("freewheel.drive.slip"), 1e-12);
        ASSERT_GE(rig.out("freewheel.drive.torque"), -1e-9);
        ASSERT_LE(rig.out("freewheel.hold.torque"), 1e-9);
        last = std::max(last, rig.out("mass.wheel.speed"));
    }
    EXPECT_GT(last, 1);
    EXPECT_EQ(rig.fall_backs, 0);
    EXPECT_NEAR(rig.out("energy.defect"), 0, 1e-9 + 6e4 * std::pow(GetParam().h, 3));
}

// A freewheel beside a worm gear of poor efficiency.
TEST(Freewheel, BesideALossyMeshItNeitherPullsNorHangs) {
    Description d;
    d.name = "worm and sprag";
    d.masses = {mass("worm", 0.1, 5), mass("wheel", 1, 0.25)};
    Gear worm;
    worm.name = "worm gear", worm.a = "worm", worm.b = "wheel", worm.ratio = 20, worm.efficiency = 0.4;
    d.gears = {worm};
    d.freewheels = {freewheel("S", "worm", "", 40, 0, Sense::backward)};
    d.sources = {source("worm", sine(4, 2)), source("wheel", constant(-20))};
    Rig rig(d);
    while (rig.state.time() < 2 - 1e-9) {
        rig.step();
        ASSERT_LE(rig.out("freewheel.S.torque"), 1e-9);
        ASSERT_GE(rig.out("mass.worm.speed"), -1e-12);
    }
    EXPECT_EQ(rig.fall_backs, 0);
    EXPECT_EQ(rig.flags & 6, 0);
}

TEST(Freewheel, DroppedOperatorsAndScratchChangeNoBit) {
    Description d = Alternating::description();
    Rig a(d), b(d);
    for (int i = 0; i < 500; ++i) {
        a.step();
        b.operators.drop();
        b.scratch.fill_with_nan();
        b.step();
    }
    EXPECT_TRUE(std::equal(a.state.bytes().begin(), a.state.bytes().end(), b.state.bytes().begin()));
}

TEST(Freewheel, IsExplainedInWords) {
    Rig rig(Alternating::description());
    rig.run(0.35);
    std::vector<std::string> lines;
    for (const Event& event : rig.events) lines.push_back(explain(rig.model, event));
    ASSERT_EQ(lines.size(), 4u);
    EXPECT_NE(lines[0].find("F locks: slip 0, torque 1.2 of 500.0 Nm rated"), std::string::npos) << lines[0];
    EXPECT_NE(lines[1].find("F overruns: torque fell to"), std::string::npos) << lines[1];
    EXPECT_NE(lines[2].find("F locks: slip"), std::string::npos) << lines[2];
}

// 10 Nm through a freewheel and 40 Nm beside it on a brake of 60 Nm, of which 20 are left: the second mass runs away with 20 rad/s²,
// the first one follows with 10.
TEST(Freewheel, OneThatIsLetGoUnderLoadIsSaidToHaveBeenLoaded) {
    Description d;
    d.masses = {mass("drive", 1), mass("driven", 1)};
    d.freewheels = {freewheel("F", "drive", "driven", 500)};
    Waveform fails = constant(1, -1e300, 0.05);
    fails.pieces.push_back({.from = 0.05, .offset = 1. / 3});
    d.clutches = {held("B", "driven", "", 60, 1, ActuationDirect{.profile = fails})};
    d.sources = {source("drive", constant(10)), source("driven", constant(40))};
    Rig rig(d);
    rig.run(0.1);
    ASSERT_FALSE(rig.events.empty());
    EXPECT_EQ(explain(rig.model, rig.events.back()),
              "t=0.0500000 F overruns: torque was 10.0 Nm, it passes on none beyond a drag of 0.0");
}

// On a sprag of 100 Nm, of which 70 are left beyond it: no slip, or one that turns, says by itself which way it goes.
TEST(Freewheel, WhichWayItGoesIsToldAtNoSlipToo) {
    const auto told = [](Sense blocks, double speed, Waveform torque, double until) {
        Description d;
        d.masses = {mass("a", 1, speed)};
        d.freewheels = {freewheel("F", "a", "", 100, 0.3, blocks, 0.7)};
        d.sources = {source("a", std::move(torque))};
        Rig rig(d);
        rig.run(until);
        std::vector<std::string> lines;
        for (const Event& event : rig.events) lines.push_back(explain(rig.model, event));
        return lines;
    };
    EXPECT_EQ(told(Sense::backward, 0, constant(10), 0.1),
              (std::vector<std::string>{"t=0.0000000 F begins overrunning: slip 0.000 rad/s"}));
    EXPECT_EQ(told(Sense::forward, -5, constant(120), 0.1).back(),
              "t=0.0415628 F slips overloaded: its slip turns, torque 70.0 of 70.0 Nm sliding");
    Waveform turns = constant(150, -1e300, 0.5);
    turns.pieces.push_back({.from = 0.5, .offset = -200});
    EXPECT_EQ(told(Sense::forward, 0, turns, 0.7).back(),
              "t=0.6481481 F overruns: its slip turns, drag -0.3 of 0.3 Nm");
}

TEST(Freewheel, StaticsKnowsWhichWayItPasses) {
    Description d = Alternating::description();
    StaticsProblem problem;
    problem.closed = {"F"};
    problem.inputs = {{"1", 40}};
    problem.output = "2";
    EXPECT_NEAR(solve_statics(d, problem).output_torque, -40, 1e-12);
    const auto refusal = [&](double torque) -> std::string {
        problem.inputs = {{"1", torque}};
        try {
            solve_statics(d, problem);
        } catch (const ModelError& error) {
            return error.what();
        }
        return "";
    };
    EXPECT_EQ(
        refusal(-40),
        "statics \"alternating\": closed = F: freewheel \"F\" would have to pass on -40 Nm: it overruns");
    EXPECT_EQ(refusal(501),
              "statics \"alternating\": closed = F: freewheel \"F\" would have to pass on 501 Nm: it slips "
              "overloaded");
}

TEST(Freewheel, IsRigidInTheModalViewWhereItIsLocked) {
    Description d;
    d.name = "two shafts";
    d.masses = {mass("a", 1), mass("b", 1), mass("c", 1)};
    d.shafts = {{"s", "b", "c", 1000, 0, 0}};
    d.freewheels = {freewheel("F", "a", "b", 100)};
    EXPECT_NEAR(natural_modes(d, {}).modes.at(0).frequency, std::sqrt(1000 * 2.) / (2 * pi), 1e-9);
    EXPECT_NEAR(natural_modes(d, {"F"}).modes.at(0).frequency, std::sqrt(1000 * 1.5) / (2 * pi), 1e-9);
}

std::string refusal(const std::string& line) {
    try {
        io::parse_model(
            "name: m\nmasses:\n  a: {inertia_kg_m2: 1}\n  b: {inertia_kg_m2: 1}\nfreewheels:\n  F: " + line +
                "\n",
            "m.yaml");
    } catch (const std::exception& error) {
        return error.what();
    }
    return "";
}

TEST(Freewheel, IsReadFromItsStanzaOrRefusedInOneLine) {
    const auto file = io::parse_model(
        "name: m\nmasses:\n  a: {inertia_kg_m2: 1}\nfreewheels:\n"
        "  F: {a: a, b: housing, blocks: backward, rated_torque_nm: 90, sliding_share: 0.6, drag_torque_nm: "
        "2}\n",
        "m.yaml");
    const Freewheel& f = file.description.freewheels.at(0);
    EXPECT_EQ(f.b, "");
    EXPECT_EQ(f.blocks, Sense::backward);
    EXPECT_EQ(f.rated_torque, 90);
    EXPECT_EQ(f.sliding_share, 0.6);
    EXPECT_EQ(f.drag_torque, 2);
    EXPECT_EQ(refusal("{a: a, b: b, rated_torque_nm: 0, sliding_share: 1}"),
              "m.yaml:6:19: freewheel \"F\": rated_torque_nm = 0; must be > 0");
    EXPECT_EQ(refusal("{a: a, b: b, rated_torque_nm: 10, sliding_share: 1.5}"),
              "m.yaml:6:40: freewheel \"F\": sliding_share = 1.5; must be > 0 and at most 1");
    EXPECT_EQ(refusal("{a: a, b: a, rated_torque_nm: 10, sliding_share: 1}"),
              "m.yaml:6:13: freewheel \"F\": b = a; both links end on the same mass");
    EXPECT_EQ(refusal("{a: a, b: c, rated_torque_nm: 10, sliding_share: 1}"),
              "m.yaml:6:13: freewheel \"F\": b = \"c\" is not a mass; nearest: a");
    EXPECT_EQ(refusal("{a: a, b: b, blocks: left, rated_torque_nm: 10, sliding_share: 1}"),
              "m.yaml:6:19: freewheel \"F\": blocks = left; must be one of forward, backward");
}

}  // namespace
}  // namespace shiftrig::plant
