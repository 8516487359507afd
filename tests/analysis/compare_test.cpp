#include "analysis/compare.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "analysis/result_set.h"
#include "io/input_error.h"

namespace shiftrig::analysis {
namespace {

using nlohmann::json;
using Kind = Difference::Kind;

json shift(const char* from, const char* to, double duration, double energy) {
    return {{"from", from},
            {"to", to},
            {"kind", "power upshift"},
            {"completed", true},
            {"duration_s", duration},
            {"fill_time_s", 0.09},
            {"peak_jerk_m_s3", 8.0},
            {"slip_time_s", {{"Fc", 0.0}}},
            {"clutch_energy_j", {{"F2", 120.0}, {"F3", energy}}}};
}

json two_runs() {
    return {{"plough", json::array({shift("F2", "F3", 0.412, 3100), shift("F3", "F4", 0.45, 3500)})},
            {"road", json::array({shift("F1", "F2", 0.31, 900), shift("F2", "F1", 0.3, 800),
                                  shift("F1", "F2", 0.33, 950)})}};
}

TEST(Compare, IsSilentOnIdenticalResults) {
    EXPECT_TRUE(compare(two_runs(), two_runs(), default_limits()).empty());
}

TEST(Compare, FindsThePlantedDegradationOfOneShiftAndNothingElse) {
    json after = two_runs();
    after["road"][2]["duration_s"] = 0.33 * 1.1;
    const std::vector<Difference> found = compare(two_runs(), after, default_limits());
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].text(), "road F1->F2 (2): duration_s 0.33 → 0.363 (+10.0 %), worse");
    EXPECT_EQ(found[0].kind, Kind::worse);
}

TEST(Compare, FindsThePlantedDegradationOfEachMetricOfEachShift) {
    for (const char* path :
         {"/plough/0/duration_s", "/plough/0/clutch_energy_j/F3", "/plough/1/clutch_energy_j/F3",
          "/road/1/clutch_energy_j/F3", "/road/0/peak_jerk_m_s3"}) {
        json after = two_runs();
        double& value = after[json::json_pointer(path)].get_ref<double&>();
        value *= 1.1;
        const auto found = compare(two_runs(), after, default_limits());
        ASSERT_EQ(found.size(), 1u) << path;
        EXPECT_NEAR(found[0].after / found[0].before, 1.1, 1e-12);
        const auto back = compare(after, two_runs(), default_limits());
        ASSERT_EQ(back.size(), 1u) << path;
        EXPECT_EQ(back[0].kind, Kind::better);
    }
}

TEST(Compare, ChangesOfWhatIsOnlyToldAreNone) {
    json after = two_runs();
    after["road"][0]["fill_time_s"] = 0.2;
    EXPECT_TRUE(compare(two_runs(), after, default_limits()).empty());
}

TEST(Compare, FromNothingToSomethingCounts) {
    json after = two_runs();
    after["plough"][0]["slip_time_s"]["Fc"] = 0.05;
    const auto found = compare(two_runs(), after, default_limits());
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].text(), "plough F2->F3: slip_time_s.Fc 0 → 0.05, worse");
}

// The scorecard tells clutches beside the shift's own only once they take heat: what it does not tell took none.
TEST(Compare, AClutchThatBeginsToBurnIsWorseAndOneThatCeasesToIsBetter) {
    json after = two_runs();
    after["plough"][0]["clutch_energy_j"]["Fc"] = 90000.0;
    after["plough"][0]["clutch_peak_power_w"]["Fc"] = 70000.0;
    after["plough"][0]["clutch_temperature_degc"]["Fc"] = 400.0;  // of which no value before is known
    const auto found = compare(two_runs(), after, default_limits());
    ASSERT_EQ(found.size(), 2u);
    EXPECT_EQ(found[0].text(), "plough F2->F3: clutch_energy_j.Fc 0 → 9e+04, worse");
    EXPECT_EQ(found[1].text(), "plough F2->F3: clutch_peak_power_w.Fc 0 → 7e+04, worse");
    const auto back = compare(after, two_runs(), default_limits());
    ASSERT_EQ(back.size(), 2u);
    EXPECT_EQ(back[0].text(), "plough F2->F3: clutch_energy_j.Fc 9e+04 → 0 (-100.0 %), better");
}

