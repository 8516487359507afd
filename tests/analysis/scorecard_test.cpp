#include "analysis/scorecard.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "io/input_error.h"
#include "tests/analysis/synthetic_run.h"

namespace shiftrig::analysis {
namespace {

Verdict verdict_of(const SyntheticRun& synthetic, const std::string& metric) {
    return score(synthetic.run).shifts.at(0).find(metric)->verdict;
}

TEST(Scorecard, JudgesEachMetricAgainstItsLimits) {
    SyntheticRun synthetic = upshift();
    EXPECT_EQ(verdict_of(synthetic, "duration_s"), Verdict::acceptable);  // 0.676 s between 0.6 and 1.2
    for (const auto& [energy, verdict] : {std::pair{5000., Verdict::good},
                                          {5001., Verdict::acceptable},
                                          {20000., Verdict::acceptable},
                                          {20001., Verdict::reject}}) {
        synthetic.set("clutch.B.heat", ramp(5.2, 6.0, 0, energy));
        EXPECT_EQ(verdict_of(synthetic, "clutch_energy_j.B"), verdict) << energy;
    }
    EXPECT_EQ(verdict_of(synthetic, "fill_time_s"), Verdict::told);
    EXPECT_EQ(score(synthetic.run).shifts[0].verdict, Verdict::reject);
    EXPECT_EQ(score(synthetic.run).verdict, Verdict::reject);
}

// The shift with the lowest jerk of all is the one that never completes: completion comes first.
TEST(Scorecard, ShiftThatIsNotCompletedIsRejectedHoweverSmooth) {
    SyntheticRun synthetic = driving_in_a();
    synthetic.set("driver.lever", step(5, 1, 2)).set("clutch.B.engagement", [](double t) {
        return t > 5.1 && t < 5.3;
    });
    Limits limits = default_limits();
    limits.shift.erase("duration_s");
    const Scorecard card = score(synthetic.run, limits);
    ASSERT_EQ(card.shifts.size(), 1u);
    for (const Metric& metric : card.shifts[0].metrics) {
        EXPECT_TRUE(metric.verdict == Verdict::good || metric.verdict == Verdict::told) << metric.full_name();
    }
    EXPECT_EQ(card.shifts[0].verdict, Verdict::reject);
}

TEST(Scorecard, RunWithoutShiftsIsGood) {
    const Scorecard card = score(driving_in_a().run);
    EXPECT_EQ(card.verdict, Verdict::good);
    EXPECT_EQ(to_json(card), nlohmann::json::array());
    EXPECT_EQ(to_text(card), "no shift\n");
}

TEST(Scorecard, ReadsAsJson) {
    SyntheticRun synthetic = upshift();
    synthetic.set("clutch.B.heat", ramp(5.2, 6.0, 0, 3000));
    const nlohmann::json shift = to_json(score(synthetic.run)).at(0);
    EXPECT_EQ(shift["from"], "A");
    EXPECT_EQ(shift["to"], "B");
    EXPECT_EQ(shift["kind"], "power upshift");
    EXPECT_EQ(shift["completed"], true);
    EXPECT_NEAR(shift["duration_s"], 0.676, 1e-3);
    EXPECT_NEAR(shift["clutch_energy_j"]["B"], 3000, 1e-6);
    EXPECT_EQ(shift["verdicts"]["clutch_energy_j.B"], "good");
    EXPECT_TRUE(shift["clutch_temperature_degc"]["B"].is_null());
    EXPECT_EQ(shift["verdict"], "acceptable");
}

TEST(Scorecard, EveryMetricHasItsNameInTheListOfNames) {
    std::vector<std::string> seen;
    const Scorecard card = score(upshift().run);
    for (const Metric& metric : card.shifts.at(0).metrics) {
        if (seen.empty() || seen.back() != metric.name) seen.push_back(metric.name);
    }
    for (const std::string& name : seen) {
        EXPECT_NE(std::find(metric_names().begin(), metric_names().end(), name), metric_names().end())
            << name;
    }
    for (const std::string& name : metric_names())
        EXPECT_NE(std::find(seen.begin(), seen.end(), name), seen.end()) << name;
}

TEST(Limits, LaunchesHaveTheirOwnWhereGivenAndThoseOfShiftsOtherwise) {
    const Limits limits = default_limits();
    EXPECT_EQ(limits.find("clutch_energy_j", ShiftKind::power_upshift)->reject, 20000);
    EXPECT_EQ(limits.find("clutch_energy_j", ShiftKind::launch)->reject, 100000);
    EXPECT_EQ(limits.find("clutch_energy_j", ShiftKind::shuttle)->reject, 200000);
    EXPECT_EQ(limits.find("clutch_temperature_degc", ShiftKind::launch)->reject, 250);
    EXPECT_EQ(limits.find("fill_time_s", ShiftKind::launch), nullptr);
}

std::string refusal(const std::string& text) {
    try {
        parse_limits(text, "limits.yaml");
    } catch (const io::InputError& error) {
        return error.what();
    }
    return "accepted";
}

TEST(Limits, WrongOnesAreRefusedWithTheirPlace) {
    EXPECT_EQ(refusal("shift:\n  duration: {good: 1, reject: 2}\n"),
              "limits.yaml:2:13: shift: unknown metric \"duration\"");
    EXPECT_EQ(refusal("shift:\n  duration_s: {good: 3, reject: 2}\n"),
              "limits.yaml:2:15: shift: duration_s: reject must not be below good");
    EXPECT_EQ(refusal("shift:\n  duration_s: {good: fast, reject: 2}\n"),
              "limits.yaml:2:22: shift: duration_s: good = fast; must be a number ≥ 0");
    EXPECT_EQ(refusal("shift:\n  duration_s: {good: 1}\n"),
              "limits.yaml:2:15: shift: duration_s: needs both good and reject");
    EXPECT_EQ(refusal("shift:\n  duration_s: 1\n"), "limits.yaml:2:15: shift: duration_s: must be a map");
    EXPECT_EQ(refusal("rules: {timeout: 2}\n"), "limits.yaml:1:18: rules: unknown key \"timeout\"");
    EXPECT_EQ(refusal("launching: {}\n"), "limits.yaml:1:12: unknown key \"launching\"");
    EXPECT_EQ(refusal("shift: {duration_s: {good: .nan, reject: 2}}"),
              "limits.yaml:1:28: shift: duration_s: good = .nan; must be a number ≥ 0");
    EXPECT_EQ(refusal("# nothing\n"), "limits.yaml:1:1: the file is empty");
    EXPECT_EQ(refusal("rules: {timeout_s: 3}\n"), "accepted");
    EXPECT_EQ(parse_limits("rules: {timeout_s: 3}\n", "").rules.timeout, 3);
}

TEST(Limits, AFolderIsToldSo) {
    try {
        read_limits("/tmp");
        FAIL();
    } catch (const io::InputError& error) {
        EXPECT_STREQ(error.what(), "/tmp: cannot be read: Is a directory");
    }
}

}  // namespace
}  // namespace shiftrig::analysis
