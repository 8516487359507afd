#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <random>

#include "io/can/candump.h"
#include "io/can/inprocess.h"
#include "io/can/link.h"
#include "io/input_error.h"
#include "tests/io/can_rig_signals.h"

namespace shiftrig::io::can {
namespace {

class CandumpFile : public testing::Test {
  protected:
    std::string path_ =
        (std::filesystem::temp_directory_path() / ("shiftrig_candump_" + std::to_string(::getpid())))
            .string();
    void TearDown() override { std::filesystem::remove(path_); }
};

std::string error_of(const std::string& line) {
    try {
        parse_candump_line(line, "x.log", 7);
    } catch (const InputError& error) {
        return error.what();
    }
    return "accepted";
}

TEST(Candump, ReadsTheLinesOfCandumpAndOfPythonCan) {
    const auto classic = parse_candump_line("(1436509052.249713) vcan0 18FF1003#E803000000000720 R", "x", 1);
    ASSERT_TRUE(classic);
    EXPECT_EQ(classic->frame.timestamp_ns, 1436509052249713000);
    EXPECT_EQ(classic->interface, "vcan0");
    EXPECT_EQ(classic->direction, Direction::received);
    EXPECT_TRUE(classic->frame.extended);
    EXPECT_EQ(classic->frame.id, 0x18FF1003U);
    EXPECT_EQ(classic->frame.length, 8);
    EXPECT_EQ(classic->frame.data[7], 0x20);

    const auto fd = parse_candump_line("(0.000001) can1 123##1112233445566778899AABBCC T", "x", 1);
    EXPECT_TRUE(fd->frame.fd && fd->frame.bit_rate_switch && !fd->frame.extended);
    EXPECT_EQ(fd->frame.length, 12);
    EXPECT_EQ(fd->direction, Direction::transmitted);
    EXPECT_EQ(fd->frame.timestamp_ns, 1000);

    EXPECT_TRUE(parse_candump_line("(1.5) can0 123#R4", "x", 1)->frame.remote);
    EXPECT_EQ(parse_candump_line("(1.5) can0 123#R4", "x", 1)->frame.length, 4);
    EXPECT_EQ(parse_candump_line("(1.5) can0 123#", "x", 1)->frame.length, 0);
    EXPECT_EQ(parse_candump_line("(1.5) can0 123#1122334455667788_B\r", "x", 1)->frame.length, 8);
    EXPECT_TRUE(parse_candump_line("(1.5) can0 20000004#0000000000000000", "x", 1)->frame.error);
    EXPECT_FALSE(parse_candump_line("", "x", 1));
    EXPECT_FALSE(parse_candump_line("# a remark", "x", 1));
}

TEST(Candump, NamesTheLineThatIsBroken) {
    EXPECT_EQ(error_of("12:00 can0 123#00"),
              "x.log:7: no time stamp; a line is (seconds.micros) interface ID#DATA");
    EXPECT_EQ(error_of("(1.x) can0 123#00"),
              "x.log:7: time stamp \"(1.x)\" is not a time; a line is (seconds.micros) interface ID#DATA");
    EXPECT_EQ(error_of("(1.0) can0 12#00"),
              "x.log:7: \"12\" is not an identifier of 3 or 8 hexadecimal digits; a line is (seconds.micros) "
              "interface ID#DATA");
    EXPECT_EQ(error_of("(1.0) can0 123#0"),
              "x.log:7: data \"0\" are not pairs of hexadecimal digits; a line is (seconds.micros) interface "
              "ID#DATA");
    EXPECT_EQ(error_of("(1.0) can0 123#001122334455667788"),
              "x.log:7: more than 8 bytes; a line is (seconds.micros) interface ID#DATA");
    EXPECT_EQ(error_of("(1.0) can0 123##"),
              "x.log:7: a CAN FD frame needs one digit of flags after ##; a line is (seconds.micros) "
              "interface ID#DATA");
    EXPECT_EQ(error_of("(1.0)"), "x.log:7: no frame; a line is (seconds.micros) interface ID#DATA");
}

TEST(Candump, WhatIsWrittenIsReadBack) {
    std::mt19937 random(5);
    for (int i = 0; i < 5000; ++i) {
        Frame frame;
        frame.extended = random() % 2 == 0;
        frame.id = static_cast<std::uint32_t>(random()) & (frame.extended ? 0x1FFFFFFFU : 0x7FFU);
        frame.fd = random() % 4 == 0;
        frame.bit_rate_switch = frame.fd && random() % 2 == 0;
        frame.remote = !frame.fd && random() % 8 == 0;
        const auto length = static_cast<unsigned>(random() % (frame.fd ? 65 : 9));
        frame.length = frame.fd ? fd_length(length) : static_cast<std::uint8_t>(length);
        if (!frame.remote)
            for (std::size_t k = 0; k < frame.length; ++k)
                frame.data[k] = static_cast<std::uint8_t>(random());
        const std::int64_t time_ns = static_cast<std::int64_t>(random()) * 1'000'000;
        std::string line;
        append_candump_line(line, frame, time_ns, "vcan0", Direction::received);
        line.pop_back();
        const auto read = parse_candump_line(line, "x", 1);
        ASSERT_TRUE(read && read->frame.same_as(frame)) << line;
        ASSERT_EQ(read->frame.timestamp_ns, time_ns);
        ASSERT_EQ(read->direction, Direction::received);
    }
}

TEST_F(CandumpFile, ALoggedBusIsReplayedAtItsOwnTimesWithoutTheFramesThatNobodyWants) {
    std::array<Frame, 16> frames;
    Frame command;
    command.id = 0x18FF1003;
    command.extended = true;
    command.length = 8;
    Frame feedback = command;
    feedback.id = 0x18FF2080;
    {
        InProcessBus bus(2);
        CandumpLogger logged(bus.end(0), path_);
        for (int ms = 0; ms < 1000; ++ms) {
            const std::int64_t now_ns = ms * 1'000'000LL;
            command.data[0] = static_cast<std::uint8_t>(ms / 10);
            if (ms % 10 == 3) bus.end(1).send(now_ns, command);
            logged.receive(now_ns, frames);
            if (ms % 10 == 5) logged.send(now_ns, feedback);
        }
        EXPECT_EQ(logged.lost(), 0U);
    }
    const auto log = read_candump(path_);
    ASSERT_EQ(log.size(), 200U);
    EXPECT_EQ(log[0].direction, Direction::received);
    EXPECT_EQ(log[1].direction, Direction::transmitted);

    const Filter commands{0x00FF1000, 0x03FFFF00, true};
    CandumpReplay replay(path_, {&commands, 1});
    EXPECT_EQ(replay.frames(), 100U);
    for (int ms = 0; ms < 1000; ++ms) {
        const std::size_t count = replay.receive(ms * 1'000'000LL, frames);
        ASSERT_EQ(count, ms % 10 == 3 ? 1U : 0U) << ms;
        if (count == 1) {
            ASSERT_EQ(frames[0].data[0], ms / 10);
        }
    }
    EXPECT_TRUE(replay.finished());
}

TEST_F(CandumpFile, ALogInWallTimeBeginsWithItsFirstFrame) {
    std::ofstream(path_) << "(1436509052.249713) vcan0 123#01\n(1436509052.259713) vcan0 123#02\n";
    CandumpReplay replay(path_, {});
    std::array<Frame, 4> frames;
    EXPECT_EQ(replay.receive(0, frames), 1U);
    EXPECT_EQ(replay.receive(9'999'999, frames), 0U);
    EXPECT_EQ(replay.receive(10'000'000, frames), 1U);
}

TEST_F(CandumpFile, ClaimingAddressesTakesNothingFromTheReplayAndIsLoggedAsOfTimeZero) {
    std::ofstream(path_)
        << "(0.000000) vcan0 18FF1003#0000E02E00000760\n(0.200000) vcan0 18FF1003#0000E02E00000711\n";
    const Mapping mapping = tractor_mapping();
    InProcessBus bus(2);
    CandumpReplay replay(path_, message_filters(mapping, Role::rig), &bus.end(0));
    const std::string log = path_ + ".written";
    {
        CandumpLogger logged(replay, log);
        SignalTable table = rig_signals();
        CanLink link(mapping, logged, table, {.address_claim = AddressClaim::claim});
        link.claim_addresses();  // 0x80 waits 250 ms
        EXPECT_FALSE(replay.finished());
        for (int ms = 0; ms <= 200; ++ms) link.receive(ms * 1'000'000LL, table);
        EXPECT_EQ(value(table, "bus.TransmissionSensors.address"), 1);
        for (const auto& message : link.report()) {
            if (message.name == "ClutchCommandA") {
                EXPECT_EQ(message.good, 2U);
            }
        }
    }
    const auto written = read_candump(log);
    std::filesystem::remove(log);
    ASSERT_EQ(written.size(), 5U + 2U);
    for (std::size_t i = 0; i < 5; ++i) {
        EXPECT_EQ(written[i].frame.id & 0x03FFFF00U, 0x00EEFF00U);
        EXPECT_EQ(written[i].frame.timestamp_ns, 0);
    }
}

TEST_F(CandumpFile, AMissingOrUnwritableFileIsSaidInOneLine) {
    const auto refusal = [](const char* path) {
        try {
            read_candump(path);
        } catch (const InputError& error) {
            return std::string(error.what());
        }
        return std::string("accepted");
    };
    EXPECT_EQ(refusal("/nowhere/x.log"), "/nowhere/x.log: cannot be read: No such file or directory");
    EXPECT_EQ(refusal("/tmp"), "/tmp: cannot be read: Is a directory");
    InProcessBus bus(2);
    EXPECT_THROW(CandumpLogger(bus.end(0), "/nowhere/x.log"), InputError);
}

TEST_F(CandumpFile, ADiskThatIsFullIsToldWhenTheLogIsFinished) {
    InProcessBus bus(2);
    Frame frame;
    frame.length = 8;
    CandumpLogger logged(bus.end(0), "/dev/full"), other(bus.end(1), path_);
    for (CandumpLogger* each : {&logged, &other}) {
        each->send(0, frame);
        each->finish();
        each->finish();  // once is enough
    }
    EXPECT_EQ(logged.error(), "/dev/full: cannot be written: No space left on device");
    EXPECT_EQ(logged.lost(), 0U);
    EXPECT_EQ(other.error(), "");
    EXPECT_EQ(read_candump(path_).size(), 1U);
}

}  // namespace
}  // namespace shiftrig::io::can
