// The WT gearbox of [Algin] Table 2 through the command line. Four printed entries of the table contradict the
// article's own rule and torque balance (docs/mechanics.md); they are recomputed, all others are the article's.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
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
    EXPECT_EQ(said.err,
              "--closed C9: " + wt + " has no clutch, brake or freewheel of this name; nearest: C1\n");
    said = statics({wt, "--closed", "C1,C3,C1", "--input", "input=1"});
    EXPECT_EQ(said.exit_code, 2);
    EXPECT_EQ(said.err, "--closed C1: must be named once\n");
    for (const std::string option : {"--input", "--speed", "--output"}) {
        const std::string value = option == "--output" ? "imput" : "imput=1";
        std::vector<std::string> arguments{wt, "--closed", "C1,C3", option, value};
        if (option != "--input") arguments.insert(arguments.end(), {"--input", "input=1"});
        said = statics(arguments);
        EXPECT_EQ(said.exit_code, 2);
        EXPECT_EQ(said.err, option + " imput: " + wt + " has no mass of this name; nearest: input\n");
    }
    said = statics({wt, "--closed", "C1,C3", "--input", "input=one"});
    EXPECT_EQ(said.exit_code, 2);
    EXPECT_EQ(said.err, "--input: \"input=one\": \"one\" is no finite number\n");
    said = statics({wt, "--closed", "C3,C4,C5", "--input", "input=1"});
    EXPECT_EQ(said.exit_code, 2);
    EXPECT_NE(said.err.find("over-determined"), std::string::npos) << said.err;
    EXPECT_EQ(said.out, "");
}

TEST(StaticsCommand, NumbersThatAreNoneAreOneLineAndCodeTwo) {
    const auto refused = [](const std::vector<std::string>& arguments, const std::string& line) {
        const Said said = statics(arguments);
        EXPECT_EQ(said.exit_code, 2);
        EXPECT_EQ(said.err, line);
        EXPECT_EQ(said.out, "");
    };
    for (const std::string given : {"nan", "1e400", "inf"}) {
        const std::string rule = ": \"input=" + given + "\": \"" + given + "\" is no finite number\n";
        refused({wt, "--closed", "C1,C3", "--input", "input=" + given}, "--input" + rule);
        refused({wt, "--closed", "C1,C3", "--input", "input=1", "--speed", "input=" + given},
                "--speed" + rule);
    }
    refused({wt, "--closed", "C1,C3", "--input", "input=-1e101"},
            "shiftrig: statics \"WT gearbox\": input \"input\" = -1e+101; must be finite, at most 1e100 in "
            "size\n");
}

// Gear IV is a direct drive.
TEST(StaticsCommand, LongNumbersKeepTheirSize) {
    const Said said = statics({wt, "--closed", "C1,C2", "--input", "input=1e60", "--ideal"});
    EXPECT_EQ(said.exit_code, 0) << said.err;
    EXPECT_NE(said.out.find("\noutput torque -1e+60 Nm, ratio 1.0000, efficiency 1.0000"), std::string::npos)
        << said.out;
}

// A model file that lives as long as its test.
class ModelFile {
  public:
    explicit ModelFile(const std::string& text)
        : path_(std::filesystem::path(testing::TempDir()) /
                (std::string(testing::UnitTest::GetInstance()->current_test_info()->name()) + ".yaml")) {
        std::ofstream(path_) << text;
    }
    ~ModelFile() { std::filesystem::remove(path_); }
    ModelFile(const ModelFile&) = delete;
    ModelFile& operator=(const ModelFile&) = delete;
    std::string path() const { return path_.string(); }

  private:
    std::filesystem::path path_;
};

std::string last_lines(const std::string& text) {
    return text.substr(text.find("\noutput") + 1);
}

const char* const row_and_brake = R"(
name: row
masses: {sun: {inertia_kg_m2: 1}, ring: {inertia_kg_m2: 1}, carrier: {inertia_kg_m2: 1}}
planetaries: {row: {sun: sun, ring: ring, carrier: carrier, ratio: RATIO, efficiency: EFFICIENCY}}
clutches: {B: {a: sun, b: housing, dry: {sliding_capacity_nm: 500, static_ratio: 1}, direct: {initial: 1}}}
gear_paths: {low: {closed: [B]}}
input_mass: sun
output_mass: carrier
)";

std::string row_with(const std::string& ratio, const std::string& efficiency) {
    std::string text = row_and_brake;
    text.replace(text.find("RATIO"), 5, ratio);
    return text.replace(text.find("EFFICIENCY"), 10, efficiency);
}

