// The link between a CAN port and the table of signals: meaning, timing, trust, lockstep.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <set>
#include <vector>

#include "io/can/codec.h"
#include "io/can/inprocess.h"
#include "io/can/link.h"
#include "io/input_error.h"
#include "tests/io/can_rig_signals.h"
#include "tests/io/count_allocations.h"

namespace shiftrig::io::can {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr double kRpm = std::numbers::pi / 30;

// A rig and a controller, each with its table and link, on one ideal in-process bus; and a third end to
// watch and to play the stranger.
struct TwoSides {
    Mapping mapping = tractor_mapping();
    InProcessBus bus{3};
    SignalTable rig = rig_signals(), tcu;
    CanLink rig_link{mapping, bus.end(0), rig, {.role = Role::rig}};
    CanLink tcu_link{mapping, bus.end(1), tcu, {.role = Role::controller}};

    void tick(std::int64_t now_ns, bool controller_lives = true) {
        rig_link.receive(now_ns, rig);
        rig_link.send(now_ns, rig);
        if (controller_lives) {
            tcu_link.receive(now_ns, tcu);
            tcu_link.send(now_ns, tcu);
        }
    }
    void run(int from_ms, int to_ms, bool controller_lives = true) {
        for (int ms = from_ms; ms < to_ms; ++ms) tick(ms * kMs, controller_lives);
    }
    double rig_value(const std::string& name) { return value(rig, name); }
    double tcu_value(const std::string& name) { return value(tcu, name); }
};

TEST(CanLink, CommandsOfTheControllerArriveInTheRigInItsUnits) {
    TwoSides sides;
    value(sides.tcu, "clutch.F2.pressure_command") = 11.5e5;
    value(sides.tcu, "clutch.FR.pressure_command") = 3.2e5;
    value(sides.tcu, "clutch.Fc.release_command") = 0.625;
    value(sides.tcu, "engine.engine.torque_limit") = 0.8;
    value(sides.tcu, "controller.current_gear") = 2;
    sides.run(0, 200);
    EXPECT_DOUBLE_EQ(sides.rig_value("clutch.F2.pressure_command"), 11.5e5);
    EXPECT_DOUBLE_EQ(sides.rig_value("clutch.FR.pressure_command"), 3.2e5);
    EXPECT_DOUBLE_EQ(sides.rig_value("clutch.F1.pressure_command"), 0);
    EXPECT_DOUBLE_EQ(sides.rig_value("clutch.Fc.release_command"), 0.625);
    EXPECT_DOUBLE_EQ(sides.rig_value("engine.engine.torque_limit"), 0.8);
    EXPECT_EQ(sides.rig_value("engine.engine.speed_request_enable"), 0);
    EXPECT_EQ(sides.rig_value("controller.current_gear"), 2);
    EXPECT_EQ(sides.rig_value("bus.ClutchCommandA.status"), 1);
    EXPECT_TRUE(sides.rig_link.command_valid());

    value(sides.tcu, "engine.engine.speed_request_enable") = 1;
    value(sides.tcu, "engine.engine.speed_request") = 1500 * kRpm;
    sides.run(200, 230);
    EXPECT_EQ(sides.rig_value("engine.engine.speed_request_enable"), 1);
    EXPECT_NEAR(sides.rig_value("engine.engine.speed_request"), 1500 * kRpm, 0.07 * kRpm);
    EXPECT_EQ(sides.rig_value("engine.engine.torque_limit"), 1) << "speed control: the limit is not meant";
}

TEST(CanLink, MeasurementsOfTheRigArriveInTheControllerWithinTheResolutionOfTheFrames) {
    TwoSides sides;
    value(sides.rig, "sensor.engine.speed") = 1801.3 * kRpm;
    value(sides.rig, "sensor.wheels.speed") = -22.4 * kRpm;  // reverse
    value(sides.rig, "clutch.F3.pressure") = 12.34567e5;
    value(sides.rig, "clutch.Fc.capacity") = 600;
    value(sides.rig, "engine.engine.torque") = 763;
    value(sides.rig, "driver.lever") = -1;
    value(sides.rig, "driver.throttle") = 0.728;
    value(sides.rig, "oil.temperature") = -12.5;
    value(sides.rig, "mass.vehicle.speed") = -2.2;
    sides.run(0, 1100);
    EXPECT_NEAR(sides.tcu_value("sensor.engine.speed"), 1801.3 * kRpm, 0.126 * kRpm);
    EXPECT_NEAR(sides.tcu_value("sensor.wheels.speed"), -22.4 * kRpm, 0.126 * kRpm)
        << "the signed frame, not the unsigned ones";
    EXPECT_NEAR(sides.tcu_value("clutch.F3.pressure"), 12.34567e5, 51);
    EXPECT_NEAR(sides.tcu_value("clutch.Fc.capacity"), 600, 2400 * 0.0006);
    EXPECT_NEAR(sides.tcu_value("engine.engine.torque"), 763, 1201 * 0.0051);
    EXPECT_EQ(sides.tcu_value("driver.lever"), -1);
    EXPECT_NEAR(sides.tcu_value("driver.throttle"), 0.728, 0.0021);
    EXPECT_NEAR(sides.tcu_value("oil.temperature"), -12.5, 0.016);
    EXPECT_NEAR(sides.tcu_value("mass.vehicle.speed"), 2.2, 0.00051) << "GBSD carries the magnitude";
}

TEST(CanLink, NotAvailableIsNaNForTheControllerAndErrorLeavesNoValue) {
    TwoSides sides;
    EXPECT_TRUE(std::isnan(sides.tcu_value("sensor.output.speed"))) << "before anything is heard";
    value(sides.rig, "sensor.output.speed") = std::nan("");
    value(sides.rig, "sensor.wheels.speed") = 3;
    sides.run(0, 20);
    EXPECT_TRUE(std::isnan(sides.tcu_value("sensor.output.speed")));
    EXPECT_NEAR(sides.tcu_value("sensor.wheels.speed"), 3, 0.02);
    value(sides.rig, "sensor.output.speed") = 50;
    sides.run(20, 40);
    EXPECT_NEAR(sides.tcu_value("sensor.output.speed"), 50, 0.02);
}

TEST(CanLink, EveryMessageIsSentAtItsCycleTimeAndNoTickCarriesMoreThanTwo) {
    TwoSides sides;
    std::map<std::uint32_t, std::vector<std::int64_t>> times;
    std::map<std::int64_t, int> per_tick;
    std::array<Frame, 64> frames;
    for (int ms = 0; ms < 4000; ++ms) {
        sides.rig_link.receive(ms * kMs, sides.rig);
        sides.rig_link.send(ms * kMs, sides.rig);
        const std::size_t count = sides.bus.end(2).receive(ms * kMs, frames);
        for (std::size_t i = 0; i < count; ++i) {
            times[frames[i].id].push_back(frames[i].timestamp_ns);
            ++per_tick[frames[i].timestamp_ns];
        }
    }
    for (const auto& message : sides.mapping.database.messages) {
        if (!sides.mapping.sent_by_rig(message)) {
            EXPECT_FALSE(times.contains(message.id)) << message.name;
            continue;
        }
        const auto& sent = times[message.id];
        const auto cycle = static_cast<std::int64_t>(message.cycle_time_ms()) * kMs;
        ASSERT_EQ(sent.size(), static_cast<std::size_t>(4000 * kMs / cycle)) << message.name;
        for (std::size_t i = 1; i < sent.size(); ++i) ASSERT_EQ(sent[i] - sent[i - 1], cycle) << message.name;
    }
    for (const auto& [time, count] : per_tick) ASSERT_LE(count, 2) << "at " << time;
    // 10 messages every 10 ms, 1 every 20, 2 every 50, 5 every 100, 1 and three DM1 every second, at most 160 bits each.
    EXPECT_NEAR(sides.rig_link.bus_load(), 1144 * 160 / 250e3, 1e-12);
    EXPECT_TRUE(sides.rig_link.warnings().empty());
}

// ---- trust ---------------------------------------------------------------------------------------------------

// A command frame A made by hand, as a stranger would with cansend.
Frame command_a(unsigned counter, double f1_kpa) {
    Frame frame;
    frame.id = 0x18FF1003;
    frame.extended = true;
    frame.length = 8;
    const auto raw = static_cast<unsigned>(std::lround(f1_kpa * 10));
    frame.data = {static_cast<std::uint8_t>(raw), static_cast<std::uint8_t>(raw >> 8), 0, 0, 0, 0, 0x07, 0};
    frame.data[7] =
        static_cast<std::uint8_t>(counter | tsc1_checksum(frame.id, frame.data.data(), counter) << 4);
    return frame;
}

struct RigAndStranger : TwoSides {
    MessageReport report() {
        for (const auto& message : rig_link.report())
            if (message.name == "ClutchCommandA") return message;
        return {};
    }
    void hear(const Frame& frame, std::int64_t now_ns) {
        bus.end(2).send(now_ns, frame);
        rig_link.receive(now_ns, rig);
    }
    double f1() { return rig_value("clutch.F1.pressure_command"); }
};

TEST(Trust, PgnIsMatchedWhateverPriorityAndSourceAddress) {
    RigAndStranger rig;
    Frame frame = command_a(0, 500);
    frame.id = 0x0CFF1027;
    frame.data[7] = static_cast<std::uint8_t>(tsc1_checksum(frame.id, frame.data.data(), 0) << 4);
    rig.hear(frame, 0);
    EXPECT_DOUBLE_EQ(rig.f1(), 5e5);
    rig.hear(
        [] {
            Frame other = command_a(1, 700);
            other.extended = false;
            other.id = 0x103;
            return other;
        }(),
        kMs);
    EXPECT_DOUBLE_EQ(rig.f1(), 5e5);
}

TEST(Trust, APinnedSourceAddressCounts) {
    Mapping mapping = tractor_mapping();
    for (auto& message : mapping.messages) message.pin_source = message.name == "ClutchCommandA";
    InProcessBus bus(2);
    SignalTable table = rig_signals();
    CanLink link(mapping, bus.end(0), table);
    Frame stranger = command_a(0, 500);
    stranger.id = 0x18FF1027;
    stranger.data[7] = static_cast<std::uint8_t>(tsc1_checksum(stranger.id, stranger.data.data(), 0) << 4);
    bus.end(1).send(0, stranger);
    link.receive(0, table);
    EXPECT_EQ(value(table, "clutch.F1.pressure_command"), 0);
    bus.end(1).send(1, command_a(0, 500));
    link.receive(1, table);
    EXPECT_DOUBLE_EQ(value(table, "clutch.F1.pressure_command"), 5e5);
}

TEST(Trust, AShortFrameAWrongChecksumARepeatedOrJumpingCounterAreRefusedAndCounted) {
    RigAndStranger rig;
    rig.hear(command_a(3, 500), 0);
    EXPECT_DOUBLE_EQ(rig.f1(), 5e5);
    EXPECT_EQ(rig.rig_value("bus.ClutchCommandA.status"), 1);

    Frame cut = command_a(4, 900);
    cut.length = 7;
    rig.hear(cut, 1 * kMs);
    EXPECT_EQ(rig.report().wrong_length, 1U);
    EXPECT_EQ(rig.rig_value("bus.ClutchCommandA.status"), 4);

    Frame flipped = command_a(4, 900);
    flipped.data[2] ^= 0x01;
    rig.hear(flipped, 2 * kMs);
    EXPECT_EQ(rig.report().wrong_checksum, 1U);

    rig.hear(command_a(3, 900), 3 * kMs);
    EXPECT_EQ(rig.report().wrong_counter, 1U) << "repeated";
    rig.hear(command_a(9, 900), 4 * kMs);
    EXPECT_EQ(rig.report().wrong_counter, 2U) << "six steps on";
    EXPECT_DOUBLE_EQ(rig.f1(), 5e5) << "none of them was believed";

    rig.hear(command_a(11, 600), 5 * kMs);
    EXPECT_DOUBLE_EQ(rig.f1(), 6e5);
    EXPECT_EQ(rig.report().missed, 1U);
    EXPECT_EQ(rig.rig_value("bus.ClutchCommandA.status"), 1);
}

TEST(Trust, AnErrorOrNotAvailableInAnEnabledSlotIsNoCommandAndADisabledSlotIsZero) {
    RigAndStranger rig;
    rig.hear(command_a(0, 500), 0);
    Frame none = command_a(1, 6553.5);  // 0xFFFF
    rig.hear(none, kMs);
    EXPECT_EQ(rig.report().implausible, 1U);
    EXPECT_DOUBLE_EQ(rig.f1(), 5e5);
    Frame off = command_a(2, 6553.5);
    off.data[6] = 0x06;  // F1 not enabled
    off.data[7] = static_cast<std::uint8_t>(2 | tsc1_checksum(off.id, off.data.data(), 2) << 4);
    rig.hear(off, 2 * kMs);
    EXPECT_EQ(rig.f1(), 0);
    EXPECT_EQ(rig.report().implausible, 1U);
}

// A field whose `when` is not met is nobody's business: torque of a TSC1 that asks for speed, and the other way round.
TEST(Trust, AFieldThatIsNotMeantCannotMakeAMessageImplausible) {
    TwoSides sides;
    sides.run(0, 20, false);
    unsigned counter = 0;
    const auto send = [&](int ms, std::uint8_t mode, std::uint16_t raw_speed, std::uint8_t raw_torque) {
        Frame frame;
        frame.id = 0x0C000003;
        frame.extended = true;
        frame.length = 8;
        const dbc::Message& layout = *sides.mapping.database.find("TSC1");
        const auto put = [&](const char* signal, std::uint64_t raw) {
            SignalCodec(*layout.find(signal), true).put(frame.data.data(), raw);
        };
        frame.data.fill(0xFF);
        put("OverrideControlMode", mode);
        put("RequestedSpeed", raw_speed);
        put("RequestedTorque", raw_torque);
        put("Counter", counter);
        put("Checksum", tsc1_checksum(frame.id, frame.data.data(), counter));
        counter = (counter + 1) % 8;
        sides.bus.end(2).send(ms * kMs, frame);
        sides.tick(ms * kMs, false);
    };
    const auto implausible = [&] {
        for (const auto& report : sides.rig_link.report())
            if (report.name == "TSC1") return report.implausible;
        return std::uint64_t{99};
    };
    send(20, 1, 12000, 0);  // 1500 rpm; the torque byte, were it meant, is −125 %
    EXPECT_EQ(sides.rig_value("engine.engine.speed_request_enable"), 1);
    EXPECT_NEAR(sides.rig_value("engine.engine.speed_request"), 1500 * kRpm, 1e-9);
    EXPECT_EQ(sides.rig_value("engine.engine.torque_limit"), 1);
    EXPECT_EQ(implausible(), 0U);

    send(30, 2, 12000, 0);  // here it is meant
    EXPECT_EQ(implausible(), 1U);
    EXPECT_EQ(sides.rig_value("engine.engine.speed_request_enable"), 1) << "the last one that was trusted";
}

TEST(Trust, SilenceEndsInLostWithinTheTimeoutAndFramesBringItBack) {
    TwoSides sides;
    value(sides.tcu, "clutch.F1.pressure_command") = 8e5;
    sides.run(0, 500);
    ASSERT_TRUE(sides.rig_link.command_valid());
    // The last frames came within the 10 ms before 500; so valid at least until 590 and no longer than 600.
    std::int64_t lost_ms = 0;
    bool was_late = false;
    for (int ms = 500; ms < 700 && lost_ms == 0; ++ms) {
        sides.tick(ms * kMs, false);
        was_late = was_late || sides.rig_value("bus.ClutchCommandA.status") == 2;
        if (!sides.rig_link.command_valid()) lost_ms = ms;
    }
    EXPECT_GE(lost_ms, 590);
    EXPECT_LE(lost_ms, 600);
    EXPECT_TRUE(was_late);
    sides.run(static_cast<int>(lost_ms), 700, false);
    EXPECT_EQ(sides.rig_value("bus.ClutchCommandA.status"), 3);
    EXPECT_EQ(sides.rig_value("bus.command_valid"), 0);
    EXPECT_DOUBLE_EQ(sides.rig_value("clutch.F1.pressure_command"), 8e5)
        << "a command holds: the safe command is not the link's";
    EXPECT_EQ(sides.rig_value("engine.engine.torque_limit"), 1);

    sides.run(700, 730);
    EXPECT_TRUE(sides.rig_link.command_valid());
    EXPECT_EQ(sides.rig_value("bus.ClutchCommandA.status"), 1);
}

TEST(Trust, ARigThatNeverHearsACommandSaysSoAfterOneTimeout) {
    TwoSides sides;
    for (int ms = 0; ms <= 100; ++ms) {
        sides.tick(ms * kMs, false);
        ASSERT_TRUE(sides.rig_link.command_valid()) << ms;
    }
    sides.tick(101 * kMs, false);
    EXPECT_FALSE(sides.rig_link.command_valid());
    EXPECT_EQ(sides.rig_value("bus.ClutchCommandA.status"), 0);
}

TEST(Trust, OneCommandFrameMadeByHandIsFollowedUntilItsTimeout) {
    RigAndStranger rig;
    rig.run(0, 500, false);
    ASSERT_FALSE(rig.rig_link.command_valid());
    rig.hear(command_a(0, 500), 500 * kMs);
    std::vector<int> valid_ms;
    for (int ms = 501; ms < 900; ++ms) {
        if (ms == 550) rig.bus.end(2).send(ms * kMs, command_a(0, 700));  // the same counter: not believed
        rig.tick(ms * kMs, false);
        if (rig.rig_link.command_valid()) valid_ms.push_back(ms);
    }
    // From a cycle and a half, in which messages B and C might still have come, to the timeout.
    ASSERT_EQ(valid_ms.size(), 86U);
    EXPECT_EQ(valid_ms.front(), 515);
    EXPECT_EQ(valid_ms.back(), 600);
    EXPECT_DOUBLE_EQ(rig.f1(), 5e5);
}

TEST(Trust, CommandsFromBeforeASilenceDoNotActWhenOnlyAnotherMessageReturns) {
    RigAndStranger rig;
    value(rig.tcu, "clutch.F1.pressure_command") = 8e5;
    value(rig.tcu, "clutch.F4.pressure_command") = 9e5;
    rig.run(0, 500);
    rig.run(500, 700, false);
    ASSERT_FALSE(rig.rig_link.command_valid());
    rig.hear(command_a(0, 500), 700 * kMs);
    for (int ms = 701; ms < 790; ++ms) {
        rig.tick(ms * kMs, false);
        if (rig.rig_link.command_valid()) {
            EXPECT_EQ(rig.rig_value("clutch.F4.pressure_command"), 0) << ms;
        }
    }
    EXPECT_TRUE(rig.rig_link.command_valid());
    EXPECT_DOUBLE_EQ(rig.f1(), 5e5);
}

TEST(Trust, ASingleCommandMessageThatFallsSilentIsALoss) {
    RigAndStranger rig;
    rig.run(0, 500);
    ASSERT_TRUE(rig.rig_link.command_valid());
    // From now on command A alone.
    for (int ms = 500; ms < 700; ++ms) {
        if (ms % 10 == 0) rig.bus.end(2).send(ms * kMs, command_a(static_cast<unsigned>(ms / 10) & 15U, 500));
        rig.tick(ms * kMs, false);
    }
    EXPECT_EQ(rig.rig_value("bus.ClutchCommandA.status"), 1);
    EXPECT_FALSE(rig.rig_link.command_valid()) << "B and C belong to what this controller sends";
}

// ---- lockstep --------------------------------------------------------------------------------------------------

TEST(Lockstep, TheAnswerEchoesTheQuestionAndArrivesAfterEverythingElseOfItsCycle) {
    TwoSides sides;
    sides.run(0, 50);
    std::array<Frame, 64> frames;
    sides.bus.end(2).receive(50 * kMs, frames);
    int questions = 0;
    for (int ms = 50; ms < 150; ++ms) {
        sides.rig_link.receive(ms * kMs, sides.rig);
        sides.rig_link.send(ms * kMs, sides.rig);
        if (!sides.rig_link.awaiting_answer()) continue;
        ++questions;
        sides.tcu_link.receive(ms * kMs, sides.tcu);
        EXPECT_TRUE(sides.tcu_link.question_pending());
        sides.tcu_link.send(ms * kMs, sides.tcu);
        EXPECT_FALSE(sides.tcu_link.question_pending());
        sides.rig_link.receive(ms * kMs, sides.rig);
        EXPECT_FALSE(sides.rig_link.awaiting_answer());
        const std::size_t count = sides.bus.end(2).receive(ms * kMs, frames);
        ASSERT_GT(count, 1U);
        EXPECT_EQ(frames[count - 1].id, 0x18FF1003U);
        std::uint8_t question_counter = 0xFF;
        for (std::size_t i = 0; i < count; ++i)
            if (frames[i].id == 0x18FF2080) question_counter = frames[i].data[7] & 0x0F;
        EXPECT_EQ(frames[count - 1].data[7] & 0x0F, question_counter);
    }
    EXPECT_EQ(questions, 10);
}

TEST(Lockstep, AControllerWithoutQuestionsKeepsItsOwnTime) {
    TwoSides sides;
    std::array<Frame, 64> frames;
    int answers = 0;
    for (int ms = 0; ms < 100; ++ms) {
        sides.tcu_link.receive(ms * kMs, sides.tcu);
        sides.tcu_link.send(ms * kMs, sides.tcu);
        const std::size_t count = sides.bus.end(2).receive(ms * kMs, frames);
        for (std::size_t i = 0; i < count; ++i) answers += frames[i].id == 0x18FF1003;
    }
    EXPECT_EQ(answers, 10);
}

// ---- configuration -----------------------------------------------------------------------------------------------

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

// The stamp of the command travels with the first frame that is sent after it was taken, and with no other.
TEST(CanLink, TheFirstFrameAfterACommandTellsWhenTheCommandArrived) {
    TwoSides sides;
    sides.run(0, 200);
    std::array<Frame, 4096> seen;
    sides.bus.end(2).receive(200 * kMs, seen);
    sides.run(200, 300);
    const std::size_t count = sides.bus.end(2).receive(300 * kMs, seen);
    ASSERT_LT(count, seen.size());
    std::vector<std::int64_t> commands, answered;
    for (std::size_t i = 0; i < count; ++i) {
        const bool command =
            seen[i].extended && (seen[i].id & 0x03FFFFFFU) == 0x00FF1003U;  // clutch command A
        if (command) commands.push_back(seen[i].timestamp_ns);
        if (seen[i].answers_ns == 0) continue;
        EXPECT_EQ(seen[i].timestamp_ns - seen[i].answers_ns, kMs) << "taken in the tick after it was sent";
        answered.push_back(seen[i].answers_ns);
    }
    ASSERT_EQ(commands.size(), 10U);
    EXPECT_EQ(std::set<std::int64_t>(answered.begin(), answered.end()).size(), answered.size());
    for (const std::int64_t command : commands) {
        if (command == 299 * kMs) continue;  // its answer comes after the last frame seen here
        EXPECT_EQ(std::count(answered.begin(), answered.end(), command), 1) << command;
    }
}

TEST(CanLink, NothingIsAllocatedAfterConstruction) {
    TwoSides sides;
    sides.run(0, 20);
    const CountAllocations allocations;
    sides.run(20, 2000);
    sides.run(2000, 2300, false);
    sides.run(2300, 2400);
    EXPECT_EQ(allocations.count(), 0);
    EXPECT_TRUE(sides.rig_link.command_valid());
}

}  // namespace
}  // namespace shiftrig::io::can
