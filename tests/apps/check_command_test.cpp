#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "tests/apps/program.h"

namespace shiftrig {
namespace {

using test::run_program;
using test::Said;

const std::string config = SHIFTRIG_SOURCE_DIR "/config/";

Said check(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "check");
    return run_program(SHIFTRIG_PROGRAM, arguments);
}

nlohmann::json checked(const std::string& model) {
    const Said said = check({config + model, "--json"});
    EXPECT_EQ(said.exit_code, 0) << said.err;
    return nlohmann::json::parse(said.out);
}

const nlohmann::json& gear(const nlohmann::json& answer, const std::string& name) {
    for (const auto& candidate : answer.at("gears"))
        if (candidate.at("name") == name) return candidate;
    throw std::runtime_error("no gear " + name);
}

// ---- natural frequencies, another way ------------------------------------------------------------------

// A free chain of five inertias joined by four springs. The number of frequencies below f is the number of
// negative pivots of K − ω²M (Sturm), so each frequency is bracketed by bisection to rounding.
class Chain {
  public:
    Chain(std::array<double, 5> inertia, std::array<double, 4> stiffness)
        : inertia_(inertia), stiffness_(stiffness) {}

    // The i-th frequency [Hz], the rigid motion being number 0.
    double frequency(int i) const {
        double low = 0, high = 1e4;
        for (int step = 0; step < 200; ++step) {
            const double middle = 0.5 * (low + high);
            (below(middle) > i ? high : low) = middle;
        }
        return low;
    }

