#include "rt/histogram.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace shiftrig::rt {
namespace {

TEST(Histogram, PercentilesAreThoseOfTheSortedValuesToOneCell) {
    std::mt19937_64 random(1);
    std::lognormal_distribution<double> durations(10, 2);
    Histogram histogram;
    std::vector<std::int64_t> values;
    double sum = 0;
    for (int i = 0; i < 100'000; ++i) {
        values.push_back(static_cast<std::int64_t>(durations(random)));
        histogram.record(values.back());
        sum += static_cast<double>(values.back());
    }
    std::sort(values.begin(), values.end());
    for (const double percent : {0.001, 1.0, 50.0, 90.0, 99.0, 99.9, 99.999, 100.0}) {
        const auto rank = static_cast<std::size_t>(std::ceil(percent / 100 * 100'000 - 1e-9));
        const std::int64_t exact = values[std::max<std::size_t>(rank, 1) - 1];
        EXPECT_GE(histogram.percentile(percent), exact) << percent;
        EXPECT_LE(static_cast<double>(histogram.percentile(percent)),
                  static_cast<double>(exact) * (1 + 1.0 / 128))
            << percent;
    }
    EXPECT_EQ(histogram.count(), 100'000);
    EXPECT_EQ(histogram.minimum(), values.front());
    EXPECT_EQ(histogram.maximum(), values.back());
    EXPECT_NEAR(histogram.mean(), sum / 100'000, 1e-9 * sum);
}

TEST(Histogram, EveryCellBeginsWhereTheOneBeforeEnds) {
    std::int64_t value = 0;
    int cells = 0;
    while (value < Histogram::largest_value) {
        const std::int64_t edge = Histogram::cell_upper_edge(value);
        ASSERT_GE(edge, value);
        ASSERT_LE(edge - value, value / 128);
        value = edge + 1;
        ++cells;
    }
    EXPECT_EQ(cells, 128 + 38 * 128);
}

TEST(Histogram, SmallDurationsAreExact) {
    Histogram histogram;
    for (int i = 0; i <= 100; ++i) histogram.record(i);
    EXPECT_EQ(histogram.percentile(50), 50);
    EXPECT_EQ(histogram.count_above(90), 10);
    EXPECT_EQ(histogram.count_above(-1), 101);
}

TEST(Histogram, BeyondItsRangeCountsAtTheEndAndNegativeAsZero) {
    Histogram histogram;
    histogram.record(-5);
    histogram.record(std::int64_t{1} << 60);
    EXPECT_EQ(histogram.minimum(), 0);
    EXPECT_EQ(histogram.maximum(), Histogram::largest_value);
    EXPECT_EQ(histogram.count(), 2);
}

// A stall of 100 intervals hides 99 questions that would have waited 99, 98, … 1 intervals.
TEST(Histogram, CorrectionAddsTheQuestionsThatAStallKeptFromBeingAsked) {
    Histogram histogram;
    const std::int64_t interval = 1000;
    for (int i = 0; i < 900; ++i) histogram.record(10);
    histogram.record(100 * interval);
    const Histogram corrected = histogram.corrected(interval);
    EXPECT_EQ(corrected.count(), 900 + 1 + 99);
    EXPECT_EQ(corrected.maximum(), 100 * interval);
    EXPECT_EQ(corrected.count_above(500), 100);
    // 950th of 1000: the 50th smallest of 1…100 intervals.
    EXPECT_EQ(corrected.percentile(95), Histogram::cell_upper_edge(50 * interval));
    EXPECT_EQ(histogram.percentile(95), 10);
}

TEST(Histogram, MergedHistogramIsThatOfAllValues) {
    Histogram a, b, both;
    for (int i = 1; i < 1000; ++i) {
        ((i % 3) ? a : b).record(i * i);
        both.record(i * i);
    }
    a.merge(b);
    EXPECT_EQ(a.percentiles(), both.percentiles());
    EXPECT_EQ(a.minimum(), 1);
    EXPECT_DOUBLE_EQ(a.mean(), both.mean());
}

TEST(Histogram, PictureShowsEveryDurationAndTheSingleWorstOne) {
    Histogram histogram;
    for (int i = 0; i < 1000; ++i) histogram.record(30'000);
    histogram.record(5'000'000);
    const std::string picture = histogram.picture(40);
    EXPECT_NE(picture.find("1000 ########################################\n"), std::string::npos) << picture;
    EXPECT_NE(picture.find("         1 ####"), std::string::npos) << picture;
    EXPECT_EQ(Histogram{}.picture(), "(nothing recorded)\n");
}

TEST(Histogram, DurationsReadWithThreeDigits) {
    EXPECT_EQ(format_duration(0), "0 ns");
    EXPECT_EQ(format_duration(999), "999 ns");
    EXPECT_EQ(format_duration(1'000), "1.00 µs");
    EXPECT_EQ(format_duration(31'400), "31.4 µs");
    EXPECT_EQ(format_duration(999'600), "1.00 ms");
    EXPECT_EQ(format_duration(123'456'789), "123 ms");
    EXPECT_EQ(format_duration(12'345'678'901), "12.3 s");
}

}  // namespace
}  // namespace shiftrig::rt
