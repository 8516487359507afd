#include "analysis/filter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

namespace shiftrig::analysis {
namespace {

constexpr double pi = std::numbers::pi;

std::vector<double> sine(double frequency, double interval, std::size_t count) {
    std::vector<double> x(count);
    for (std::size_t i = 0; i < count; ++i)
        x[i] = std::sin(2 * pi * frequency * static_cast<double>(i) * interval);
    return x;
}

// Forward and backward: the sine comes out in phase, its amplitude times 1/(1 + (f/f_c)⁴), frequencies as the
// bilinear transform warps them.
TEST(LowPass, HasTheButterworthGainSquaredAndNoPhase) {
    const double interval = 1e-3, cut = 10;
    for (const double frequency : {1.0, 5.0, 10.0, 20.0, 40.0}) {
        const std::vector<double> x = sine(frequency, interval, 4001);
        const std::vector<double> y = low_pass(x, interval, cut);
        const double ratio = std::tan(pi * frequency * interval) / std::tan(pi * cut * interval);
        const double gain = 1 / (1 + std::pow(ratio, 4));
        for (std::size_t i = 1500; i < 2500; ++i) ASSERT_NEAR(y[i], gain * x[i], 1e-9) << frequency << " Hz";
    }
}

TEST(LowPass, LeavesAConstantAloneFromTheFirstSample) {
    for (const double y : low_pass(std::vector<double>(50, -3.25), 1e-3, 10)) EXPECT_NEAR(y, -3.25, 1e-12);
}

// Table 3 of ISO 2631-1, factors of W_d (three digits).
TEST(Weighting, HasTheTabulatedFactors) {
    const std::pair<double, double> table[] = {{0.4, 0.713}, {0.5, 0.853}, {0.8, 0.992}, {1, 1.011},
                                               {2, 0.890},   {4, 0.512},   {8, 0.253},   {16, 0.125}};
    for (const auto& [frequency, factor] : table) {
        EXPECT_NEAR(weight_horizontal_gain(frequency, 1e-3), factor, 6e-4) << frequency;
        EXPECT_NEAR(weight_horizontal_gain(frequency, 1e-4), factor, 6e-4) << frequency;
    }
}

TEST(Weighting, FilteredSineHasTheGainOfTheFilter) {
    const std::vector<double> y = weight_horizontal(sine(2, 1e-3, 20001), 1e-3);
    double peak = 0;
    for (std::size_t i = 15000; i < y.size(); ++i) peak = std::max(peak, y[i]);
    EXPECT_NEAR(peak, weight_horizontal_gain(2, 1e-3), 1e-5);
}

// (∫ sin⁴ dt)^¼ over whole periods = (3/8·T)^¼.
TEST(VibrationDose, OfASineIsKnown) {
    std::vector<double> x = sine(5, 1e-3, 2000);
    for (double& value : x) value *= 1.7;
    EXPECT_NEAR(vibration_dose(x, 1e-3), 1.7 * std::pow(3.0 / 8 * 2, 0.25), 1e-12);
}

TEST(Derivative, OfAParabolaIsExactInside) {
    std::vector<double> x;
    for (int i = 0; i < 20; ++i) x.push_back(3.0 * i * i * 0.01 * 0.01);
    const std::vector<double> y = derivative(x, 0.01);
    for (int i = 1; i < 19; ++i) EXPECT_NEAR(y[static_cast<std::size_t>(i)], 6.0 * i * 0.01, 1e-12);
}

}  // namespace
}  // namespace shiftrig::analysis