  private:
    int below(double hertz) const {
        const double square = std::pow(2 * std::numbers::pi * hertz, 2);
        int negative = 0;
        double pivot = 0;
        for (std::size_t j = 0; j < 5; ++j) {
            const double left = j > 0 ? stiffness_[j - 1] : 0, right = j < 4 ? stiffness_[j] : 0;
            pivot = left + right - square * inertia_[j] - (j > 0 ? left * left / pivot : 0);
            negative += pivot < 0;
        }
        return negative;
    }
    std::array<double, 5> inertia_;
    std::array<double, 4> stiffness_;
};

// The reference tractor with Fc and one powershift clutch closed, everything brought to the engine's speed by
// hand: [engine, disc] –damper– [input, pinions, outputs] –pinion shaft– [crown, axle input] –axle– [wheels]
// –tyre– [vehicle].
Chain tractor_chain(double powershift, double range) {
    const double at_output = powershift, at_range = powershift * range,
                 at_wheel = powershift * range * 41 / 9 * 5;
    // Pinions turn with the powershift output at their own ratios, whichever clutch is closed.
    double group = 0.30 + (0.25) / std::pow(at_output, 2) + 0.05 / std::pow(at_range, 2);
    for (const double own : {41. / 30, 38. / 33, 35. / 36, 32. / 39, -1.435})
        group += 0.02 * std::pow(own / at_output, 2);
    const double radius = 0.935, weight = 137293.1, relaxation = 0.6;
    // Brixius: net traction over slip at slip 0, through the relaxation length a spring at the wheel.
    const double slope = 0.88 * (1 - std::exp(-0.1 * 55)) * 7.5;
    const double tyre = slope * weight * radius * radius / relaxation;
    return Chain(
        {2.6 + 0.15, group, 1.0 / std::pow(at_range, 2) + 5.0 / std::pow(at_wheel, 2),
         550 / std::pow(at_wheel, 2), 14000 * radius * radius / std::pow(at_wheel, 2)},
        {12000, 80000 / std::pow(at_range, 2), 2.8e6 / std::pow(at_wheel, 2), tyre / std::pow(at_wheel, 2)});
}

struct Expected {
    const char* gear;
    double powershift, ratio, kmh_1800, kmh_2100;
    std::array<double, 4> modes;  // of the lumped model
};

// Computed from the tractor's data, range M.
constexpr std::array expected{Expected{"F1", 41. / 30, 94.14, 6.74, 7.86, {1.60, 13.4, 26.9, 50.3}},
                              Expected{"F2", 38. / 33, 79.32, 8.00, 9.33, {1.69, 13.4, 25.4, 51.0}},
                              Expected{"F3", 35. / 36, 66.97, 9.48, 11.05, {1.80, 13.4, 23.9, 51.7}},
                              Expected{"F4", 32. / 39, 56.52, 11.23, 13.10, {1.92, 13.3, 22.3, 52.3}}};

TEST(CheckCommand, GearTableOfTheTractorIsTheComputedOne) {
    const auto answer = checked("tractor.yaml");
    EXPECT_EQ(answer.at("gears").size(), 15u);  // F1…F4, FR in L, M, H
    for (const auto& row : expected) {
        const auto& found = gear(answer, std::string(row.gear) + "/M");
        EXPECT_NEAR(found.at("ratio").get<double>() / row.ratio, 1, 0.005) << row.gear;
        EXPECT_NEAR(found.at("kmh_at_1800_rpm").get<double>() / row.kmh_1800, 1, 0.005) << row.gear;
        EXPECT_NEAR(found.at("kmh_at_2100_rpm").get<double>() / row.kmh_2100, 1, 0.005) << row.gear;
    }
}

TEST(CheckCommand, NaturalFrequenciesAreThoseOfTheReducedChain) {
    const auto answer = checked("tractor.yaml");
    const std::map<std::string, double> ranges{{"L", 6.048}, {"M", 3.024}, {"H", 1.008}};
    for (const auto& row : expected)
        for (const auto& [range, ratio] : ranges) {
            const auto modes =
                gear(answer, std::string(row.gear) + "/" + range).at("modes_hz").get<std::vector<double>>();
            const Chain chain = tractor_chain(row.powershift, ratio);
            ASSERT_EQ(modes.size(), 4u);
            for (std::size_t i = 0; i < 4; ++i)
                EXPECT_NEAR(modes[i] / chain.frequency(static_cast<int>(i) + 1), 1, 1e-6)
                    << row.gear << range << i;
        }
}

TEST(CheckCommand, NaturalFrequenciesAreWithinEightPercentOfTheLumpedTable) {
    const auto answer = checked("tractor.yaml");
    for (const auto& row : expected) {
        const auto modes =
            gear(answer, std::string(row.gear) + "/M").at("modes_hz").get<std::vector<double>>();
        for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(modes.at(i) / row.modes[i], 1, 0.08) << row.gear << i;
    }
}

TEST(CheckCommand, RatiosOfTheWtGearboxAreTheComputedOnes) {
    const auto answer = checked("wt_gearbox.yaml");
    const std::map<std::string, double> ratios{{"I", 3.4090}, {"II", 2.1571}, {"III", 1.5230}, {"IV", 1.0000},
                                               {"V", 0.6283}, {"VI", 0.5197}, {"R", -3.0065}};
    for (const auto& [name, ratio] : ratios)
        EXPECT_NEAR(gear(answer, name).at("ratio").get<double>(), ratio, 5e-5) << name;
}

TEST(CheckCommand, DistributionMatrixOfFigureFiveIsTheArticles) {
    const auto matrix = checked("article_fig5.yaml").at("distribution_matrix");
    EXPECT_EQ(matrix.at("masses"), nlohmann::json({"J1", "J2", "J3", "J4"}));
    EXPECT_EQ(matrix.at("devices"), nlohmann::json({"F1", "F2", "D", "E", "K"}));
    const double u = -2;
    const std::vector<std::vector<double>> article{
        {1, 0, 1, 0, 0}, {-1, 1, -u, 0, 0}, {0, 0, -(1 - u), 1, 1}, {0, 0, 0, -1, -1}};
    EXPECT_EQ(matrix.at("values").get<std::vector<std::vector<double>>>(), article);
}

TEST(CheckCommand, ASecondPowershiftClutchBlocksTheOutput) {
    const auto tie_ups = checked("tractor.yaml").at("tie_ups");
    std::map<std::string, std::vector<std::string>> blocking;
    for (const auto& tie_up : tie_ups)
        if (tie_up.at("blocks").get<bool>()) blocking[tie_up.at("gear")].push_back(tie_up.at("with"));
    EXPECT_EQ(blocking.at("F1"), (std::vector<std::string>{"F2", "F3", "F4", "FR", "brake"}));
    EXPECT_EQ(blocking.at("FR"), (std::vector<std::string>{"F1", "F2", "F3", "F4", "brake"}));
}

TEST(CheckCommand, ALoopOfClosedDevicesIsNamed) {
    // Two clutches side by side between the same masses: closed together, nobody can say which one carries.
    const auto path = std::filesystem::temp_directory_path() / "shiftrig_loop.yaml";
    std::ofstream(path)
        << "name: loop\n"
           "masses: {in: {inertia_kg_m2: 1}, out: {inertia_kg_m2: 1}}\n"
           "clutches:\n"
           "  A: &pair {a: in, b: out, dry: {sliding_capacity_nm: 10, static_ratio: 1}, direct: {}}\n"
           "  B: *pair\n"
           "gear_paths: {one: {closed: [A]}}\n"
           "input_mass: in\n"
           "output_mass: out\n";
    const Said said = check({path.string(), "--json"});
    std::filesystem::remove(path);
    ASSERT_EQ(said.exit_code, 0) << said.err;
    const auto tie_ups = nlohmann::json::parse(said.out).at("tie_ups");
    ASSERT_EQ(tie_ups.size(), 1u);
    EXPECT_EQ(tie_ups[0], nlohmann::json({{"gear", "one"},
                                          {"with", "B"},
                                          {"blocks", false},
                                          {"loops", nlohmann::json::parse(R"([["A", "B"]])")}}));
}

TEST(CheckCommand, EveryShippedModelPasses) {
    for (const auto& entry : std::filesystem::directory_iterator(config)) {
        if (entry.path().extension() != ".yaml" ||
            test::whole(entry.path()).find("\nmasses:") == std::string::npos)
            continue;  // not a model
        const Said said = check({entry.path().string()});
        EXPECT_EQ(said.exit_code, 0) << said.err;
        EXPECT_EQ(said.err, "");
        EXPECT_NE(said.out.find("natural frequencies"), std::string::npos);
    }
}

TEST(CheckCommand, DrawsEveryMassAndDevice) {
    const auto folder = std::filesystem::temp_directory_path() / "shiftrig_drawing";
    std::filesystem::create_directories(folder);
    const std::string svg = (folder / "t.svg").string(), dot = (folder / "t.dot").string();
    const Said said = check({config + "tractor.yaml", "--svg", svg, "--dot", dot});
    EXPECT_EQ(said.exit_code, 0) << said.err;
    const std::string drawing = test::whole(svg), graph = test::whole(dot);
    std::filesystem::remove_all(folder);
    for (const char* name :
         {"mass-engine", "mass-vehicle", "device-Fc", "device-F4", "device-P4", "device-range", "device-axle",
          "device-tyre", "device-brake", "device-engine", "device-plough"})
        EXPECT_NE(drawing.find("<g id=\"" + std::string(name) + "\""), std::string::npos) << name;
    EXPECT_NE(drawing.find(">FR/H<"), std::string::npos);  // the gear table
    EXPECT_EQ(graph.rfind("graph \"reference tractor\" {", 0), 0u);
    EXPECT_NE(graph.find("label=\"range\\nu 3.024\""), std::string::npos);
}

TEST(CheckCommand, SaysWhichEngineIntegratesTheMachineAndWhy) {
    const auto answer = checked("tractor.yaml");
    EXPECT_EQ(answer.at("engine"), "etd3");
    EXPECT_EQ(answer.at("engine_reason"), "17 speeds and twists");
    const Said said = check({config + "tractor.yaml"});
    EXPECT_EQ(said.out.substr(0, said.out.find('\n')),
              "reference tractor (14 masses, 20 devices, integrated by etd3: 17 speeds and twists)");
}

// ---- warnings ------------------------------------------------------------------------------------------

// What is said of a model written into a file, each test's its own: they run side by side.
std::string printed(const std::string& text, std::vector<std::string> options = {}) {
    const std::string test = testing::UnitTest::GetInstance()->current_test_info()->name();
    const auto path = std::filesystem::temp_directory_path() / ("shiftrig_" + test + ".yaml");
    std::ofstream(path) << text;
    options.insert(options.begin(), path.string());
    const Said said = check(options);
    std::filesystem::remove(path);
    EXPECT_EQ(said.exit_code, 0) << said.err;
    return said.out;
}

nlohmann::json checked_text(const std::string& text, std::vector<std::string> options = {}) {
    options.push_back("--json");
    return nlohmann::json::parse(printed(text, options));
}

TEST(CheckCommand, ShippedModelsWarnOfNothingButResonances) {
    for (const auto& entry : std::filesystem::directory_iterator(config)) {
        if (entry.path().extension() != ".yaml" ||
            test::whole(entry.path()).find("\nmasses:") == std::string::npos)
            continue;  // not a model
        for (const auto& warning : checked(entry.path().filename()).at("warnings"))
            EXPECT_NE(warning.get<std::string>().find("engine order 3 meets the mode"), std::string::npos)
                << entry.path() << ": " << warning;
    }
}

TEST(CheckCommand, StatesOfAMachineWithoutGearPathsAreListedAndMetByTheEnginesOrder) {
    const auto answer = checked_text(R"(name: engine on a shaft
masses: {engine: {inertia_kg_m2: 2}, load: {inertia_kg_m2: 5}, tail: {inertia_kg_m2: 5}}
shafts: {s: {a: engine, b: load, stiffness_nm_per_rad: 200000, damping_nm_s_per_rad: 2}}
clutches: {K: {a: load, b: tail, dry: {sliding_capacity_nm: 10, static_ratio: 1}, direct: {}, initially_locked: true}}
engines:
  e: {mass: engine, full_load_rpm_nm: [[700, 500], [2000, 500]], governor_slope_nm_s_per_rad: 100,
      low_idle_rpm: 800, high_idle_rpm: 2500, friction_constant_nm: 50, friction_per_speed_nm_s_per_rad: 0.3,
      actuator_lag_s: 0.04, turbo_instant_fraction: 1, turbo_lag_s: 0.5, fade_from_rpm: 700, fade_to_rpm: 500,
      stall_speed_rpm: 400, cylinders: 4}
)");
    const auto& states = answer.at("states");
    ASSERT_EQ(states.size(), 2u);
    EXPECT_EQ(states[0].at("name"), "all closed");  // which is how it starts
    EXPECT_EQ(states[0].at("closed"), nlohmann::json{"K"});
    EXPECT_EQ(states[1].at("name"), "all open");
    EXPECT_EQ(states[1].at("modes_hz"), answer.at("open").at("modes_hz"));
    EXPECT_EQ(answer.at("modes").at("all closed").size(), 1u);
    EXPECT_EQ(answer.at("warnings"),
              nlohmann::json(
                  {"all closed: engine order 2 meets the mode at 55.1 Hz at 1654 rpm (damping ratio 0.00)",
                   "all open: engine order 2 meets the mode at 59.6 Hz at 1787 rpm (damping ratio 0.00)"}));
}

TEST(CheckCommand, WhatStepsDoNotResolveDependsOnTheRate) {
    const std::string text = R"(name: stiff and light
masses: {a: {inertia_kg_m2: 1}, t: {inertia_kg_m2: 1.0e-5}, b: {inertia_kg_m2: 1}}
shafts:
  s: &shaft {a: a, b: t, stiffness_nm_per_rad: 30000, damping_nm_s_per_rad: 0.001}
  r: {<<: *shaft, a: t, b: b}
clutches: {K: {a: t, b: housing, dry: {sliding_capacity_nm: 1, static_ratio: 1.2}, direct: {}}}
)";
    EXPECT_EQ(checked_text(text).at("warnings").size(), 1u);
    EXPECT_EQ(checked_text(text, {"--rate-hz", "2500"}).at("warnings").size(), 0u);
    EXPECT_EQ(check({config + "tractor.yaml", "--rate-hz", "0"}).exit_code, 2);
}

