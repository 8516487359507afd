// How near the engine for long chains comes to what is so: orders, damping of swings, and long steps in parts.
#include <algorithm>
#include <cmath>

#include "rig.h"
#include "tests/plant/ark3_chain.h"
#include "tests/plant/machines.h"
#include "tests/plant/random_forests.h"

namespace shiftrig::plant {
namespace {

// A clutch whose friction falls with its slip, by up to 60 rad/s² per rad/s: what is not linear.
TEST(Ark3, IsOfThirdOrder) {
    const auto slip = [](double h) {
        Description d;
        d.name = "slipping";
        d.method = Method::ark3;
        d.masses = {mass("a", 1, 6), mass("b", 1)};
        d.clutches = {clutch("c", "a", "b", 100)};
        d.maximum_parts = 1;
        std::get<DryFriction>(d.clutches[0].friction).falling = 0.3;
        Rig rig(d, {h, KernelKind::automatic});
        rig.run(0.032);
        return rig.out("clutch.c.slip");
    };
    const double exact = slip(1e-4 / 4);
    const double coarse = std::fabs(slip(2e-3) - exact), fine = std::fabs(slip(5e-4) - exact);
    EXPECT_GT(slip(2e-3), 0.1) << "it still slips";
    EXPECT_GT(std::log2(coarse / fine) / 2, 2.7) << coarse << " → " << fine;
    EXPECT_LT(std::log2(coarse / fine) / 2, 3.3) << coarse << " → " << fine;
}

// What is linear is of order 4 where it swings: a locked chain with a strained shaft.
TEST(Ark3, SwingingShaftsAreOfFourthOrder) {
    Description d = chain(12);
    d.method = Method::ark3;
    d.maximum_parts = 1;
    d.sources.clear();
    for (Mass& m : d.masses) m.initial_speed = 0;
    for (Shaft& s : d.shafts) s.stiffness = 2000;
    d.shafts[2].initial_twist = 0.05;
    for (Clutch& c : d.clutches) {
        c.initially_locked = true;
        std::get<DryFriction>(c.friction).sliding_capacity = 1e9;
    }
    // All speeds, every 4 ms for 0.4 s.
    const auto trace = [&](int steps) {
        Rig rig(d, {4e-3 / steps, KernelKind::automatic});
        std::vector<double> speeds;
        for (int k = 0; k < 100; ++k) {
            for (int i = 0; i < steps; ++i) rig.step();
            speeds.insert(speeds.end(), rig.state.speeds().begin(), rig.state.speeds().end());
        }
        return speeds;
    };
    const std::vector<double> exact = trace(128);
    const auto worst = [&](int steps) {
        const std::vector<double> speeds = trace(steps);
        double most = 0;
        for (std::size_t i = 0; i < exact.size(); ++i) most = std::max(most, std::fabs(speeds[i] - exact[i]));
        return most;
    };
    const double coarse = worst(2), fine = worst(16);
    EXPECT_GT(std::log2(coarse / fine) / 3, 3.7) << coarse << " → " << fine;
    EXPECT_LT(std::log2(coarse / fine) / 3, 4.3) << coarse << " → " << fine;
}

// Two masses on an undamped shaft. The scheme by itself would damp the swing by the ratio 0.026 (hω)³; what is left is
// of the fifth power, and no step is so long that it would feed the swing.
TEST(Ark3, DampsASwingByTheFifthPowerOfItsTurnAndNeverFeedsIt) {
    const auto damping = [](double turn, int parts = 1) {
        const double h = 1e-3, omega = turn / h;
        Description d;
        d.name = "swing";
        d.method = Method::ark3;
        d.maximum_parts = parts;
        d.masses = {mass("a", 1, 1), mass("b", 1, -1)};
        d.shafts = {{"shaft", "a", "b", omega * omega / 2, 0, 0}};
        Rig rig(d, {h, KernelKind::automatic});
        const auto energy = [&] {
            const double a = rig.state.speeds()[0], b = rig.state.speeds()[1],
                         twist = rig.out("shaft.shaft.twist");
            return 0.5 * (a * a + b * b) + 0.25 * omega * omega * twist * twist;
        };
        const double from = energy();
        const int steps = 1000;
        for (int i = 0; i < steps; ++i) rig.step();
        EXPECT_NEAR(rig.state.speeds()[0] + rig.state.speeds()[1], 0, 1e-12 * std::max(turn, 1.));
        return std::log(from / energy()) / (2 * steps * turn);
    };
    for (const double turn : {0.05, 0.1, 0.2, 0.3})
        EXPECT_NEAR(damping(turn), 0.0185 * std::pow(turn, 5), 0.1 * 0.0185 * std::pow(turn, 5)) << turn;
    for (double turn = 1e-3; turn < 1e4; turn *= 1.5) {
        EXPECT_GT(damping(turn), -1e-15 / turn) << turn;
        EXPECT_GT(damping(turn, 16), -1e-15 / turn) << turn << " in parts";
    }
    EXPECT_LT(damping(0.3, 16), 0.01 * damping(0.3)) << "in parts";
}

// The worst difference of a speed over half a second, as a share of the largest that mass has, from the exact engine at steps
// of 1/64 of the length.
double worst_of_long_steps(Description d, double h, int parts) {
    constexpr int per_step = 64;
    d.method = Method::etd3;
    Rig exact(d, {h / per_step, KernelKind::automatic});
    d.method = Method::ark3;
    d.maximum_parts = parts;
    Rig tree(d, {h, KernelKind::automatic});
    const std::size_t n = d.masses.size();
    std::vector<double> range(n, 1), difference(n, 0);
    while (tree.state.time() < 0.5 - h / 2) {
        tree.step();
        for (int i = 0; i < per_step; ++i) exact.step();
        for (std::size_t j = 0; j < n; ++j) {
            const double speed = exact.state.speeds()[j];
            range[j] = std::max(range[j], std::fabs(speed));
            difference[j] = std::max(difference[j], std::fabs(speed - tree.state.speeds()[j]));
        }
    }
    double worst = 0;
    for (std::size_t j = 0; j < n; ++j) worst = std::max(worst, difference[j] / range[j]);
    return worst;
}

// A clutch that slips with fading friction, a shaft under strain behind it, a drag on the last mass: smooth for 0.4 s.
Rig slipping_on_a_shaft(double stiffness, Method method, double h) {
    Description d;
    d.masses = {machines::mass("a", 0.5), machines::mass("b", 1), machines::mass("c", 1.5)};
    d.masses[0].initial_speed = 100;
    d.masses[1].initial_speed = d.masses[2].initial_speed = 20;
    d.shafts = {machines::shaft("shaft", "b", "c", stiffness, 0.2)};
    d.shafts[0].initial_twist = 0.01;
    d.clutches = {machines::clutch("clutch", "a", "b")};
    DryFriction fading = machines::dry(30, 1.5);
    fading.falling = 0.4;
    fading.falling_speed = 20;
    d.clutches[0].friction = fading;
    TorqueSource drag;
    drag.name = "drag";
    drag.mass = "c";
    drag.quadratic = 1e-2;
    d.sources = {drag};
    d.method = method;
    d.maximum_parts = 1;
    Rig rig(d, {h, KernelKind::portable});
    rig.run(0.4);
    return rig;
}

TEST(Ark3, AccountClosesAtTheOrderOfTheStep) {
    const auto order = [](Method method, double h) {
        const auto defect = [&](double step) {
            return slipping_on_a_shaft(2000, method, step).out("energy.defect");
        };
        return std::log2(defect(h) / defect(h / 2));
    };
    EXPECT_NEAR(order(Method::ark3, 1e-3), 3, 0.05);
    EXPECT_NEAR(order(Method::ark3, 5e-4), 3, 0.05);
    EXPECT_NEAR(order(Method::etd3, 4e-3), 4, 0.05) << "what is booked there is what the step did";
}

// ½ k φ² = 10 J and 1000 J in the shaft at the start; its own damper takes an eighth of it in that time, the step
// what it does not see.
TEST(Ark3, AccountMissesTheSwingsThatTheStepDamps) {
    EXPECT_NEAR(slipping_on_a_shaft(2e5, Method::ark3, 1e-3).out("energy.defect"), -3.23, 0.01);
    EXPECT_LT(std::fabs(slipping_on_a_shaft(2e5, Method::etd3, 1e-3).out("energy.defect")), 1e-4);
    EXPECT_NEAR(slipping_on_a_shaft(2e7, Method::ark3, 2.5e-4).out("energy.defect"), -1000, 2);
}

// Shafts of the forests swing by up to 3 rad in 10 ms: a step of that length sees nothing of it, its parts do.
TEST(Ark3, LongStepsAreTakenInParts) {
    for (const double h : {4e-3, 1e-2}) {
        int far_off = 0;
        for (std::uint64_t seed = 1; seed <= 60; ++seed) {
            const Description d = Forest(seed + 1000).build(seed % 2 == 0);
            EXPECT_LT(worst_of_long_steps(d, h, 16), 1e-3) << "seed " << seed << ", " << h << " s";
            far_off += worst_of_long_steps(d, h, 1) > 1e-3;
        }
        EXPECT_GT(far_off, 10) << "whole, at " << h << " s";
    }
}

// What swings by rounding is no swing: a chain held by a brake, with and without a load, has come to rest.
TEST(Ark3, StepsAtRestAreNotTakenInParts) {
    for (const double stiffness : {2e4, 2e6}) {
        for (const double load : {0., 100.}) {
            Description d;
            d.name = "parked";
            d.method = Method::ark3;
            for (int j = 0; j < 6; ++j) {
                const std::string b = "m" + std::to_string(j);
                d.masses.push_back(mass(b, 1 + 0.1 * j));
                if (j > 0)
                    d.shafts.push_back(
                        {"s" + b, "m" + std::to_string(j - 1), b, stiffness, stiffness / 50, 0.003});
            }
            d.clutches = {clutch("brake", "m0", "", 1000), clutch("drag", "m5", "", 3)};
            d.clutches[0].initially_locked = true;
            d.sources = {source("m5", constant(load))};
            Rig rig(d);
            rig.run(5);
            int coarse = 0;
            for (int step = 0; step < 5000; ++step) {
                rig.step();
                coarse += (rig.outputs.certificate.flags & 8) != 0;
            }
            EXPECT_EQ(coarse, 0) << stiffness << " Nm/rad, " << load << " Nm";
        }
    }
}

// A light fan on a soft shaft behind a gear of 100: what is coarse does not depend on which mass stands for the group.
TEST(Ark3, OrderOfTheMassesDoesNotDecideWhatIsCoarse) {
    const auto coarse_steps = [](bool wheel_first) {
        Description d;
        d.name = "fan";
        d.method = Method::ark3;
        d.masses = {mass("wheel", 2000, 1), mass("fast", 1, 100), mass("light", 1e-4, 100)};
        if (!wheel_first) std::swap(d.masses[0], d.masses[2]);
        d.gears = {lossy_gear("g", "fast", "wheel", 100, 1, 0)};
        d.shafts = {{"s", "fast", "light", 20, 0.02, 0}};
        d.sources = {source("light", constant(0)), source("fast", sine(200, 3))};
        d.sources[0].quadratic = 5e-4;
        Rig rig(d, {4e-3, KernelKind::automatic});
        int coarse = 0;
        for (int step = 0; step < 100; ++step) {
            rig.step();
            coarse += (rig.outputs.certificate.flags & 8) != 0;
        }
        return coarse;
    };
    EXPECT_GT(coarse_steps(true), 0);
    EXPECT_EQ(coarse_steps(true), coarse_steps(false));
}

}  // namespace
}  // namespace shiftrig::plant
