// The tractor's shift under the plough against an independent statement of the same equations.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <vector>

#include "tests/plant/tractor_comparison.h"

namespace shiftrig {
namespace {

class TractorShift : public testing::TestWithParam<cases::Shift> {
  protected:
    static const ShiftTrace& truth() {
        static std::map<cases::Shift, ShiftTrace> cache;
        const auto found = cache.find(GetParam());
        if (found != cache.end()) return found->second;
        return cache.emplace(GetParam(), run_reference(cases::tractor_shift(GetParam()), 4e-5)).first->second;
    }
    static ShiftTrace plant(int steps_per_millisecond) {
        return run_plant(cases::tractor_shift(GetParam()), steps_per_millisecond);
    }
};

// Two statements of one set of equations, two methods. Reached: 1.2e-7 here, 8e-9 at 50 steps a millisecond.
TEST_P(TractorShift, ConvergesToTheReferenceSolver) {
    ASSERT_EQ(truth().fall_backs, 0);
    const TraceError e = error(plant(16), truth());
    EXPECT_LT(e.worst, 3e-7) << e.signal;
}

TEST_P(TractorShift, IsWithinFiveTenThousandthsAtOneMillisecond) {
    const TraceError e = error(plant(1), truth());
    EXPECT_LT(e.worst, 5e-4) << e.signal;
}

TEST_P(TractorShift, IsWithinATenThousandthAtHalfAMillisecond) {
    const TraceError e = error(plant(2), truth());
    EXPECT_LT(e.worst, 1e-4) << e.signal;
}

TEST_P(TractorShift, KeepsItsOrderAcrossEvents) {
    const double coarse = error(plant(1), truth()).worst, fine = error(plant(8), truth()).worst;
    EXPECT_GT(std::log2(coarse / fine) / 3, 2.5) << coarse << " → " << fine;
}

// The article's rule moves every change to the end of its step: order 1. How far before it a change lies is chance: the mean
// over machines whose clutches differ a little, and with them the instants. With good timing hardly anything jumps: a pair
// that locks late by δ is a matter of δ² (what friction does too much the join takes back), and the few per cent that
// torque falls as F2 breaks away show below that only at short steps.
TEST_P(TractorShift, NextStepRuleShowsItsOwnOrder) {
    constexpr int coarse = 2, fine = 8, machines = 40;
    double coarse_error = 0, fine_error = 0;
    for (int k = 0; k < machines; ++k) {
        const auto run = [k](int steps, plant::Transition transition) {
            return run_plant(cases::tractor_shift(GetParam()), steps, [=](plant::Description& d) {
                d.transition = transition;
                for (plant::Clutch& clutch : d.clutches)
                    if (auto* plates = std::get_if<plant::WetPlates>(&clutch.friction))
                        plates->piston_area *= 1 + 0.05 * k / machines;
            });
        };
        const ShiftTrace exact = run(16, plant::Transition::localised);
        coarse_error += error(run(coarse, plant::Transition::next_step), exact).worst / machines;
        fine_error += error(run(fine, plant::Transition::next_step), exact).worst / machines;
    }
    const double order = std::log2(coarse_error / fine_error) / 2;
    const bool jumps = GetParam() != cases::Shift::good;
    // Reached: 1.58 with good timing, 0.86 and 1.07 where torques jump; localised, it is above 2.5.
    EXPECT_GT(order, jumps ? 0.8 : 1.3) << coarse_error << " → " << fine_error;
    EXPECT_LT(order, jumps ? 1.3 : 1.9) << coarse_error << " → " << fine_error;
}

// A piston that fills: the chamber's pressure jumps where it arrives, inside a step.
TEST_P(TractorShift, KeepsItsOrderWhilePistonsFill) {
    const auto run = [&](int steps) {
        return run_plant(cases::tractor_shift(GetParam()), steps,
                         [](plant::Description& d) { cases::add_pistons(d); });
    };
    const ShiftTrace converged = run(32);
    EXPECT_GT(error(converged, truth()).worst, 1e-2) << "the fill delays F3";
    const double coarse = error(run(1), converged).worst, fine = error(run(8), converged).worst;
    EXPECT_LT(coarse, 5e-4);
    EXPECT_GT(std::log2(coarse / fine) / 3, 2.5) << coarse << " → " << fine;
}

TEST_P(TractorShift, ClosesTheLedger) {
    const ShiftTrace trace = plant(1);
    EXPECT_LT(std::abs(trace.energy_defect), 1e-6 * trace.dissipated);
    // The reference books every loss but that of the tyre's slip.
    if (GetParam() == cases::Shift::bad_coulomb) {
        EXPECT_NEAR(trace.dissipated, truth().dissipated, 1e-4 * trace.dissipated);
    }
    EXPECT_EQ(trace.fall_backs, 0);
}

INSTANTIATE_TEST_SUITE_P(UnderThePlough, TractorShift,
                         testing::Values(cases::Shift::good, cases::Shift::bad, cases::Shift::bad_coulomb),
                         [](const auto& value) {
                             return std::string(value.param == cases::Shift::good  ? "GoodTiming"
                                                : value.param == cases::Shift::bad ? "BadTiming"
                                                                                   : "WheelContactSlips");
                         });

}  // namespace
}  // namespace shiftrig