// ---- loops ---------------------------------------------------------------------------------------------

TEST(CheckCommand, LoopsAreListedApartAndThoseOfOneMoreClutchAreItsOwn) {
    const auto answer = checked_text(R"(name: two loops
masses: {in: {inertia_kg_m2: 1}, mid: {inertia_kg_m2: 1}, out: {inertia_kg_m2: 1}}
clutches:
  A: &pair {a: in, b: mid, dry: {sliding_capacity_nm: 10, static_ratio: 1}, direct: {}}
  B: *pair
  C: &other {<<: *pair, a: mid, b: out}
  D: *other
  E: *other
gear_paths: {one: {closed: [A, B, C, D]}}
input_mass: in
output_mass: out
)");
    const auto& tie_ups = answer.at("tie_ups");
    ASSERT_EQ(tie_ups.size(), 2u);
    EXPECT_EQ(tie_ups[0].at("loops"), nlohmann::json::parse(R"([["A", "B"], ["C", "D"]])"));
    EXPECT_EQ(tie_ups[1].at("with"), "E");
    ASSERT_EQ(tie_ups[1].at("loops").size(), 1u);
    const auto loop = tie_ups[1].at("loops")[0].get<std::vector<std::string>>();
    ASSERT_EQ(loop.size(), 2u);
    EXPECT_TRUE(loop[0] == "C" || loop[0] == "D");
    EXPECT_EQ(loop[1], "E");
    EXPECT_EQ(answer.at("warnings").size(), 2u);
}