// Ring: 2·0.96·30 = 57.6; carrier: 87.6; loss 16 of 2352 W (statics_test).
TEST(StaticsCommand, LoadsInBalanceWithTheLossesAreSolvedOthersToldTheBalance) {
    const ModelFile model(row_with("-2", "0.96"));
    const std::vector<std::string> speeds{"--speed", "sun=40,ring=20", "--input"};
    std::vector<std::string> arguments{model.path()};
    arguments.insert(arguments.end(), speeds.begin(), speeds.end());
    arguments.push_back("sun=30,ring=57.6");
    Said said = statics(arguments);
    EXPECT_EQ(said.exit_code, 0) << said.err;
    EXPECT_EQ(last_lines(said.out), "output torque -87.6000 Nm, ratio 1.5000, efficiency 0.9932\n");
    arguments.back() = "sun=30,ring=60";
    said = statics(arguments);
    EXPECT_EQ(said.exit_code, 2);
    EXPECT_NE(said.err.find("balance it: sun = 31.25 Nm (30 given) or ring = 57.6 Nm (60 given)\n"),
              std::string::npos)
        << said.err;
}

// 100 W at the ring and 200 W at the carrier are 300 W of loss (statics_test).
TEST(StaticsCommand, SelfLockingIsSaidAndNoEfficiencyPrinted) {
    const ModelFile model(row_with("0.99", "0.97"));
    const std::vector<std::string> arguments{model.path(), "--closed", "B", "--input", "ring=100"};
    Said said = statics(arguments);
    EXPECT_EQ(said.exit_code, 0) << said.err;
    EXPECT_EQ(
        last_lines(said.out),
        "output torque -2.0202 Nm, ratio -0.0101\n"
        "self-locking in this direction: the output has to be driven as well, with -2.0202 Nm (200.0000 W); "
        "all that is put in is lost\n");
    auto as_json = arguments;
    as_json.push_back("--json");
    said = statics(as_json);
    EXPECT_EQ(said.exit_code, 0) << said.err;
    const auto answer = nlohmann::json::parse(said.out);
    EXPECT_TRUE(answer.at("self_locking").get<bool>());
    EXPECT_TRUE(answer.at("efficiency").is_null());
    EXPECT_NEAR(answer.at("loss_w").get<double>(), 300, 1e-9);
}

// Asked the other way round, the row cannot turn: power put in at the carrier comes out nowhere.
TEST(StaticsCommand, WhereNoDirectionsAgreeTheCodeIsOne) {
    const ModelFile model(row_with("0.99", "0.97"));
    std::vector<std::string> arguments{model.path(), "--closed", "B",       "--input",  "carrier=-100",
                                       "--output",   "ring",     "--speed", "carrier=1"};
    const Said said = statics(arguments);
    EXPECT_EQ(said.exit_code, 1) << said.err;
    EXPECT_EQ(said.err, "");
    EXPECT_NE(said.out.find("no consistent directions of power were found"), std::string::npos) << said.out;
    arguments.push_back("--json");
    const Said json = statics(arguments);
    EXPECT_EQ(json.exit_code, 1) << json.err;
    EXPECT_FALSE(nlohmann::json::parse(json.out).at("directions_settled").get<bool>());
}

TEST(StaticsCommand, AtRestNoEfficiencyIsPrintedAndLossesAreSaidToBeOpen) {
    const std::vector<std::string> arguments{wt,        "--closed", "C1,C3",  "--input",
                                             "input=1", "--speed",  "input=0"};
    Said said = statics(arguments);
    EXPECT_EQ(said.exit_code, 0) << said.err;
    EXPECT_EQ(
        last_lines(said.out),
        "output torque -1.5230 Nm, at rest\n"
        "losses at rest are not determined: row1 row2 row3 may take any up to their limit, either way; the "
        "torques shown are those without\n");
    auto as_json = arguments;
    as_json.push_back("--json");
    const auto answer = nlohmann::json::parse(statics(as_json).out);
    EXPECT_TRUE(answer.at("at_rest").get<bool>());
    EXPECT_TRUE(answer.at("efficiency").is_null());
    EXPECT_TRUE(answer.at("ratio").is_null());
    EXPECT_EQ(answer.at("loss_at_rest"), nlohmann::json({"row1", "row2", "row3"}));
}

