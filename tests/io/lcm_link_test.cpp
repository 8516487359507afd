// Runs inside with_multicast.sh.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <thread>

#include "io/lcm/channels.h"
#include "io/lcm/link.h"
#include "shiftrig/clutch_command_t.hpp"
#include "shiftrig/driver_input_t.hpp"
#include "shiftrig/plant_info_t.hpp"
#include "shiftrig/speeds_t.hpp"

namespace shiftrig::io::lcm {
namespace {

using plant::Unit;

const std::string url = "udpm://239.255.76.67:7667?ttl=0";
constexpr std::int64_t ms = 1'000'000;

SignalTable machine() {
    SignalTable table;
    const auto add = [&](const char* name, Unit unit = Unit::one) {
        table.add({name, unit, 0, -1e300, 1e300, ""});
    };
    add("driver.throttle");
    add("driver.lever");
    add("clutch.F1.pressure_command", Unit::pascal);
    add("clutch.Fc.release_command");
    add("clutch.F2.current_command", Unit::ampere);
    add("engine.diesel.torque_limit");
    add("engine.diesel.fuel_cut");
    add("clutch.Fc.torque", Unit::newton_metre);
    add("clutch.F1.torque", Unit::newton_metre);
    add("clutch.F1.pressure", Unit::pascal);
    add("clutch.F2.torque", Unit::newton_metre);
    add("engine.diesel.torque", Unit::newton_metre);
    add("engine.diesel.load");
    add("sensor.input.speed", Unit::radian_per_second);
    add("sensor.output.speed", Unit::radian_per_second);
    add("mass.engine.speed", Unit::radian_per_second);
    add("oil.temperature", Unit::celsius);
    return table;
}

double& at(SignalTable& table, const char* name) {
    return table.value.at(static_cast<std::size_t>(table.find(name)));
}

Subscription listen_to_speeds() {
    return {channel::speeds, speeds_t::getHash(), static_cast<std::size_t>(speeds_t().getEncodedSize())};
}

// A rig's link and a peer that sends whatever it likes.
struct Rig : testing::Test {
    SignalTable table = machine();
    LcmLink link{url, table};
    Endpoint peer{url, {listen_to_speeds()}};
    std::int64_t now = 0;