TEST(Compare, AMetricWhoseValueIsLostIsWorse) {
    for (const json& lost : {json(), json(std::nan(""))}) {
        json after = two_runs();
        after["plough"][0]["peak_jerk_m_s3"] = lost;
        after["plough"][0]["clutch_energy_j"]["F3"] = lost;
        const auto found = compare(two_runs(), after, default_limits());
        ASSERT_EQ(found.size(), 2u);
        EXPECT_EQ(found[0].text(), "plough F2->F3: clutch_energy_j.F3 3100 → no value, worse");
        EXPECT_EQ(found[1].text(), "plough F2->F3: peak_jerk_m_s3 8 → no value, worse");
        const auto back = compare(after, two_runs(), default_limits());
        ASSERT_EQ(back.size(), 2u);
        EXPECT_EQ(back[1].text(), "plough F2->F3: peak_jerk_m_s3 no value → 8, better");
        EXPECT_TRUE(compare(after, after, default_limits()).empty());
    }
    json after = two_runs();
    after["plough"][0].erase("peak_jerk_m_s3");
    EXPECT_EQ(compare(two_runs(), after, default_limits()).size(), 1u);
}

TEST(Compare, LostCompletionAndLostShiftsComeFirst) {
    json after = two_runs();
    after["plough"][0]["completed"] = false;
    after["plough"][0]["duration_s"] = 0.3;
    after["road"].erase(2);
    const auto found = compare(two_runs(), after, default_limits());
    ASSERT_EQ(found.size(), 3u);
    EXPECT_EQ(found[0].text(), "road F1->F2 (2): no longer there");
    EXPECT_EQ(found[1].text(), "plough F2->F3: no longer completed, worse");
    EXPECT_EQ(found[2].kind, Kind::better);
}

TEST(Compare, SingleRunsAreComparedWhateverTheirNames) {
    const json before{{"yesterday", json::array({shift("F2", "F3", 0.4, 3000)})}};
    const json after{{"today", json::array({shift("F2", "F3", 0.4, 3000), shift("F3", "F4", 0.4, 3000)})}};
    const auto found = compare(before, after, default_limits());
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].text(), "today F3->F4: was not there before");
}

class ResultFiles : public ::testing::Test {
  protected:
    void SetUp() override {
        char name[] = "/tmp/compare_test_XXXXXX";
        folder = mkdtemp(name);
    }
    void TearDown() override { std::filesystem::remove_all(folder); }
    std::string file(const std::string& name, const std::string& text) {
        std::ofstream(folder / name) << text;
        return (folder / name).string();
    }
    std::string refusal(const std::string& path) {
        try {
            read_results(path, default_limits());
        } catch (const io::InputError& error) {
            return std::string(error.what()).substr(folder.string().size() + 1);
        }
        return "accepted";
    }
    std::filesystem::path folder;
};

TEST_F(ResultFiles, AreReadAloneInListsAndInFolders) {
    const json shifts = two_runs()["road"];
    const std::string one = file("one.json", json{{"shifts", shifts}}.dump());
    EXPECT_EQ(read_results(one, default_limits()).runs, (json{{"one", shifts}}));
    const std::string list =
        file("list.json", json{{"runs",
                                {{{"scenario", "config/scenarios/a.yaml"}, {"shifts", shifts}},
                                 {{"name", "b"}, {"shifts", json::array()}}}}}
                              .dump());
    EXPECT_EQ(read_results(list, default_limits()).runs, (json{{"a", shifts}, {"b", json::array()}}));
    EXPECT_EQ(read_results(folder.string(), default_limits()).runs.size(), 3u);
}

TEST_F(ResultFiles, KeepDotsInTheirNamesAndRefuseANameThatIsTaken) {
    const std::string shifts = json{{"shifts", two_runs()["road"]}}.dump();
    file("shift.v1.json", shifts);
    file("shift.v2.json", shifts);
    const json results = read_results(folder.string(), default_limits()).runs;
    EXPECT_TRUE(results.contains("shift.v1"));
    EXPECT_TRUE(results.contains("shift.v2"));
    file("z.json", R"({"scenario": "b/shift.v1.yaml", "shifts": []})");
    EXPECT_EQ(refusal(folder.string()), "z.json: run \"shift.v1\" is there already, from " +
                                            (folder / "shift.v1.json").string() +
                                            "; runs are told apart by name");
}

