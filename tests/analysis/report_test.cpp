#include "analysis/report/report.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace {

using namespace shiftrig;
using analysis::Decimation;

analysis::Run long_run(std::size_t rows) {
    analysis::Run run;
    analysis::Column speed{{"mass.engine.speed", plant::Unit::radian_per_second, 0, 0, 0, ""}, {}};
    for (std::size_t i = 0; i < rows; ++i) {
        run.time.push_back(static_cast<double>(i) * 1e-3);
        speed.value.push_back(100 + std::sin(static_cast<double>(i) * 0.01));
    }
    run.columns.push_back(speed);
    return run;
}

TEST(Decimation, ShortRunsAreKeptWhole) {
    const auto run = long_run(500);
    const auto kept = Decimation::of(run.time, 6000, {});
    EXPECT_EQ(kept.time(run.time), run.time);
    EXPECT_EQ(kept.values(run.columns[0].value), run.columns[0].value);
}

TEST(Decimation, AnHourKeepsASpikeOfOneMillisecond) {
    auto run = long_run(3'600'000);
    run.columns[0].value[1'234'567] = 500;
    run.columns[0].value[2'345'678] = -500;
    const auto kept = Decimation::of(run.time, 6000, {});
    const auto values = kept.values(run.columns[0].value);
    EXPECT_LE(values.size(), 6100U);
    EXPECT_EQ(values.size(), kept.time(run.time).size());
    EXPECT_EQ(*std::max_element(values.begin(), values.end()), 500);
    EXPECT_EQ(*std::min_element(values.begin(), values.end()), -500);
}

TEST(Decimation, AWindowKeepsEveryTick) {
    const auto run = long_run(100'000);
    const auto kept = Decimation::of(run.time, 1000, {{50.0, 51.0}});
    const auto times = kept.time(run.time);
    EXPECT_EQ(std::count_if(times.begin(), times.end(), [](double t) { return t >= 50 && t <= 51; }), 1001);
    EXPECT_TRUE(std::is_sorted(times.begin(), times.end()));
}

TEST(Report, TextFromTheRunCannotEndTheScript) {
    auto run = long_run(10);
    run.model_text = "</script><script>alert(1)</script><!--";
    const std::string html = analysis::report_html(run, nlohmann::json::array(), {"title", "<svg/>"});
    EXPECT_EQ(html.find("alert(1)</script>"), std::string::npos);
    EXPECT_NE(html.find("\\u003c/script>\\u003cscript>alert(1)"), std::string::npos);
}

TEST(Report, HoldsNoReferenceToAnotherHost) {
    const auto run = long_run(10);
    const std::string html = analysis::report_html(run, nlohmann::json::array(), {"title", "<svg/>"});
    for (const std::string attribute : {"src=\"http", "href=\"http", "url(http", "@import"})
        EXPECT_EQ(html.find(attribute), std::string::npos) << attribute;
}

// The recording begins when 40 J have gone in already: what the table tells adds up all the same.
TEST(Report, EnergyTableIsTheChangeOfTheLedgerFromTheFirstRowToTheLast) {
    auto run = long_run(3);
    run.columns.push_back({{"energy.input", plant::Unit::joule, 0, 0, 0, ""}, {40, 45, 50}});
    run.columns.push_back({{"energy.stored", plant::Unit::joule, 0, 0, 0, ""}, {100, 102, 104}});
    run.columns.push_back({{"energy.dissipated", plant::Unit::joule, 0, 0, 0, ""}, {20, 23, 26.5}});
    run.columns.push_back({{"energy.defect", plant::Unit::joule, 0, 0, 0, ""}, {1, 1.25, 1.5}});
    run.columns.push_back({{"clutch.F2.heat", plant::Unit::joule, 0, 0, 0, ""}, {7, 9, 11}});
    const std::string html = analysis::report_html(run, nlohmann::json::array(), {"title", "<svg/>"});
    EXPECT_NE(html.find(R"("input_j":10.0)"), std::string::npos);
    EXPECT_NE(html.find(R"("stored_change_j":4.0)"), std::string::npos);
    EXPECT_NE(html.find(R"("dissipated_total_j":6.5)"), std::string::npos);
    EXPECT_NE(html.find(R"("dissipated_j":{"F2":4.0})"), std::string::npos);
    EXPECT_NE(html.find(R"("defect_j":0.5)"), std::string::npos);
}

}  // namespace
