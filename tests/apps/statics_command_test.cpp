// The WT gearbox of [Algin] Table 2 through the command line. Four printed entries of the table contradict the
// article's own rule and torque balance (docs/mechanics.md); they are recomputed, all others are the article's.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/apps/program.h"

namespace shiftrig {
namespace {

using test::run_program;
using test::Said;

const std::string wt = SHIFTRIG_SOURCE_DIR "/config/wt_gearbox.yaml";

Said statics(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "statics");
    return run_program(SHIFTRIG_PROGRAM, arguments);
}

nlohmann::json solved(const std::string& closed, bool ideal) {
    std::vector<std::string> arguments{wt, "--closed", closed, "--input", "input=1", "--json"};
    if (ideal) arguments.push_back("--ideal");
    const Said said = statics(arguments);
    EXPECT_EQ(said.exit_code, 0) << said.err;
    EXPECT_EQ(said.err, "");
    return nlohmann::json::parse(said.out);
}

struct Row {
    const char* name;
    double sun, ring, carrier;
    double tolerance = 0.002;  // the article's ratios and torques are rounded to three figures
};

void expect_rows(const nlohmann::json& answer, const std::vector<Row>& rows) {
    const auto& links = answer.at("links");
    for (const auto& row : rows) {
        const std::string name = row.name;
        EXPECT_NEAR(links.at(name + ".sun").get<double>(), row.sun, row.tolerance) << name;
        EXPECT_NEAR(links.at(name + ".ring").get<double>(), row.ring, row.tolerance) << name;
        EXPECT_NEAR(links.at(name + ".carrier").get<double>(), row.carrier, row.tolerance) << name;
    }
}

// Every node but the absorbing one balances: Σ of the torques into its devices is what is put in.
void expect_balance(const nlohmann::json& answer) {
    for (const auto& [name, node] : answer.at("nodes").items())
        EXPECT_LT(std::fabs(node.at("residual").get<double>()), 1e-9) << name;
    const auto& links = answer.at("links");
    double carrier1_ring2 = links.at("row1.carrier").get<double>() + links.at("row2.ring").get<double>();
    EXPECT_NEAR(carrier1_ring2, 0, 1e-9);
}

TEST(StaticsCommand, GearThreeIdealIsTableTwo) {
    const auto answer = solved("C1,C3", true);
    expect_rows(
        answer,
        {{"row1", 0.294, 0.523, -0.817}, {"row2", 0.259, 0.816, -1.075}, {"row3", 0.447, 1.077, -1.524}});
    expect_balance(answer);
}

TEST(StaticsCommand, GearThreeWithLossesIsTableTwo) {
    const auto answer = solved("C1,C3", false);
    expect_rows(
        answer,
        {{"row1", 0.291, 0.502, -0.793}, {"row2", 0.259, 0.791, -1.050}, {"row3", 0.450, 1.052, -1.502}});
    expect_balance(answer);
    EXPECT_NEAR(answer.at("ratio").get<double>(), 1.5230, 5e-5);
}

TEST(StaticsCommand, GearFiveIdealIsTableTwo) {
    const auto answer = solved("C2,C3", true);
    expect_rows(
        answer,
        {{"row1", -0.209, -0.372, 0.581}, {"row2", -0.184, -0.580, 0.764}, {"row3", 0.184, 0.443, -0.627}});
    expect_balance(answer);
}

TEST(StaticsCommand, GearFiveWithLossesIsTableTwoWhereItIsSoundAndRecomputedWhereNot) {
    const auto answer = solved("C2,C3", false);
    expect_rows(answer, {{"row1", -0.2107, -0.3865, 0.5973, 0.0005},
                         {"row2", -0.1839, -0.5973, 0.7811, 0.0005},
                         {"row3", 0.184, 0.430, -0.614}});
    // The article's sound entries of rows 1 and 2.
    EXPECT_NEAR(answer.at("links").at("row1.sun").get<double>(), -0.211, 0.002);
    EXPECT_NEAR(answer.at("links").at("row2.sun").get<double>(), -0.184, 0.002);
    expect_balance(answer);
    const std::map<std::string, int> x{{"row1", -1}, {"row2", -1}, {"row3", 1}};
    for (const auto& [row, expected] : x)
        EXPECT_EQ(answer.at("meshes").at(row).at("x").get<int>(), expected) << row;
    EXPECT_LT(answer.at("efficiency").get<double>(), 1);
}

TEST(StaticsCommand, TurningTheOtherWayReversesWhoDrives) {
    // The same torque at the opposite speed: the input is driven, so losses raise what the output must give.
    const Said said =
        statics({wt, "--closed", "C1,C3", "--input", "input=1", "--speed", "input=-1", "--json"});
    ASSERT_EQ(said.exit_code, 0) << said.err;
    const auto answer = nlohmann::json::parse(said.out);
    for (const auto& row : {"row1", "row2", "row3"})
        EXPECT_EQ(answer.at("meshes").at(row).at("x").get<int>(), -1) << row;
    EXPECT_GT(std::fabs(answer.at("links").at("row3.carrier").get<double>()), 1.5230);
}

TEST(StaticsCommand, AnOptionPutsItsRatioInUse) {
    const std::string tractor = SHIFTRIG_SOURCE_DIR "/config/tractor.yaml";
    const Said said = statics(
        {tractor, "--closed", "Fc,F2", "--input", "engine=1000", "--option", "range=L", "--ideal", "--json"});
    ASSERT_EQ(said.exit_code, 0) << said.err;
    const double overall = 38. / 33 * 6.048 * 205 / 9;
    EXPECT_NEAR(nlohmann::json::parse(said.out).at("output_torque").get<double>(), -1000 * overall, 1e-6);
}

TEST(StaticsCommand, WrongNamesAndNumbersAreOneLineAndCodeTwo) {
    Said said = statics({wt, "--closed", "C1,C9", "--input", "input=1"});
    EXPECT_EQ(said.exit_code, 2);
    EXPECT_EQ(said.err, "shiftrig: model \"WT gearbox\": closed = \"C9\" is no clutch, brake or freewheel\n");
    said = statics({wt, "--closed", "C1,C3", "--input", "input=one"});
    EXPECT_EQ(said.exit_code, 2);
    EXPECT_EQ(said.err, "--input: \"input=one\": \"one\" is no finite number\n");
    said = statics({wt, "--closed", "C3,C4,C5", "--input", "input=1"});
    EXPECT_EQ(said.exit_code, 2);
    EXPECT_NE(said.err.find("over-determined"), std::string::npos) << said.err;
    EXPECT_EQ(said.out, "");
}

}  // namespace
}  // namespace shiftrig
