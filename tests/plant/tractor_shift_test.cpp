// The tractor's shift under the plough against an independent statement of the same equations.
#include <gtest/gtest.h>

#include <cmath>
#include <map>

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

TEST_P(TractorShift, KeepsItsOrderAcrossEvents) {
    const double coarse = error(plant(1), truth()).worst, fine = error(plant(8), truth()).worst;
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
