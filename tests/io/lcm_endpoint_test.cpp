// Runs inside with_multicast.sh: 239.255.76.67 is routed to the loopback, no other group is.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <lcm/lcm.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <random>

#include "io/lcm/channels.h"
#include "io/lcm/endpoint.h"
#include "shiftrig/clutch_command_t.hpp"

namespace shiftrig::io::lcm {
namespace {

const std::string url = "udpm://239.255.76.67:7667?ttl=0";

std::string error_of(const std::string& wrong_url) {
    try {
        Endpoint endpoint(wrong_url, {});
    } catch (const EndpointError& error) {
        return error.what();
    }
    return "(no error)";
}

Subscription commands() {
    return {channel::clutch_command, clutch_command_t::getHash(),
            static_cast<std::size_t>(clutch_command_t().getEncodedSize())};
}

template <class Condition>
bool eventually(Condition condition) {
    for (int i = 0; i < 500; ++i) {
        if (condition()) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
}

TEST(Endpoint, UnknownProviderIsNamed) {
    EXPECT_EQ(error_of("zenoh://somewhere"),
              "lcm:zenoh://somewhere: unknown provider \"zenoh\"; LCM knows udpm and tcpq");
}

TEST(Endpoint, MemqIsRefusedBecauseNothingIsBehindIt) {
    EXPECT_EQ(error_of("memq://"),
              "lcm:memq://: provider \"memq\" has no network behind it; use udpm or tcpq");
}

TEST(Endpoint, SomethingElseThanAnUrlIsRefused) {
    EXPECT_EQ(error_of("vcan0"), "lcm:vcan0: is not an LCM URL; write udpm://239.255.76.67:7667?ttl=0");
}

TEST(Endpoint, PortOutOfRangeIsRefused) {
    EXPECT_EQ(error_of("udpm://239.255.76.67:70000"),
              "lcm:udpm://239.255.76.67:70000: \"70000\" is not a port (1 to 65535)");
}

TEST(Endpoint, TtlThatIsNoneIsRefused) {
    for (const std::string wrong : {"nan", "-5", "256", "1.5", ""})
        EXPECT_EQ(
            error_of("udpm://239.255.76.67:7667?ttl=" + wrong),
            "lcm:udpm://239.255.76.67:7667?ttl=" + wrong + ": \"" + wrong + "\" is not a ttl (0 to 255)");
}

TEST(Endpoint, UnicastAddressIsRefused) {
    EXPECT_EQ(
        error_of("udpm://127.0.0.1:7667"),
        "lcm:udpm://127.0.0.1:7667: \"127.0.0.1\" is not a multicast address (224.0.0.0 to 239.255.255.255)");
}

TEST(Endpoint, MissingMulticastRouteNamesTheCommandThatAddsIt) {
    EXPECT_EQ(error_of("udpm://239.255.76.99:7667?ttl=0"),
              "lcm:udpm://239.255.76.99:7667?ttl=0: no route for multicast; run: sudo ip link set lo "
              "multicast on && "
              "sudo ip route add 239.255.76.99/32 dev lo");
}

TEST(Endpoint, TcpqWithoutServerIsRefusedAtOnce) {
    EXPECT_EQ(error_of("tcpq://127.0.0.1:7799"),
              "lcm:tcpq://127.0.0.1:7799: no LCM TCP server answers at 127.0.0.1:7799 (Connection refused); "
              "start one first");
}

TEST(Endpoint, MessageArrivesAtTheOtherEndUnchanged) {
    Endpoint receiver(url, {commands()});
    Endpoint sender(url, {});
    clutch_command_t sent{};
    sent.seq = 42;
    sent.pressure_pa[3] = 11.5e5;
    ASSERT_TRUE(sender.send(channel::clutch_command, sent));
    ASSERT_TRUE(receiver.wait(5'000'000'000));
    clutch_command_t got{};
    ASSERT_GT(got.decode(receiver.front()->bytes.data(), 0, static_cast<int>(receiver.front()->size)), 0);
    EXPECT_EQ(got.seq, 42);
    EXPECT_EQ(got.pressure_pa[3], 11.5e5);
    receiver.pop();
    EXPECT_EQ(receiver.front(), nullptr);
}

TEST(Endpoint, WaitingEndsWithItsTimeout) {
    Endpoint receiver(url, {commands()});
    EXPECT_FALSE(receiver.wait(20'000'000));
}

// Far more at once than the send thread and LCM can take: nothing waits, and every message is accounted for.
TEST(Endpoint, BurstIsAccountedForToTheLastMessage) {
    Endpoint sender(url, {});
    constexpr std::uint64_t burst = 20000;
    clutch_command_t message{};
    for (std::uint64_t i = 0; i < burst; ++i) {
        message.seq = static_cast<std::int64_t>(i);
        sender.send(channel::clutch_command, message);
    }
    EXPECT_TRUE(eventually([&] {
        const auto c = sender.counters();
        return c.sent + c.send_failed + c.send_dropped == burst;
    }));
    EXPECT_GT(sender.counters().sent, 0u);
}

// Raw datagrams of noise, LCM packets with noise inside, and other types on our channel.
TEST(Endpoint, FloodOfGarbageIsCountedAndSoundMessagesStillArrive) {
    Endpoint receiver(url, {commands()});
    const int raw = ::socket(AF_INET, SOCK_DGRAM, 0);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(7667);
    ::inet_pton(AF_INET, "239.255.76.67", &to.sin_addr);
    lcm_t* peer = lcm_create(url.c_str());
    std::mt19937 random(7);
    std::string noise;
    for (int i = 0; i < 3000; ++i) {
        noise.resize(random() % 1400);
        for (auto& c : noise) c = static_cast<char>(random());
        if (i % 3 == 0 && noise.size() > 8) noise.replace(0, 4, "LC02");  // LCM's own magic, then nonsense
        ::sendto(raw, noise.data(), noise.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
        lcm_publish(peer, channel::clutch_command, noise.data(), static_cast<unsigned>(noise.size()));
    }
    EXPECT_TRUE(eventually([&] { return receiver.counters().refused > 100; }));
    EXPECT_EQ(receiver.counters().received, 0u);

    Endpoint sender(url, {});
    EXPECT_TRUE(eventually([&] {
        sender.send(channel::clutch_command, clutch_command_t{});
        return receiver.front() != nullptr;
    }));
    lcm_destroy(peer);
    ::close(raw);
}

TEST(Endpoint, RouteThatGoesAwayIsCountedAndForgivenWhenItReturns) {
    Endpoint receiver(url, {commands()});
    Endpoint sender(url, {});
    ASSERT_EQ(std::system("ip route del 239.255.76.67/32 dev lo"), 0);
    for (int i = 0; i < 10; ++i) sender.send(channel::clutch_command, clutch_command_t{});
    EXPECT_TRUE(eventually([&] { return sender.counters().send_failed == 10; }));
    ASSERT_EQ(std::system("ip route add 239.255.76.67/32 dev lo"), 0);
    EXPECT_TRUE(eventually([&] {
        sender.send(channel::clutch_command, clutch_command_t{});
        return receiver.front() != nullptr;
    }));
}

}  // namespace
}  // namespace shiftrig::io::lcm
