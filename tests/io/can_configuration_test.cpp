// The DBC and the mapping that make a link: what is read, and what is refused with its place.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>

#include "io/can/codec.h"
#include "io/can/inprocess.h"
#include "io/can/link.h"
#include "io/input_error.h"
#include "tests/io/can_rig_signals.h"

namespace shiftrig::io::can {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr double kRpm = std::numbers::pi / 30;

// A mapping of a small 11-bit bus, with the line under test at a known place.
class Configuration : public testing::Test {
  protected:
    void SetUp() override {
        folder_ = std::filesystem::temp_directory_path() / ("shiftrig_can_" + std::to_string(::getpid()));
        std::filesystem::create_directories(folder_);
        std::ofstream(folder_ / "small.dbc")
            << "BU_: Tcu Rig\n"
               "BO_ 256 Command: 8 Tcu\n SG_ P : 7|16@0+ (0.01,0) [0|30] \"bar\" Rig\n SG_ Count : 56|8@1+ "
               "(1,0) [0|255] \"\" Rig\n"
               " SG_ Crc : 48|8@1+ (1,0) [0|255] \"\" Rig\n SG_ Strange : 24|8@1+ (1,0) [0|255] \"furlong\" "
               "Rig\n"
               "BO_ 257 Speeds: 8 Rig\n SG_ Page M : 0|8@1+ (1,0) [0|1] \"\" Tcu\n SG_ Engine m0 : 8|32@1- "
               "(1,0) [0|0] \"rpm\" Tcu\n"
               " SG_ Wheels m1 : 8|16@1- (0.1,0) [0|0] \"rpm\" Tcu\n"
               "SIG_VALTYPE_ 257 Engine : 1;\nBA_DEF_ BO_ \"GenMsgCycleTime\" INT 0 65535;\nBA_DEF_DEF_ "
               "\"GenMsgCycleTime\" 10;\n";
    }
    void TearDown() override { std::filesystem::remove_all(folder_); }
    Mapping read(const std::string& messages) {
        std::ofstream(folder_ / "small.yaml") << "dbc: small.dbc\nrig_nodes: [Rig]\nmessages:\n" << messages;
        return read_mapping((folder_ / "small.yaml").string());
    }
    std::string error_of(const std::string& messages) {
        try {
            const Mapping mapping = read(messages);
            InProcessBus bus(2);
            SignalTable table = rig_signals();
            CanLink link(mapping, bus.end(0), table);
        } catch (const InputError& error) {
            std::string text = error.what();
            for (const std::string folder = folder_.string() + "/"; text.find(folder) != std::string::npos;)
                text.erase(text.find(folder), folder.size());
            return text;
        }
        return "accepted";
    }
    std::filesystem::path folder_;
};

TEST_F(Configuration, AFolderOrAnEmptyFileIsNoDbcAndNoMapping) {
    const auto refusal = [this](const auto& read_one, const std::string& name) {
        try {
            read_one((folder_ / name).string());
        } catch (const InputError& error) {
            return std::string(error.what()).substr(folder_.string().size());
        }
        return std::string("accepted");
    };
    std::filesystem::create_directory(folder_ / "folder");
    std::ofstream(folder_ / "empty") << "";
    EXPECT_EQ(refusal(dbc::read, "folder"), "/folder: cannot be read: Is a directory");
    EXPECT_EQ(refusal(dbc::read, "empty"), "/empty: has no messages; is it a DBC file?");
    EXPECT_EQ(refusal(dbc::read, "none"), "/none: cannot be read: No such file or directory");
    EXPECT_EQ(refusal(read_mapping, "folder"), "/folder: cannot be read: Is a directory");
    EXPECT_EQ(refusal(read_mapping, "empty"), "/empty:1:1: the file is empty");
    // By way of a mapping, too.
    std::ofstream(folder_ / "mapping.yaml") << "dbc: folder\nrig_nodes: [Rig]\nmessages: {}\n";
    EXPECT_EQ(refusal(read_mapping, "mapping.yaml"), "/folder: cannot be read: Is a directory");
}

TEST_F(Configuration, ElevenBitControllersWithMotorolaCrcAndMultiplexingWork) {
    const Mapping mapping = read(
        "  Command:\n    command: true\n    counter: {signal: Count, modulo: 256}\n"
        "    checksum: {signal: Crc, formula: crc8_j1850}\n    signals: {P: clutch.F1.pressure_command}\n"
        "  Speeds:\n    signals: {Engine: sensor.engine.speed, Wheels: sensor.wheels.speed}\n");
    InProcessBus bus(2);
    SignalTable rig = rig_signals(), tcu;
    CanLink rig_link(mapping, bus.end(0), rig),
        tcu_link(mapping, bus.end(1), tcu, {.role = Role::controller});
    value(tcu, "clutch.F1.pressure_command") = 17.25e5;
    value(rig, "sensor.engine.speed") = 1800 * kRpm;
    value(rig, "sensor.wheels.speed") = -30 * kRpm;
    for (int ms = 0; ms < 50; ++ms) {
        for (auto* link : {&rig_link, &tcu_link}) {
            auto& table = link == &rig_link ? rig : tcu;
            link->receive(ms * kMs, table);
            link->send(ms * kMs, table);
        }
    }
    EXPECT_DOUBLE_EQ(value(rig, "clutch.F1.pressure_command"), 17.25e5);
    EXPECT_NEAR(value(tcu, "sensor.engine.speed"), 1800 * kRpm, 1e-4);
    EXPECT_NEAR(value(tcu, "sensor.wheels.speed"), -30 * kRpm, 1e-9);
    EXPECT_EQ(value(rig, "bus.Command.status"), 1);
}

TEST_F(Configuration, WhatIsWrongIsNamedWithItsPlace) {
    EXPECT_EQ(error_of("  Command:\n    signals:\n      P: mass.engine.speed\n"),
              "small.yaml:6:7: Command.P in \"bar\" wants a pressure [Pa], but mass.engine.speed is an "
              "angular speed [rad/s]");
    EXPECT_EQ(error_of("  Command:\n    signals:\n      P: clutch.F9.pressure_command\n"),
              "small.yaml:6:7: there is no signal \"clutch.F9.pressure_command\"; nearest: "
              "clutch.F1.pressure_command, "
              "clutch.F2.pressure_command, clutch.F3.pressure_command");
    EXPECT_EQ(error_of("  Command:\n    signals:\n      Q: mass.engine.speed\n"),
              "small.yaml:6:7: message Command has no signal \"Q\"");
    EXPECT_EQ(error_of("  Comand:\n    signals: {}\n"),
              "small.yaml:4:3: small.dbc has no message \"Comand\"");
    EXPECT_EQ(error_of("  Command:\n    timeout: 3\n"),
              "small.yaml:5:5: message Command: unknown key \"timeout\"");
    EXPECT_EQ(error_of("  Command:\n    timeout_ms: -3\n"),
              "small.yaml:5:17: timeout_ms = -3; must be within 0.001 and 86400000");
    EXPECT_EQ(error_of("  Command:\n    signals:\n      Strange: mass.engine.speed\n"),
              "small.yaml:6:7: Command.Strange: unit \"furlong\" is not known");
    EXPECT_EQ(
        error_of("  Speeds:\n    signals:\n      Wheels: {signal: engine.engine.torque, per: 12 bananas}\n"),
        "small.yaml:6:51: \"12 bananas\" is not a number with a unit, such as 1201 Nm");
    EXPECT_EQ(error_of("  Command:\n    checksum: {signal: Crc, formula: md5}\n"),
              "small.yaml:5:38: formula: \"md5\" is none of tsc1, xor8, sum8, crc8_j1850");
    EXPECT_EQ(error_of("  Command: [\n"), "small.yaml:5:1: end of sequence flow not found");
}

// The last one would count, or none of them.
TEST_F(Configuration, AKeyGivenTwiceIsRefused) {
    EXPECT_EQ(error_of("  Command: {timeout_ms: 3}\n  Command: {timeout_ms: 4}\n"),
              "small.yaml:5:3: messages: \"Command\" is given twice");
    EXPECT_EQ(error_of("  Command:\n    timeout_ms: 3\n    timeout_ms: 4\n"),
              "small.yaml:6:5: message Command: \"timeout_ms\" is given twice");
    EXPECT_EQ(
        error_of(
            "  Speeds:\n    signals:\n      Wheels: {signal: mass.engine.speed, is: 1, when: {Wheels: [2]}, "
            "otherwise: 0}\n"),
        "small.yaml:6:56: Speeds.Wheels: is and when exclude each other");
}

// What is written as another kind of thing would be read as nothing.
TEST_F(Configuration, AListAMapAndAWordAreToldApart) {
    EXPECT_EQ(error_of("  [Command]\n"), "small.yaml:4:3: messages: keys and values are wanted");
    EXPECT_EQ(error_of("  Command: {signals: P}\n"),
              "small.yaml:4:22: signals of Command: keys and values are wanted");
    EXPECT_EQ(error_of("  Command: {signals: [P]}\n"),
              "small.yaml:4:22: signals of Command: keys and values are wanted");
    EXPECT_EQ(error_of("  Command: {pin: source}\n"),
              "small.yaml:4:18: pin: a list is wanted, such as [a, b]");
    EXPECT_EQ(
        error_of("  Command: {signals: {P: {signal: clutch.F1.pressure_command, when: {Count: 1}, otherwise: "
                 "0}}}\n"),
        "small.yaml:4:69: Command.P: when must be {SIGNAL: [raw values]}");
    EXPECT_EQ(
        error_of(
            "  Command: {signals: {P: {signal: clutch.F1.pressure_command, when: {Count: []}, otherwise: "
            "0}}}\n"),
        "small.yaml:4:69: Command.P: when must be {SIGNAL: [raw values]}");
    EXPECT_EQ(error_of("  Command: {signals: {}}\ntrouble_codes: 5\n"),
              "small.yaml:5:16: trouble_codes: a list is wanted, such as [a, b]");
    EXPECT_EQ(error_of("  Command: {signals: }\n"), "accepted") << "nothing is an empty map";
    const auto error_of_all = [&](const std::string& whole) {
        try {
            parse_mapping(YAML::Load(whole), (folder_ / "small.yaml").string());
        } catch (const InputError& error) {
            return std::string(error.what()).substr(folder_.string().size() + 1);
        }
        return std::string("accepted");
    };
    EXPECT_EQ(error_of_all("dbc: {a: 1}\n"), "small.yaml:1:6: a name is wanted");
    EXPECT_EQ(error_of_all("dbc: small.dbc\nrig_nodes: Rig\nmessages: {}\n"),
              "small.yaml:2:12: rig_nodes: a list is wanted, such as [a, b]");
}

TEST_F(Configuration, TimesAndRatesAreBounded) {
    for (const char* wrong : {"inf", "1e300", "nan", "1e-7", "0", "86400001"})
        EXPECT_EQ(
            error_of(std::string("  Speeds: {cycle_ms: ") + wrong + "}\n"),
            std::string("small.yaml:4:22: cycle_ms = ") + wrong + "; must be within 0.001 and 86400000");
    EXPECT_EQ(error_of("  Speeds: {cycle_ms: 86400000}\n"), "accepted");
    EXPECT_EQ(error_of("  Speeds: {cycle_ms: 1e400}\n"), "small.yaml:4:22: \"1e400\" is not a number");
    EXPECT_EQ(error_of("  Speeds: {phase_ms: -1}\n"),
              "small.yaml:4:22: phase_ms = -1; must be within 0 and 86400000");
    EXPECT_EQ(error_of("  Speeds: {signals: {Engine: {constant: inf}}}\n"),
              "small.yaml:4:41: \"inf\" must be a finite number");
    EXPECT_EQ(error_of("  Speeds: {signals: {Engine: {signal: engine.engine.torque, per: inf Nm}}}\n"),
              "small.yaml:4:66: \"inf Nm\" is not a number with a unit, such as 1201 Nm");
    EXPECT_EQ(error_of("  Speeds: {}\nbit_rate: inf\n"),
              "small.yaml:5:11: bit_rate = inf; must be within 1000 and 1000000000");

    std::ofstream(folder_ / "small.dbc", std::ios::app) << "BA_ \"GenMsgCycleTime\" BO_ 257 1e300;\n";
    EXPECT_EQ(
        error_of("  Speeds: {}\n"),
        "small.yaml:4:3: message Speeds: GenMsgCycleTime = 1e+300 in small.dbc; must be within 0.001 and "
        "86400000, or be overruled by cycle_ms");
    EXPECT_EQ(error_of("  Speeds: {cycle_ms: 10}\n"), "accepted");
}

TEST_F(Configuration, AWrongTroubleCodeIsNamedWithItsPlace) {
    // Speeds of the rig as a J1939 message, so that it has an address.
    std::ofstream(folder_ / "small.dbc") << "BU_: Tcu Rig Mute\nBO_ 2566844672 Speeds: 8 Rig\n SG_ Engine : "
                                            "0|16@1+ (0.125,0) [0|8031.875] \"rpm\" Tcu\n";
    const std::string messages = "  Speeds:\n    signals: {Engine: sensor.engine.speed}\n",
                      head = messages + "trouble_codes:\n  - ";
    EXPECT_EQ(error_of(head + "{spn: 190, of: Rig, lamp: amber, fmi: {5: sensor.engine.dropout}}\n"),
              "accepted");
    EXPECT_EQ(error_of(head + "{spn: 190, of: Tcu, lamp: amber, fmi: {5: sensor.engine.dropout}}\n"),
              "small.yaml:7:20: trouble_codes: \"Tcu\" is none of the rig_nodes");
    EXPECT_EQ(error_of(head + "{spn: 600000, of: Rig, lamp: amber, fmi: {5: sensor.engine.dropout}}\n"),
              "small.yaml:7:11: 600000 must be 1…524287");
    EXPECT_EQ(error_of(head + "{spn: 190, of: Rig, lamp: amber, fmi: {32: sensor.engine.dropout}}\n"),
              "small.yaml:7:44: 32 must be 0…31");
    EXPECT_EQ(error_of(head + "{spn: 190, of: Rig, lamp: blue, fmi: {5: sensor.engine.dropout}}\n"),
              "small.yaml:7:31: lamp: \"blue\" is none of none, protect, amber, red, malfunction");
    EXPECT_EQ(
        error_of(head + "{spn: 190, of: Rig, lamp: amber, fmi: {5: sensor.engine.dropuot}}\n"),
        "small.yaml:7:47: trouble code SPN 190 FMI 5: there is no signal \"sensor.engine.dropuot\"; nearest: "
        "sensor.engine.dropout, sensor.engine.noise, sensor.engine.speed");
    EXPECT_EQ(
        error_of(head +
                 "{spn: 177, of: Rig, lamp: amber, fmi: {17: {signal: oil.temperature, below: 5 rpm}}}\n"),
        "small.yaml:7:48: trouble code SPN 177 FMI 17: oil.temperature is a temperature [°C], its limit is "
        "an "
        "angular speed [rad/s]");
    EXPECT_EQ(
        error_of(head + "{spn: 177, of: Rig, lamp: amber, fmi: {17: oil.temperature}}\n"),
        "small.yaml:7:48: trouble code SPN 177 FMI 17: oil.temperature is a temperature [°C], its limit is a "
        "plain number");
    EXPECT_EQ(error_of(head + "{spn: 177, of: Rig, lamp: amber, fmi: {17: {signal: oil.temperature}}}\n"),
              "small.yaml:7:48: trouble_codes: above or below is missing");
    EXPECT_EQ(
        error_of(
            head +
            "{spn: 190, of: Rig, lamp: amber, fmi: {5: sensor.engine.dropout, 5: sensor.engine.stuck}}\n"),
        "small.yaml:7:70: trouble_codes: SPN 190 FMI 5 of Rig stands in line 7 already");
    EXPECT_EQ(
        error_of("trouble_codes:\n  - {spn: 190, of: Rig, lamp: amber, fmi: {5: sensor.engine.dropout}}\n"),
        "small.yaml:5:44: trouble code SPN 190 FMI 5: Rig sends no J1939 message, so it has no address");
}

TEST_F(Configuration, ABusThatCannotCarryTheMessagesIsAWarningAtStart) {
    std::string messages = "  Speeds:\n    cycle_ms: 0.5\n    signals: {Engine: sensor.engine.speed}\n";
    InProcessBus bus(2);
    SignalTable table = rig_signals();
    CanLink link(read(messages), bus.end(0), table);
    EXPECT_NEAR(link.bus_load(), 135 / 250e3 / 0.5e-3, 1e-12);
    ASSERT_EQ(link.warnings().size(), 1U);
    EXPECT_NE(link.warnings()[0].find("250 kbit/s to 108 %"), std::string::npos) << link.warnings()[0];
}

}  // namespace
}  // namespace shiftrig::io::can