TEST(CheckCommand, ALoopOfShaftsIsNoTieUpAndAClutchOutsideIsNotSaidToCloseIt) {
    const auto answer = checked_text(R"(name: parallel shafts
masses: {a: {inertia_kg_m2: 1}, o: {inertia_kg_m2: 3}}
shafts:
  s: &shaft {a: a, b: o, stiffness_nm_per_rad: 2000, damping_nm_s_per_rad: 1}
  t: *shaft
clutches: {B: {a: o, b: housing, dry: {sliding_capacity_nm: 50, static_ratio: 1.2}, direct: {}}}
gear_paths: {one: {closed: []}}
input_mass: a
output_mass: o
)");
    EXPECT_EQ(answer.at("warnings"), nlohmann::json::array());
    EXPECT_EQ(answer.at("tie_ups"),
              nlohmann::json(
                  {{{"gear", "one"}, {"with", "B"}, {"blocks", true}, {"loops", nlohmann::json::array()}}}));
}

// ---- modes with damping --------------------------------------------------------------------------------

TEST(CheckCommand, DampedModesStandBesideTheUndampedWhereTheyDiffer) {
    const std::string text = R"(name: held by a damper
masses: {a: {inertia_kg_m2: 2}, b: {inertia_kg_m2: 0.5}}
shafts: {s: {a: a, b: b, stiffness_nm_per_rad: 444132, damping_nm_s_per_rad: 1}}
dampers: {D: {a: b, b: housing, damping_nm_s_per_rad: STRENGTH}}
)";
    const auto with = [&](const std::string& strength) {
        std::string changed = text;
        return changed.replace(changed.find("STRENGTH"), 8, strength);
    };
    const auto open = checked_text(with("20000")).at("open");
    EXPECT_NEAR(open.at("modes_hz")[0].get<double>(), 167.7, 0.05);
    ASSERT_EQ(open.at("damped_modes").size(), 1u);
    EXPECT_NEAR(open.at("damped_modes")[0].at("frequency_hz").get<double>(), 75.0, 0.05);
    EXPECT_NEAR(open.at("damped_modes")[0].at("damping_ratio").get<double>(), 0.024, 5e-4);
    const std::string heading = "with damping, where that shifts one by more than 1 %, Hz (damping ratio)\n";
    const std::string strong = printed(with("20000")), weak = printed(with("2"));
    EXPECT_NE(strong.find("\nnatural frequencies, undamped, Hz\n  all open  167.7\n\n" + heading +
                          "  all open  75.02 (0.02)\n"),
              std::string::npos)
        << strong;
    EXPECT_EQ(weak.find(heading), std::string::npos) << weak;
}