TEST_F(ResultFiles, ThatAreIllTypedAreNamedWithFileRunShiftKeyAndRule) {
    const auto refused = [this](const std::string& shift) {
        return refusal(file("r.json", "{\"shifts\": [" + shift + "]}"));
    };
    const std::string place = "r.json: run \"r\", shift 1: ";
    EXPECT_EQ(refused(R"({"from": 3, "to": "F4"})"), place + "from = 3; must be a word");
    EXPECT_EQ(refused(R"({"from": "F3"})"), place + "to is missing");
    EXPECT_EQ(refused("7"), place + "it = 7; must be an object");
    EXPECT_EQ(refused(R"({"from": "F3", "to": "F4", "completed": 1})"),
              place + "completed = 1; must be true or false");
    EXPECT_EQ(refused(R"({"from": "F3", "to": "F4", "duration_s": "fast"})"),
              place + "duration_s = \"fast\"; must be a number or null");
    EXPECT_EQ(refused(R"({"from": "F3", "to": "F4", "clutch_energy_j": {"F3": []}})"),
              place + "clutch_energy_j.F3 = []; must be a number or null");
    EXPECT_EQ(refused(R"({"from": "F3", "to": "F4", "clutch_energy_j": {"F3": null}})"), "accepted");
}

TEST_F(ResultFiles, OfARunThatIsNotWholeAreRefusedInOneLine) {
    const auto refused = [this](const std::string& more) {
        return refusal(file("r.json", "{\"shifts\": [], " + more + "}"));
    };
    for (const char* outcome : {"stopped", "too_far_behind", "late_too_often"})
        EXPECT_EQ(refused(R"("loop": {"outcome": ")" + std::string(outcome) + "\"}"),
                  "r.json: run \"r\" did not come to its end (outcome \"" + std::string(outcome) +
                      "\"); only whole runs are compared");
    EXPECT_EQ(refused(R"("loop": {"outcome": "completed"})"), "accepted");
    EXPECT_EQ(refused(R"("loop": {"ticks": 3})"), "accepted");
    EXPECT_EQ(refused(R"("error": "r.yaml: cannot be read")"),
              "r.json: run \"r\" could not be judged: r.yaml: cannot be read");
}

TEST_F(ResultFiles, OfWhichSomeAreNotWholeNameThemAndKeepTheRest) {
    const json shifts = two_runs()["road"];
    const auto set = [&](const char* name, const json& judged, const json& also) {
        return read_results(
            file(name, json{{"runs", {judged, {{"name", "b"}, {"shifts", shifts}}, also}}}.dump()),
            default_limits());
    };
    const json fine{{"name", "a"}, {"shifts", shifts}}, none{{"name", "c"}, {"shifts", json::array()}};
    const json broken{{"name", "a"}, {"shifts", json::array()}, {"error", "a.yaml:3:1: no such key"}};
    const json stopped{{"name", "c"}, {"shifts", json::array()}, {"loop", {{"outcome", "stopped"}}}};
    const ResultSet before = set("before.json", fine, none), after = set("after.json", broken, stopped);
    EXPECT_TRUE(before.not_whole.empty());
    const std::string place = (folder / "after.json").string() + ": run ";
    EXPECT_EQ(after.not_whole, (std::map<std::string, std::string>{
                                   {"a", place + "\"a\" could not be judged: a.yaml:3:1: no such key"},
                                   {"c", place + "\"c\" did not come to its end (outcome \"stopped\"); only "
                                                 "whole runs are compared"}}));
    EXPECT_EQ(after.runs, (json{{"a", nullptr}, {"b", shifts}, {"c", nullptr}}));
    EXPECT_TRUE(compare(before.runs, after.runs, default_limits()).empty());
    EXPECT_TRUE(compare(after.runs, before.runs, default_limits()).empty());
    json worse = after.runs;
    worse["b"].erase(2);
    const auto found = compare(before.runs, worse, default_limits());
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].text(), "b F1->F2 (2): no longer there");
}

TEST_F(ResultFiles, WrongOnesAreRefusedInOneLine) {
    EXPECT_EQ(refusal((folder / "none").string()), "none: no such file");
    EXPECT_EQ(refusal(file("broken.json", "{\"shifts\": [")), "broken.json: neither a recording nor JSON");
    EXPECT_EQ(
        refusal(file("other.json", "{}")),
        "other.json: no \"shifts\" in it; must be a result of run --json or test --json, or a recording");
}

}  // namespace
}  // namespace shiftrig::analysis
