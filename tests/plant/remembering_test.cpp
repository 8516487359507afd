// A step carries over from the one before what it need not work out again. That is a matter of speed alone: with operators
// dropped and a scratch that is not a number before every step, each state, output and event is the same to the bit.
#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <string>
#include <vector>

#include "tests/plant/random_forests.h"
#include "tests/plant/random_systems.h"
#include "tests/plant/rig.h"

namespace shiftrig::plant {
namespace {

bool same(double a, double b) {
    return std::memcmp(&a, &b, sizeof a) == 0;
}

// What differs after a step, in words; empty: nothing.
std::string difference(const Rig& kept, const Rig& forgetful) {
    for (std::size_t i = 0; i < kept.state.block.size(); ++i) {
        if (!same(kept.state.block[i], forgetful.state.block[i])) return "state " + std::to_string(i);
    }
    for (std::size_t i = 0; i < kept.outputs.value.size(); ++i) {
        const std::string& name = kept.model.outputs()[i].name;
        if (name.starts_with("certificate.mode_")) continue;  // counts what had to be found or built
        if (!same(kept.outputs.value[i], forgetful.outputs.value[i])) return name;
    }
    if (kept.outputs.event_count != forgetful.outputs.event_count) return "number of events";
    for (int i = 0; i < std::min(kept.outputs.event_count, Outputs::event_capacity); ++i) {
        const Event &a = kept.outputs.events[static_cast<std::size_t>(i)],
                    &b = forgetful.outputs.events[static_cast<std::size_t>(i)];
        if (a.kind != b.kind || a.device != b.device || !same(a.time, b.time) || !same(a.torque, b.torque) ||
            !same(a.capacity, b.capacity) || !same(a.slip, b.slip))
            return explain(kept.model, a) + " | " + explain(kept.model, b);
    }
    return {};
}

// `drive` sets the inputs of step n; both rigs get them.
void expect_the_same(const Description& d, const BuildOptions& options, int steps,
                     const std::function<void(int, Rig&)>& drive, const std::string& name) {
    Rig kept(d, options), forgetful(d, options);
    for (int n = 0; n < steps; ++n) {
        drive(n, kept);
        forgetful.inputs = kept.inputs;
        forgetful.operators.drop();
        forgetful.scratch.fill_with_nan();
        kept.step();
        forgetful.step();
        const std::string wrong = difference(kept, forgetful);
        ASSERT_EQ(wrong, "") << name << ", step " << n;
    }
}

// Nothing prescribed over time, or else no step is carried over: torques and engagements by inputs, which jump now and then.
Description by_inputs(Description d) {
    for (TorqueSource& source : d.sources) {
        source.waveform = {};
        source.input = true;
    }
    for (Clutch& clutch : d.clutches) {
        if (std::holds_alternative<ActuationDirect>(clutch.actuation)) {
            ActuationDirect direct;
            direct.initial = 1;
            clutch.actuation = direct;
        }
    }
    return d;
}

void expect_the_same_under_jumps(const Description& d, std::uint64_t seed, double step_size,
                                 const std::string& name) {
    Forest dice(seed + 4711);
    const auto jump = [&](int, Rig& rig) {
        for (std::size_t i = 0; i < rig.inputs.value.size(); ++i) {
            if (dice.below(40) != 0) continue;
            const std::string& input = rig.model.inputs()[i].name;
            if (input.ends_with(".torque")) rig.inputs.value[i] = dice.real(-60, 60);
            if (input.ends_with(".engagement"))
                rig.inputs.value[i] = dice.below(3) == 0 ? 0 : dice.real(0, 1.2);
        }
    };
    expect_the_same(by_inputs(d), {step_size, KernelKind::automatic}, 300, jump, name + std::to_string(seed));
}

// The first eighty, and those in which a part begins with a stuck mesh beyond what its loss can be.
TEST(Remembering, ForestsOnTheTreeGoOnTheSame) {
    std::vector<std::uint64_t> seeds{1550, 1551, 1789};
    for (std::uint64_t seed = 1001; seed <= 1080; ++seed) seeds.push_back(seed);
    for (const std::uint64_t seed : seeds) {
        Description d = Forest(seed).build(seed % 4 != 0);
        d.method = Method::ark3;
        expect_the_same_under_jumps(d, seed, seed % 3 == 0 ? 1e-2 : 1e-3, "forest ");
        if (HasFatalFailure()) return;
    }
}

TEST(Remembering, RandomMachinesGoOnTheSame) {
    for (std::uint64_t seed = 1; seed <= 60; ++seed) {
        const double h = seed % 3 == 0 ? 1e-2 : 1e-3;
        expect_the_same_under_jumps(random_system(seed, 0.5).description, seed, h, "system ");
        expect_the_same_under_jumps(random_system_with_freewheels(seed, 0.5).description, seed, h,
                                    "freewheels ");
        expect_the_same_under_jumps(random_system_with_backlashes(seed, 0.5).description, seed, h,
                                    "backlashes ");
        expect_the_same_under_jumps(random_system_with_friction_tables(seed, 0.5).description, seed, h,
                                    "tables ");
        if (HasFatalFailure()) return;
    }
}

// The pressure of a wet clutch without return springs dies out to nothing at the end of a step: it is let go, and its oil
// drags.
TEST(Remembering, AClutchThatNothingPressesIsLetGo) {
    for (const Method method : {Method::etd3, Method::ark3}) {
        Description d;
        d.name = "fading pressure";
        d.method = method;
        d.masses = {mass("a", 1, 100), mass("b", 1, -20)};
        Clutch c = clutch("c", "a", "b", 0);
        WetPlates plates = powershift_plates();
        plates.return_pressure = 0;
        c.friction = plates;
        ActuationHydraulic hydraulic;
        hydraulic.natural_frequency = 60;
        hydraulic.damping_ratio = 0.7;
        hydraulic.slew = 1e8;
        hydraulic.maximum_pressure = 18e5;
        c.actuation = hydraulic;
        c.drag = true;
        d.clutches = {c};
        d.oil = reference_oil();
        double state = -1;
        const auto pulse = [&](int n, Rig& rig) {
            rig.in("clutch.c.pressure_command") = n >= 100 && n < 110 ? 0.3e5 : 0;
            if (n > 0) state = rig.out("clutch.c.state");
        };
        expect_the_same(d, {}, 1500, pulse, "fading pressure");
        EXPECT_EQ(state, 2) << "free";
    }
}

}  // namespace
}  // namespace shiftrig::plant