// ---- what is wrong ---------------------------------------------------------------------------------------

TEST(CheckCommand, AWrongModelIsOneLineAndCodeTwo) {
    const auto path = std::filesystem::temp_directory_path() / "shiftrig_wrong.yaml";
    std::string text = test::whole(config + "two_mass.yaml");
    text.replace(text.find("inertia_kg_m2: 2.6"), 18, "inertia_kg_m2: -2.6");
    std::ofstream(path) << text;
    const Said said = check({path.string()});
    std::filesystem::remove(path);
    EXPECT_EQ(said.exit_code, 2);
    EXPECT_EQ(said.out, "");
    EXPECT_EQ(said.err, path.string() + ":8:12: mass \"engine\": inertia_kg_m2 = -2.6; must be > 0\n");
}

TEST(CheckCommand, AnEngineThatCannotTakeTheMachineSaysWhatIsInItsWay) {
    const auto path = std::filesystem::temp_directory_path() / "shiftrig_row.yaml";
    const std::string text = test::whole(config + "article_fig5.yaml");
    std::ofstream(path) << "method: ark3\n" << text;
    const Said said = check({path.string()});
    std::filesystem::remove(path);
    EXPECT_EQ(said.exit_code, 2);
    EXPECT_EQ(
        said.err,
        path.string() + ":1:1: method = ark3 needs a machine without loops: row \"D\" joins three masses\n");
}

TEST(CheckCommand, WrongUsageIsCodeTwo) {
    EXPECT_EQ(check({}).exit_code, 2);
    EXPECT_EQ(check({"nosuch.yaml"}).err, "nosuch.yaml: cannot be read: No such file or directory\n");
    EXPECT_EQ(check({"nosuch.yaml"}).exit_code, 2);
    EXPECT_EQ(check({config + "tractor.yaml", "--bogus"}).exit_code, 2);
    EXPECT_EQ(run_program(SHIFTRIG_PROGRAM, {}).exit_code, 2);
    EXPECT_EQ(run_program(SHIFTRIG_PROGRAM, {"bogus"}).exit_code, 2);
}

TEST(CheckCommand, EveryCommandHasHelp) {
    const Said said = run_program(SHIFTRIG_PROGRAM, {"--help"});
    EXPECT_EQ(said.exit_code, 0);
    for (const char* command : {"check", "statics"}) {
        EXPECT_NE(said.out.find(command), std::string::npos);
        const Said help = run_program(SHIFTRIG_PROGRAM, {command, "--help"});
        EXPECT_EQ(help.exit_code, 0);
        EXPECT_NE(help.out.find("Usage: shiftrig " + std::string(command)), std::string::npos);
    }
}

}  // namespace
}  // namespace shiftrig
