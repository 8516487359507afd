// The plant's own elementary functions against long double, in units in the last place.
#include "plant/math/elementary.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "plant/math/table.h"

namespace shiftrig::plant {
namespace {

// The C library in long double must really be wider than double, or this oracle proves nothing.
static_assert(std::numeric_limits<long double>::digits >= 64);

double ulps(double value, long double exact) {
    const double rounded = std::fabs(static_cast<double>(exact));
    const double ulp = std::nextafter(rounded, INFINITY) - rounded;
    return static_cast<double>(std::fabs(static_cast<long double>(value) - exact) /
                               static_cast<long double>(ulp));
}

TEST(Elementary, ExpIsWithinOneUlp) {
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> real(-1, 1);
    double worst = 0;
    for (int i = 0; i < 400000; ++i) {
        const double x = 700 * real(random) * std::pow(10, -3 * std::fabs(real(random)));
        worst = std::fmax(worst, ulps(exp(x), std::exp(static_cast<long double>(x))));
    }
    EXPECT_LT(worst, 1);
}

TEST(Elementary, ExpKeepsItsEnds) {
    EXPECT_EQ(exp(0), 1);
    EXPECT_EQ(exp(-0.0), 1);
    EXPECT_EQ(exp(1000), INFINITY);
    EXPECT_EQ(exp(-1000), 0);
    EXPECT_EQ(exp(INFINITY), INFINITY);
    EXPECT_EQ(exp(-INFINITY), 0);
    EXPECT_TRUE(std::isnan(exp(NAN)));
    EXPECT_LT(ulps(exp(709.78), std::exp(709.78L)), 4000);  // argument itself is a rounded decimal
    EXPECT_GT(exp(-745), 0);                                // subnormal
    EXPECT_LT(exp(-745), 1e-323);
}

TEST(Elementary, LogIsWithinOneUlp) {
    std::mt19937_64 random(2);
    std::uniform_real_distribution<double> real(-1, 1);
    double worst = 0;
    for (int i = 0; i < 400000; ++i) {
        const double x = std::exp(real(random) * (i % 2 ? 0.5 : 700));
        worst = std::fmax(worst, ulps(log(x), std::log(static_cast<long double>(x))));
    }
    EXPECT_LT(worst, 1);
    EXPECT_EQ(log(1), 0);
    EXPECT_EQ(log(0), -INFINITY);
    EXPECT_TRUE(std::isnan(log(-1)));
    EXPECT_LT(ulps(log(5e-324), std::log(static_cast<long double>(5e-324))), 1);
}

TEST(Elementary, SineAndCosineAreWithinOneUlpUpTo1e5) {
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> real(-1, 1);
    double worst = 0;
    for (int i = 0; i < 400000; ++i) {
        const double x = real(random) * (i % 2 ? 10 : 1e5);
        worst = std::fmax(worst, ulps(sin(x), std::sin(static_cast<long double>(x))));
        worst = std::fmax(worst, ulps(cos(x), std::cos(static_cast<long double>(x))));
    }
    EXPECT_LT(worst, 1);
    EXPECT_EQ(sin(0), 0);
    EXPECT_EQ(cos(0), 1);
    EXPECT_TRUE(std::isnan(sin(INFINITY)));
}

TEST(Elementary, PowerLosesNoMoreThanTheExponentOfItsLogarithm) {
    std::mt19937_64 random(4);
    std::uniform_real_distribution<double> real(-1, 1);
    for (int i = 0; i < 100000; ++i) {
        const double x = std::exp(3 * real(random)), y = 5 * real(random);
        const long double exact = std::pow(static_cast<long double>(x), static_cast<long double>(y));
        EXPECT_LT(ulps(power(x, y), exact), 2 + 2 * std::fabs(y * std::log(x)));
    }
}

// Fixed bits, so that a change of machine, compiler or level of optimisation shows.
TEST(Elementary, BitsAreFixed) {
    EXPECT_EQ(std::bit_cast<std::uint64_t>(exp(1.5)), 0x4011ed3fe64fc541u);
    double sum = 0;
    for (int i = 1; i < 1000; ++i) sum = sum * 0.5 + exp(-0.01 * i) + log(i) + sin(0.1 * i) + cos(0.2 * i);
    EXPECT_EQ(std::bit_cast<std::uint64_t>(sum), 0x40296df073b757e7u);
}

TEST(Table, InterpolatesBetweenPointsAndHoldsBeyondThem) {
    const Table table{{1, 10}, {2, 30}, {4, 20}};
    EXPECT_EQ(interpolate(table, 0), 10);
    EXPECT_EQ(interpolate(table, 1), 10);
    EXPECT_EQ(interpolate(table, 1.5), 20);
    EXPECT_EQ(interpolate(table, 2), 30);
    EXPECT_EQ(interpolate(table, 3), 25);
    EXPECT_EQ(interpolate(table, 9), 20);
    EXPECT_EQ(extrapolate(table, 6), 10);
    EXPECT_EQ(extrapolate(table, 0), 10);
    EXPECT_EQ(largest_value(table), 30);
}

}  // namespace
}  // namespace shiftrig::plant