    clutch_command_t command(std::int64_t seq, double pressure) {
        clutch_command_t message{};
        message.seq = seq;
        message.answers_seq = -1;
        message.clutch_count = 3;  // Fc, F1, F2
        message.enable[0] = message.enable[1] = message.enable[2] = 1;
        message.fraction[0] = 0.25;
        message.pressure_pa[1] = pressure;
        message.current_a[2] = 0.7;
        return message;
    }
    // Sends one message and lets the rig receive exactly that.
    template <class Type>
    void deliver(const char* channel, const Type& message) {
        ASSERT_TRUE(peer.send(channel, message));
        ASSERT_TRUE(link.wait(5'000 * ms));
        link.receive(now, table);
    }
    ChannelReport commands() { return link.report().at(0); }
};

TEST_F(Rig, CommandReachesTheSignalOfEachClutchInItsOwnUnit) {
    deliver(channel::clutch_command, command(0, 12e5));
    EXPECT_EQ(at(table, "clutch.Fc.release_command"), 0.25);
    EXPECT_EQ(at(table, "clutch.F1.pressure_command"), 12e5);
    EXPECT_EQ(at(table, "clutch.F2.current_command"), 0.7);
    EXPECT_EQ(at(table, "bus.clutch_command.status"), 1);
    EXPECT_EQ(commands().good, 1u);
}

TEST_F(Rig, TimeFromACommandToTheFirstMessageThatReflectsItIsTold) {
    deliver(channel::clutch_command, command(0, 8e5));
    std::int64_t latency = 0;
    EXPECT_FALSE(link.next_command_latency(latency)) << "nothing has been sent yet";
    const auto waits = std::chrono::milliseconds(5);
    std::this_thread::sleep_for(waits);
    const auto patience = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    link.send(now, table);
    while (!link.next_command_latency(latency) && std::chrono::steady_clock::now() < patience)
        std::this_thread::yield();
    EXPECT_GE(latency, std::chrono::nanoseconds(waits).count());
    link.send(now + ms, table);
    ASSERT_TRUE(peer.wait(5'000 * ms));
    EXPECT_FALSE(link.next_command_latency(latency)) << "told once";
}

TEST_F(Rig, EntryThatIsNotEnabledLeavesItsClutchAlone) {
    at(table, "clutch.F1.pressure_command") = 3e5;
    auto message = command(0, 12e5);
    message.enable[1] = 0;
    deliver(channel::clutch_command, message);
    EXPECT_EQ(at(table, "clutch.F1.pressure_command"), 3e5);
    EXPECT_EQ(at(table, "clutch.F2.current_command"), 0.7);
}

TEST_F(Rig, GapInTheSequenceIsCountedAsLost) {
    for (const std::int64_t seq : {0, 1, 5, 6, 9}) deliver(channel::clutch_command, command(seq, 1e5));
    EXPECT_EQ(commands().good, 5u);
    EXPECT_EQ(commands().lost, 5u);  // 2, 3, 4, 7, 8
    EXPECT_EQ(link.messages_lost(), 5u);
}

TEST_F(Rig, RepeatedAndOvertakenMessagesAreIgnored) {
    deliver(channel::clutch_command, command(3, 1e5));
    deliver(channel::clutch_command, command(4, 2e5));
    deliver(channel::clutch_command, command(4, 9e5));
    deliver(channel::clutch_command, command(2, 9e5));
    EXPECT_EQ(at(table, "clutch.F1.pressure_command"), 2e5);
    EXPECT_EQ(commands().stale, 2u);
    EXPECT_EQ(commands().lost, 0u);
}

TEST_F(Rig, ControllerThatBeginsAgainIsBelieved) {
    deliver(channel::clutch_command, command(1000, 1e5));
    deliver(channel::clutch_command, command(0, 2e5));
    EXPECT_EQ(at(table, "clutch.F1.pressure_command"), 2e5);
    now = 500 * ms;  // silence: any number is a new beginning
    deliver(channel::clutch_command, command(0, 3e5));
    EXPECT_EQ(at(table, "clutch.F1.pressure_command"), 3e5);
    EXPECT_EQ(commands().restarts, 2u);
    EXPECT_EQ(commands().lost, 0u);
}

TEST_F(Rig, CommandThatIsNotANumberIsIgnoredWhole) {
    deliver(channel::clutch_command, command(0, 1e5));
    auto message = command(1, std::numeric_limits<double>::quiet_NaN());
    message.fraction[0] = 0.9;
    deliver(channel::clutch_command, message);
    message = command(2, 9e5);
    message.clutch_count = 17;
    deliver(channel::clutch_command, message);
    message.clutch_count = -1;
    message.seq = 3;
    deliver(channel::clutch_command, message);
    EXPECT_EQ(at(table, "clutch.F1.pressure_command"), 1e5);
    EXPECT_EQ(at(table, "clutch.Fc.release_command"), 0.25);
    EXPECT_EQ(commands().implausible, 3u);
}

TEST_F(Rig, SilenceMakesTheCommandInvalidAfterItsTimeout) {
    link.receive(0, table);
    EXPECT_TRUE(link.command_valid());  // grace
    link.receive(100 * ms + 1, table);
    EXPECT_FALSE(link.command_valid());
    now = 200 * ms;
    deliver(channel::clutch_command, command(0, 1e5));
    EXPECT_TRUE(link.command_valid());
    link.receive(300 * ms, table);
    EXPECT_TRUE(link.command_valid());
    EXPECT_EQ(at(table, "bus.clutch_command.status"), 1);
    link.receive(300 * ms + 1, table);
    EXPECT_FALSE(link.command_valid());
    EXPECT_EQ(at(table, "bus.clutch_command.status"), 3);
    EXPECT_EQ(at(table, "bus.command_valid"), 0);
}

TEST_F(Rig, OutsideDriverReplacesTheScenariosUntilHeFallsSilent) {
    driver_input_t driver{};
    driver.throttle = 0.6;
    driver.lever = 3;
    deliver(channel::driver_request, driver);
    now = 50 * ms;
    at(table, "driver.throttle") = 0.1;  // the scenario speaks
    link.receive(now, table);
    EXPECT_EQ(at(table, "driver.throttle"), 0.6);
    EXPECT_EQ(at(table, "driver.lever"), 3);
    at(table, "driver.throttle") = 0.1;
    link.receive(101 * ms, table);
    EXPECT_EQ(at(table, "driver.throttle"), 0.1);
}

TEST_F(Rig, SpeedsGoOutEveryTickInTheOrderOfTheSensors) {
    at(table, "sensor.input.speed") = 180;
    at(table, "sensor.output.speed") = 150;
    at(table, "clutch.F1.pressure") = 7e5;
    at(table, "oil.temperature") = 85;
    for (int tick = 1; tick <= 3; ++tick) {
        link.send(tick * ms, table);
        ASSERT_TRUE(peer.wait(5'000 * ms));
        speeds_t speeds{};
        speeds.decode(peer.front()->bytes.data(), 0, static_cast<int>(peer.front()->size));
        peer.pop();
        EXPECT_EQ(speeds.seq, tick - 1);
        EXPECT_EQ(speeds.tick, tick);
        EXPECT_EQ(speeds.sim_time_ns, tick * ms);
        EXPECT_EQ(speeds.sensor_count, 2);
        EXPECT_EQ(speeds.speed[0], 180);
        EXPECT_EQ(speeds.speed[1], 150);
        EXPECT_EQ(speeds.pressure_pa[1], 7e5);  // clutches: Fc, F1, F2
        EXPECT_EQ(speeds.oil_temperature_c, 85);
    }
}

TEST_F(Rig, LockstepWaitsForTheCommandThatAnswersTheTick) {
    EXPECT_FALSE(link.awaiting_answer());
    link.send(1 * ms, table);
    link.send(2 * ms, table);
    EXPECT_TRUE(link.awaiting_answer());
    auto message = command(0, 1e5);
    message.answers_seq = 0;  // answers the tick before
    deliver(channel::clutch_command, message);
    EXPECT_TRUE(link.awaiting_answer());
    message = command(1, 2e5);
    message.answers_seq = 1;
    deliver(channel::clutch_command, message);
    EXPECT_FALSE(link.awaiting_answer());
}

TEST(ControllerLink, WithoutARigSaysSo) {
    SignalTable table;
    LinkOptions options;
    options.role = Role::controller;
    options.find_rig_ns = 1'000 * ms;
    try {
        LcmLink link(url, table, options);
        FAIL() << "no error";
    } catch (const EndpointError& error) {
        EXPECT_STREQ(error.what(),
                     "lcm:udpm://239.255.76.67:7667?ttl=0: no rig speaks here (no SHIFTRIG_PLANT_INFO within "
                     "1 s); start it first");
    }
}

// A rig whose "plant" is one line and a controller in another thread, both through the network: every answer
// depends on every question before it, so a lost, doubled or late message would change what follows. Every
// `asked_twice`-th question is asked twice.
std::vector<double> lockstep_run(int ticks, int asked_twice) {
    SignalTable rig_table = machine();
    LinkOptions rig_options;
    rig_options.lockstep = true;
    LcmLink rig(url, rig_table, rig_options);
    std::atomic<bool> done{false};

    std::thread controller([&] {
        SignalTable table;
        LinkOptions options;
        options.role = Role::controller;
        LcmLink link(url, table, options);
        while (!done) {
            if (!link.wait(10 * ms)) continue;
            link.receive(link.rig_time_ns(), table);
            if (!link.question_pending()) continue;
            at(table, "clutch.F1.pressure_command") += 1e3 * std::sin(at(table, "sensor.input.speed"));
            link.send(link.rig_time_ns(), table);
        }
    });

    std::vector<double> commands;
    for (int tick = 1; tick <= ticks && !testing::Test::HasFailure(); ++tick) {
        at(rig_table, "sensor.input.speed") = 0.3 * tick + 1e-6 * at(rig_table, "clutch.F1.pressure_command");
        rig.send(tick * ms, rig_table);
        if (asked_twice > 0 && tick % asked_twice == 0) {
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
            rig.repeat_question();  // although the answer may already be there
        }
        for (int tries = 0; rig.awaiting_answer(); ++tries) {
            if (rig.wait(50 * ms))
                rig.receive(tick * ms, rig_table);
            else
                rig.repeat_question();
            if (tries > 200) {
                ADD_FAILURE() << "no answer at tick " << tick;
                break;
            }
        }
        commands.push_back(at(rig_table, "clutch.F1.pressure_command"));
    }
    done = true;
    controller.join();
    return commands;
}

TEST(LcmLockstep, TwoRunsGiveTheSameCommandsToTheBit) {
    const auto first = lockstep_run(2000, 0);
    const auto second = lockstep_run(2000, 0);
    ASSERT_EQ(first.size(), 2000u);
    EXPECT_NE(first.back(), first.front());
    EXPECT_EQ(first, second);
}

TEST(LcmLockstep, QuestionAskedTwiceIsAnsweredTwiceButCountsOnce) {
    EXPECT_EQ(lockstep_run(300, 0), lockstep_run(300, 10));
}

}  // namespace
}  // namespace shiftrig::io::lcm