TEST(StaticsCommand, HeldMachineIsSolvedAtRest) {
    // Sun and carrier held, 30 on the ring: M = 30/2, and the brakes hold 15 and 45.
    const std::string text = row_with("-2", "0.96");
    const std::string brake = "clutches: {B: ",
                      second =
                          "clutches: {D: {a: carrier, b: housing, dry: {sliding_capacity_nm: "
                          "500, static_ratio: 1}, direct: {initial: 1}}, B: ";
    const ModelFile model(std::string(text).replace(text.find(brake), brake.size(), second));
    std::vector<std::string> arguments{model.path(), "--closed", "B,D",   "--input",
                                       "ring=30",    "--speed",  "ring=0"};
    const Said said = statics(arguments);
    EXPECT_EQ(said.exit_code, 0) << said.err;
    EXPECT_EQ(last_lines(said.out),
              "output held, at rest\n"
              "losses at rest are not determined: row may take any up to their limit, either way; the "
              "torques shown "
              "are those without\n");
    arguments.push_back("--json");
    const auto links = nlohmann::json::parse(statics(arguments).out).at("links");
    EXPECT_NEAR(links.at("B.a").get<double>(), -15, 1e-12);
    EXPECT_NEAR(links.at("D.a").get<double>(), 45, 1e-12);
    arguments.resize(5);
    EXPECT_EQ(
        statics(arguments).err,
        "shiftrig: statics \"row\": closed = B,D locks node \"ring\": over-determined, it cannot turn; speed "
        "ring = 0 asks for the torques at rest\n");
}

// 70674.47 Nm at the wheels are 75587.67 N at their rolling radius of 0.935 m.
TEST(StaticsCommand, TranslatingNodesAreInNewtonsAndMetresPerSecond) {
    const std::string tractor = SHIFTRIG_SOURCE_DIR "/config/tractor.yaml";
    std::vector<std::string> arguments{tractor,       "--closed", "Fc,F2",  "--input",
                                       "engine=1000", "--output", "vehicle"};
    const Said said = statics(arguments);
    EXPECT_EQ(said.exit_code, 0) << said.err;
    EXPECT_NE(said.out.find("tyre.a                wheels   70674.4723  Nm   0.0126  rad/s\n"),
              std::string::npos)
        << said.out;
    EXPECT_NE(said.out.find("tyre.b               vehicle  -75587.6709   N   0.0118    m/s\n"),
              std::string::npos)
        << said.out;
    EXPECT_EQ(last_lines(said.out), "output torque -75587.6709 N, ratio 84.8303 rad/m, efficiency 0.8910\n");
    arguments.push_back("--json");
    const auto answer = nlohmann::json::parse(statics(arguments).out);
    EXPECT_EQ(answer.at("link_units").at("tyre.a"), "Nm");
    EXPECT_EQ(answer.at("link_units").at("tyre.b"), "N");
    EXPECT_EQ(answer.at("nodes").at("vehicle").at("speed_unit"), "m/s");
    EXPECT_EQ(answer.at("nodes").at("wheels").at("torque_unit"), "Nm");
    EXPECT_EQ(answer.at("output_torque_unit"), "N");
    EXPECT_EQ(answer.at("ratio_unit"), "rad/m");
}

// Two shafts side by side, 2000 and 3000: 30 is 12 and 18.
TEST(StaticsCommand, LoopOfShaftsIsSharedByStiffness) {
    const ModelFile model(R"(
name: loop
masses: {A: {inertia_kg_m2: 1}, B: {inertia_kg_m2: 1}}
shafts:
  s1: {a: A, b: B, stiffness_nm_per_rad: 2000, damping_nm_s_per_rad: 1}
  s2: {a: A, b: B, stiffness_nm_per_rad: 3000, damping_nm_s_per_rad: 1}
input_mass: A
output_mass: B
)");
    const Said said = statics({model.path(), "--input", "A=30"});
    EXPECT_EQ(said.exit_code, 0) << said.err;
    EXPECT_NE(said.out.find("s1.a     A   12.0000  Nm"), std::string::npos) << said.out;
    EXPECT_NE(said.out.find("s2.a     A   18.0000  Nm"), std::string::npos) << said.out;
    EXPECT_EQ(last_lines(said.out),
              "output torque -30.0000 Nm, ratio 1.0000, efficiency 1.0000\n"
              "loop: s1 s2 share by the stiffness of the shafts, untwisted without load\n");
}

}  // namespace
}  // namespace shiftrig
