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

// The article's rule moves every change to the end of its step: order 1, and a hundred times the error.
TEST_P(TractorShift, NextStepRuleShowsItsOwnOrder) {
    const auto next_step = [](plant::Description& d) { d.transition = plant::Transition::next_step; };
    // How far before its step's end a change lies is chance: a line through several steps, not two points.
    double x = 0, y = 0, xx = 0, xy = 0;
    const std::vector<int> steps = {1, 2, 4, 8, 16};
    for (const int n : steps) {
        const double log_h = -std::log2(n);
        const double log_error =
            std::log2(error(run_plant(cases::tractor_shift(GetParam()), n, next_step), truth()).worst);
        x += log_h;
        y += log_error;
        xx += log_h * log_h;
        xy += log_h * log_error;
    }
    const auto count = static_cast<double>(steps.size());
    const double order = (count * xy - x * y) / (count * xx - x * x);
    EXPECT_GT(order, 0.6);
    EXPECT_LT(order, 2.0);  // 1.0 to 1.6: chance again; localised, it is above 2.5
}

// A piston that fills: the chamber's pressure jumps where it arrives, inside a step.
TEST_P(TractorShift, KeepsItsOrderWhilePistonsFill) {
    const auto with_pistons = [](plant::Description& d) {
        for (plant::Clutch& clutch : d.clutches) {
            auto* valve = std::get_if<plant::ActuationHydraulic>(&clutch.actuation);
            if (valve == nullptr) continue;
            valve->preload_pressure = 0.8e5;
            valve->stroke = 2e-3;
            valve->fill_volume = 30e-6;
            valve->fill_flow = 20e-3 / 60;
        }
    };
    const auto run = [&](int steps) {
        return run_plant(cases::tractor_shift(GetParam()), steps, with_pistons);
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
