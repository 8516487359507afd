// The engine for long chains against the dense one: the same torques and rates at an instant to rounding, the same
// motion to the order of the methods, on random forests of shafts, dampers, clutches, brakes and lossy gears.
#include <algorithm>
#include <cstdlib>
#include <numbers>

#include "rig.h"
#include "tests/plant/ark3_chain.h"
#include "tests/plant/random_forests.h"

namespace shiftrig::plant {
namespace {

Description with(Description d, Method method) {
    d.method = method;
    return d;
}

// Torques, speeds and accelerations of every device at an instant, for random sets of locked devices, tie-ups of
// several brakes on one group included.
TEST(Ark3, InternalTorquesOfEveryLockPatternAreThoseOfTheDenseEngine) {
    int compared = 0, tied = 0;
    for (std::uint64_t seed = 1; seed <= 300; ++seed) {
        Forest forest(seed);
        Description d = forest.build(true);
        if (seed % 3 == 0) add_mounts(d, seed);
        for (Clutch& c : d.clutches) c.actuation = ActuationConstant{};
        for (Clutch& c : d.clutches)
            std::get<DryFriction>(c.friction).sliding_capacity *= 1e6;  // nothing opens here
        for (Clutch& c : d.clutches) c.initially_locked = forest.below(2) == 0;
        for (Shaft& s : d.shafts) s.initial_twist = forest.real(-0.1, 0.1);
        for (Mass& m : d.masses) m.initial_speed = forest.real(-50, 50);
        for (Clutch& c : d.clutches) {
            if (!c.initially_locked) c.actuation = ActuationDirect{constant(0), 0};  // open ones stay open
        }
        Rig dense(with(d, Method::etd3)), tree(with(d, Method::ark3));
        ASSERT_EQ(tree.model.engine(), "ark3");
        observe(dense.model, dense.operators, dense.state, dense.inputs, dense.outputs, dense.scratch);
        observe(tree.model, tree.operators, tree.state, tree.inputs, tree.outputs, tree.scratch);
        double scale = 1;
        for (double value : dense.outputs.value) scale = std::max(scale, std::fabs(value));
        for (std::size_t i = 0; i < dense.outputs.value.size(); ++i) {
            const std::string& name = dense.model.outputs()[i].name;
            if (name.rfind("certificate", 0) == 0) continue;
            EXPECT_NEAR(tree.outputs.value[i], dense.outputs.value[i], 1e-9 * scale)
                << name << ", seed " << seed;
        }
        ++compared;
        tree.step();
        tied += tree.outputs.certificate.flags & 1;
    }
    EXPECT_EQ(compared, 300);
    EXPECT_GT(tied, 15) << "several brakes on one group are among them";
}

// Runs with every change of state: both engines at a step that resolves the shafts.
struct Agreement {
    int agree = 0, differ = 0;
    std::string worst;
};

// The first so many, or as many as SHIFTRIG_FORESTS says, and some more.
std::vector<int> forests(int count, const std::vector<int>& more) {
    if (const char* asked = std::getenv("SHIFTRIG_FORESTS")) count = std::atoi(asked);
    std::vector<int> seeds;
    for (int seed = 1; seed <= count; ++seed) seeds.push_back(seed);
    for (const int seed : more) {
        if (seed > count) seeds.push_back(seed);
    }
    return seeds;
}

template <typename Build>
void compare_runs(const Build& build, const std::vector<int>& seeds, double tolerance, Agreement& result) {
    for (const int seed : seeds) {
        Forest forest(static_cast<std::uint64_t>(seed) + 1000);
        const Description d = build(forest);
        const BuildOptions options{1e-4, KernelKind::automatic};
        Rig dense(with(d, Method::etd3), options), tree(with(d, Method::ark3), options);
        const std::size_t n = d.masses.size();
        std::vector<double> range(n, 1), difference(n, 0);
        for (int step = 0; step < 5000; ++step) {
            dense.step();
            tree.step();
            for (std::size_t j = 0; j < n; ++j) {
                range[j] = std::max(range[j], std::fabs(dense.state.speeds()[j]));
                difference[j] =
                    std::max(difference[j], std::fabs(dense.state.speeds()[j] - tree.state.speeds()[j]));
            }
            ASSERT_EQ(tree.outputs.certificate.flags & 4, 0);
            ASSERT_LT(tree.outputs.certificate.constraint_violation, 1e-11);
        }
        double worst = 0;
        for (std::size_t j = 0; j < n; ++j) worst = std::max(worst, difference[j] / range[j]);
        ++(worst < tolerance ? result.agree : result.differ);
        if (worst >= tolerance)
            result.worst += " seed " + std::to_string(seed) + ": " + std::to_string(worst);
        const double defect =
            std::fabs(tree.out("energy.defect")) / (1 + std::fabs(tree.out("energy.dissipated")));
        EXPECT_LT(defect, 1e-5) << "seed " << seed;
    }
}

TEST(Ark3, RunsOfRandomForestsAgreeWithTheDenseEngine) {
    Agreement result;
    compare_runs([](Forest& forest) { return forest.build(false); }, forests(100, {507}), 1e-5, result);
    EXPECT_EQ(result.differ, 0) << result.worst;
}

TEST(Ark3, RunsOfForestsOnSpringsToTheHousingAgreeWithTheDenseEngine) {
    Agreement result;
    const auto mounted = [](Forest& forest) {
        Description d = forest.build(true);
        add_mounts(d, forest.random());
        return d;
    };
    compare_runs(mounted, forests(100, {}), 1e-4, result);
    EXPECT_EQ(result.differ, 0) << result.worst;
}

// Behind the first hundred: those in which trains at rest have to share out their loads anew. In most a mesh takes part
// of what is too much for a brake; in 194, 222, 388 and 507 pairs and meshes hand it on to one another; in 777 no
// loss directions agree with some of the splits. Not 477: there a brake at its limit may let go, or another one at rest beside
// it push the other way; mechanics leaves that open, and which of both the engines find is a matter of rounding. Nor 571, whose gears
// lose up to 0.39 of what passes: there the reference itself moves by more than the tolerance where it is perturbed by 1e-9.
TEST(Ark3, RunsWithLossyGearsAgreeWithTheDenseEngine) {
    Agreement result;
    compare_runs([](Forest& forest) { return forest.build(true); },
                 forests(100, {114, 125, 170, 194, 216, 222, 388, 418, 433, 507, 516, 543, 777}), 1e-4,
                 result);
    EXPECT_EQ(result.differ, 0) << result.worst;
}

// A train of gears before a brake of 10 Nm, under a torque T = 20 sin 2πt: what its meshes lose at most, 10 %, 20 % …, the brake
// need not hold. It gives way at T ∏η = 10.
TEST(Ark3, BrakeBehindATrainHoldsWhatItsMeshesLeave) {
    for (const int gears : {1, 2, 3}) {
        Description d;
        d.name = "train";
        d.masses = {mass("m0", 1)};
        double left = 1;
        for (int j = 1; j <= gears; ++j) {
            const std::string a = "m" + std::to_string(j - 1), b = "m" + std::to_string(j);
            d.masses.push_back(mass(b, 1));
            d.gears.push_back(lossy_gear("g" + b, a, b, j % 2 == 0 ? -1 : 1, 1 - 0.1 * j, 0));
            left *= 1 - 0.1 * j;
        }
        d.clutches = {clutch("brake", d.masses.back().name, "", 10)};
        d.clutches[0].initially_locked = true;
        d.sources = {source("m0", sine(20, 1))};
        for (const Method method : {Method::etd3, Method::ark3}) {
            Rig rig(with(d, method));
            rig.run(0.24);
            const std::vector<double> opened = rig.times(EventKind::break_away, "brake");
            ASSERT_EQ(opened.size(), 1u) << gears << ' ' << rig.model.engine();
            const double due = std::asin(10 / left / 20) / (2 * std::numbers::pi);
            EXPECT_NEAR(opened[0], due, 1e-6) << gears << ' ' << rig.model.engine();
            // From there on T ∏η − 10 drives the masses, each by way of the meshes between it and the brake.
            double inertia = 1, share = 1;
            for (int j = gears; j > 0; --j) inertia += share *= 1 - 0.1 * j;
            const double turn = 2 * std::numbers::pi, t = rig.state.time();
            const double impulse =
                20 * left / turn * (std::cos(turn * due) - std::cos(turn * t)) - 10 * (t - due);
            EXPECT_NEAR(rig.state.speeds()[0], impulse / inertia, 1e-7) << gears << ' ' << rig.model.engine();
        }
    }
}

// Engine lag and boost, tyre slip, resistances and a converted wheel: what goes with the explicit table.
TEST(Ark3, VehicleWithEngineAndTyreAgreesWithTheDenseEngine) {
    Description d;
    d.name = "vehicle";
    d.masses = {mass("engine", 2.6, 150), mass("disc", 0.2, 0), mass("input", 0.3, 0), mass("axle", 5, 0),
                mass("wheels", 550, 0)};
    Mass body = mass("vehicle", 14000, 0);
    body.motion = Motion::translating;
    d.masses.push_back(body);
    d.clutches = {clutch("Fc", "engine", "disc", 1200, 1.15, ActuationDirect{sine(1, 0.25), 0})};
    d.shafts = {{"damper", "disc", "input", 12000, 15, 0}, {"half", "axle", "wheels", 2.8e6, 8000, 0}};
    d.gears = {lossy_gear("final", "input", "axle", 80, 0.9, 2)};
    BrixiusTyre tyre;
    tyre.name = "tyre";
    tyre.wheel = "wheels";
    tyre.body = "vehicle";
    tyre.radius = 0.935;
    tyre.mobility_number = 55;
    tyre.relaxation_length = 0.6;
    tyre.slip_damping_time = 0.05;
    tyre.weight = 137293;
    tyre.rolling_coefficient = 0.04;
    d.tyres = {tyre};
    Engine engine;
    engine.name = "diesel";
    engine.mass = "engine";
    engine.full_load = {{70, 550}, {150, 1150}, {200, 1000}, {230, 700}};
    engine.governor_slope = 187;
    engine.low_idle = 94;
    engine.high_idle = 229;
    engine.friction_constant = 70;
    engine.actuator_lag = 0.04;
    engine.turbo_instant_fraction = 0.62;
    engine.turbo_lag = 0.5;
    engine.fade_from = 70;
    engine.fade_to = 50;
    engine.stall_speed = 40;
    d.engines = {engine};
    Road road;
    road.name = "road";
    road.body = "vehicle";
    road.mass = 14000;
    road.air_coefficient = 2.8;
    d.roads = {road};
    Plough plough;
    plough.name = "plough";
    plough.body = "vehicle";
    plough.soil_factor = 0.5;
    plough.a = 652;
    plough.c = 5.1;
    plough.width = 1;
    plough.depth = 0.2;
    d.ploughs = {plough};

    const BuildOptions options{1e-4, KernelKind::automatic};
    Rig dense(with(d, Method::etd3), options), tree(with(d, Method::ark3), options);
    for (Rig* rig : {&dense, &tree}) {
        rig->in("driver.throttle") = 0.6;
        rig->in("environment.draft") = 1;
    }
    double worst = 0;
    for (int step = 0; step < 20000; ++step) {
        dense.step();
        tree.step();
        for (const char* name :
             {"mass.engine.speed", "mass.input.speed", "mass.wheels.speed", "mass.vehicle.speed"}) {
            worst = std::max(worst, std::fabs(dense.out(name) - tree.out(name)));
        }
    }
    EXPECT_GT(tree.out("mass.vehicle.speed"), 1) << "it drove off";
    EXPECT_GT(tree.out("energy.input"), 1e4);
    EXPECT_LT(worst, 1e-3);
    EXPECT_NEAR(tree.out("body.vehicle.acceleration"), dense.out("body.vehicle.acceleration"), 1e-3);
    EXPECT_LT(std::fabs(tree.out("energy.defect")), 1e-6 * tree.out("energy.input"));
}

// ---- the choice of engine ---------------------------------------------------------------------------------

TEST(Ark3, IsChosenForLongChainsAndRefusedForLoops) {
    EXPECT_EQ(Model::build(chain(10)).engine(), "etd3");
    EXPECT_EQ(Model::build(chain(10)).engine_reason(), "18 speeds and twists");
    EXPECT_EQ(Model::build(chain(60)).engine(), "ark3");
    EXPECT_EQ(Model::build(chain(60)).engine_reason(), "108 speeds and twists, a tree");
    Description d = chain(60);
    d.method = Method::etd3;
    EXPECT_EQ(Model::build(d).engine(), "etd3");
    EXPECT_EQ(Model::build(d).engine_reason(), "as the model asks");
    d.method = Method::automatic;
    d.shafts.push_back({"mount", "m20", "", 1e5, 10, 0});
    EXPECT_EQ(Model::build(d).engine(), "ark3");
    d.clutches.push_back(clutch("loop", "m3", "m40", 100));
    EXPECT_EQ(Model::build(d).engine(), "etd3") << "a loop needs the dense engine";
    EXPECT_EQ(Model::build(d).engine_reason(),
              "109 speeds and twists would take ark3, but \"sm39\" closes a loop");
    d.method = Method::ark3;
    try {
        Model::build(d);
        FAIL();
    } catch (const ModelError& error) {
        EXPECT_STREQ(error.what(),
                     "model \"chain\": method = ark3 needs a machine without loops: \"sm39\" closes a loop");
    }
}

// Nothing acts on the chain from outside. Rounding in the solutions speeds it up by 6e-17 a step; a stage that weighed speeds by
// numbers whose sum is not exactly 1 adds more than that.
TEST(Ark3, MomentumOfAFreeChainStaysWhatItWas) {
    Description d = chain(60);
    d.sources.clear();
    for (std::size_t e = 0; e < d.shafts.size(); ++e) d.shafts[e].initial_twist = e % 3 == 0 ? 0.01 : -0.004;
    Rig rig(d);
    ASSERT_EQ(rig.model.engine(), "ark3");
    const auto momentum = [&] {
        double sum = 0;
        for (std::size_t j = 0; j < d.masses.size(); ++j) sum += d.masses[j].inertia * rig.state.speeds()[j];
        return sum;
    };
    rig.step();
    const double before = momentum();
    for (int n = 0; n < 200000; ++n) rig.step();
    EXPECT_NEAR(momentum() / before, 1, 2e-11);
}

}  // namespace
}  // namespace shiftrig::plant
