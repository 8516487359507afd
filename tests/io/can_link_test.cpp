// The link between a CAN port and the table of signals: meaning, timing, trust, lockstep.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
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
