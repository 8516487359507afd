// SocketCAN on a real vcan (scripts/vcan-kernel), watched and fed by can-utils.
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "io/can/open_port.h"

namespace shiftrig::io::can {
namespace {

using namespace std::chrono_literals;

std::string shell(const std::string& command) {
    std::string output;
    const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen((command + " 2>&1").c_str(), "r"), pclose);
    for (int c = std::fgetc(pipe.get()); c != EOF; c = std::fgetc(pipe.get())) output += static_cast<char>(c);
    return output;
}

std::vector<Frame> gather(CanPort& port, std::size_t wanted, std::chrono::milliseconds patience = 20s) {
    std::vector<Frame> all;
    std::array<Frame, 64> frames;
    const auto end = std::chrono::steady_clock::now() + patience;
    while (all.size() < wanted && std::chrono::steady_clock::now() < end) {
        port.wait(50'000'000);
        const std::size_t count = port.receive(0, frames);
        all.insert(all.end(), frames.begin(), frames.begin() + static_cast<std::ptrdiff_t>(count));
    }
    return all;
}

template <class Condition>
bool eventually(Condition condition) {
    for (int i = 0; i < 2000 && !condition(); ++i) std::this_thread::sleep_for(10ms);
    return condition();
}

Frame numbered(std::uint32_t id, unsigned number) {
    Frame frame;
    frame.id = id;
    frame.extended = true;
    frame.length = 8;
    for (std::size_t i = 0; i < 4; ++i) frame.data[i] = static_cast<std::uint8_t>(number >> (8 * i));
    return frame;
}

TEST(SocketCan, FramesOfCansendArriveWithTheKernelsTimeStamp) {
    const auto port = open_port("can:vcan0");
    ASSERT_EQ(shell("cansend vcan0 18FF1003#0102030405060708; cansend vcan0 123##1AABBCC"), "");
    const auto heard = gather(*port, 2);
    ASSERT_EQ(heard.size(), 2U);
    EXPECT_EQ(heard[0].id, 0x18FF1003U);
    EXPECT_TRUE(heard[0].extended);
    EXPECT_EQ(heard[0].data[7], 8);
    EXPECT_GT(heard[0].timestamp_ns, 0);
    EXPECT_GE(heard[1].timestamp_ns, heard[0].timestamp_ns);
    EXPECT_TRUE(heard[1].fd && heard[1].bit_rate_switch && !heard[1].extended)
        << "vcan has the MTU of CAN FD";
    EXPECT_EQ(heard[1].length, 3);
}

TEST(SocketCan, TheKernelFiltersWhatNobodyWants) {
    const Filter filter{0x00FF1000, 0x03FFFF00, true};
    const auto port = open_port("can:vcan0", {&filter, 1});
    shell(
        "cansend vcan0 18FF2003#00; cansend vcan0 100#00; cansend vcan0 0CFF1027#01; cansend vcan0 "
        "18FF1003#R; cansend vcan0 18FF1003#02");
    const auto heard = gather(*port, 2);
    ASSERT_EQ(heard.size(), 2U);
    EXPECT_EQ(heard[0].data[0], 1);
    EXPECT_EQ(heard[1].data[0], 2);
    EXPECT_TRUE(gather(*port, 1, 200ms).empty());
}

TEST(SocketCan, ABurstArrivesInOrderOrItsLossIsCounted) {
    const auto sender = open_port("can:vcan0"), receiver = open_port("can:vcan0");
    constexpr unsigned kFrames = 6000;
    unsigned accepted = 0;
    for (unsigned i = 0; i < kFrames; ++i) accepted += sender->send(0, numbered(0x18FF1003, i));
    ASSERT_TRUE(eventually([&] {
        const auto c = sender->counters();
        return c.sent + c.send_dropped == kFrames;
    }));
    const auto sent = sender->counters().sent;
    const auto heard = gather(*receiver, sent, 3s);
    EXPECT_EQ(heard.size() + receiver->counters().receive_dropped, sent);
    for (std::size_t i = 1; i < heard.size(); ++i)
        ASSERT_LT(heard[i - 1].data[0] + 256 * heard[i - 1].data[1],
                  heard[i].data[0] + 256 * heard[i].data[1]);
    EXPECT_EQ(accepted, kFrames);
}

TEST(SocketCan, FramesThatNobodyReadsInTimeAreCountedToTheFrame) {
    constexpr std::size_t kFrames = 60000;
    const auto receiver = open_port("can:vcan1");
    ASSERT_EQ(shell("cangen vcan1 -g 0 -n 60000 -I 18FF1003 -e -L 8 -D i; echo done"), "done\n");
    ASSERT_TRUE(eventually([&] { return receiver->counters().receive_dropped > 0; }));
    std::this_thread::sleep_for(300ms);
    const auto heard = gather(*receiver, kFrames, 2s);
    EXPECT_EQ(heard.size() + receiver->counters().receive_dropped, kFrames);
}

TEST(SocketCan, AnInterfaceThatGoesDownAndComesBackIsSurvived) {
    const auto port = open_port("can:vcan1");
    ASSERT_EQ(shell("ip link set vcan1 down"), "");
    EXPECT_TRUE(eventually([&] { return port->state() == PortState::down; }));
    EXPECT_FALSE(port->send(0, numbered(1, 0)));
    EXPECT_EQ(port->counters().send_dropped, 1U);
    ASSERT_EQ(shell("ip link set vcan1 up"), "");
    EXPECT_TRUE(eventually([&] { return port->state() == PortState::up; }));
    EXPECT_EQ(port->counters().reconnects, 1U);
    shell("cansend vcan1 123#55");
    EXPECT_EQ(gather(*port, 1).size(), 1U);
}

TEST(SocketCan, AnInterfaceThatIsTakenAwayAndMadeAgainIsSurvived) {
    ASSERT_EQ(shell("ip link add dev vcan7 type vcan && ip link set vcan7 up"), "");
    const auto port = open_port("can:vcan7");
    shell("ip link del vcan7");
    EXPECT_TRUE(eventually([&] { return port->state() == PortState::down; }));
    shell("ip link add dev vcan7 type vcan && ip link set vcan7 up");
    EXPECT_TRUE(eventually([&] { return port->state() == PortState::up; }));
    shell("cansend vcan7 123#66");
    const auto heard = gather(*port, 1);
    ASSERT_EQ(heard.size(), 1U);
    EXPECT_EQ(heard[0].data[0], 0x66);
    const auto other = open_port("can:vcan7");
    ASSERT_TRUE(port->send(0, numbered(0x18FF1003, 77)));
    EXPECT_EQ(gather(*other, 1).size(), 1U);
    shell("ip link del vcan7");
}

// The kernel tells the loss of an interface once: to a reader or to a writer.
TEST(SocketCan, AnInterfaceThatIsLostWhileFramesAreSentIsSurvived) {
    for (int i = 0; i < 5; ++i) {
        ASSERT_EQ(shell("ip link add dev vcan7 type vcan && ip link set vcan7 up"), "");
        const auto port = open_port("can:vcan7");
        std::atomic<bool> stop{false};
        std::thread sender([&] {
            for (unsigned n = 0; !stop; ++n, std::this_thread::sleep_for(100us))
                port->send(0, numbered(0x18FF1003, n));
        });
        shell(i % 2 == 0 ? "ip link set vcan7 down" : "ip link del vcan7");
        EXPECT_TRUE(eventually([&] { return port->state() == PortState::down; }));
        shell(i % 2 == 0 ? "ip link set vcan7 up"
                         : "ip link add dev vcan7 type vcan && ip link set vcan7 up");
        EXPECT_TRUE(eventually([&] { return port->state() == PortState::up; }));
        shell("cansend vcan7 123#66");
        EXPECT_EQ(gather(*port, 1).size(), 1U);
        stop = true;
        sender.join();
        EXPECT_GE(port->counters().reconnects, 1U);
        EXPECT_GT(port->counters().send_dropped, 0U);
        shell("ip link del vcan7");
    }
}

// A slow controller in miniature: a queue for three frames that lets 60 of them pass a second.
TEST(SocketCan, FramesThatAFullQueueRefusesAreCountedAndNothingStops) {
    ASSERT_EQ(shell("ip link add dev vcan7 type vcan && ip link set vcan7 up && "
                    "tc qdisc add dev vcan7 root tbf rate 8kbit burst 64b limit 64b"),
              "");
    const auto port = open_port("can:vcan7"), watcher = open_port("can:vcan7");
    for (unsigned i = 0; i < 200; ++i) ASSERT_TRUE(port->send(0, numbered(0x18FF1003, i)));
    ASSERT_TRUE(eventually([&] {
        const auto c = port->counters();
        return c.sent + c.send_dropped == 200U;
    }));
    EXPECT_GT(port->counters().send_dropped, 100U) << "ENOBUFS";
    EXPECT_EQ(port->state(), PortState::up);
    const auto sent = port->counters().sent;
    EXPECT_EQ(gather(*watcher, sent).size(), sent);
    shell("ip link del vcan7");
}

TEST(SocketCan, AnInterfaceThatIsDownAtTheStartIsSaidInOneLine) {
    shell("ip link add dev vcan8 type vcan");
    try {
        open_port("can:vcan8");
        FAIL();
    } catch (const std::runtime_error& error) {
        EXPECT_STREQ(error.what(),
                     "can:vcan8: the interface is down; bring it up: sudo ip link set up vcan8");
    }
    shell("ip link del vcan8");
    try {
        open_port("can:lo");
        FAIL();
    } catch (const std::runtime_error& error) {
        EXPECT_STREQ(error.what(), "can:lo: this interface is not a CAN interface");
    }
}

}  // namespace
}  // namespace shiftrig::io::can
