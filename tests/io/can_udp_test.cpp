// CAN over UDP multicast as python-can speaks it. Runs in a network of its own (with_multicast.sh).
#include <gtest/gtest.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "io/can/open_port.h"
#include "io/can/udp_multicast.h"

namespace shiftrig::io::can {
namespace {

const std::string kBus = "udpcan:239.74.163.2:43113?ttl=0";

std::string error_of(const std::string& name) {
    try {
        open_port(name);
    } catch (const std::runtime_error& error) {
        return error.what();
    }
    return "opened";
}

std::vector<Frame> gather(CanPort& port, std::size_t wanted) {
    std::vector<Frame> all;
    std::array<Frame, 64> frames;
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (all.size() < wanted && std::chrono::steady_clock::now() < end) {
        port.wait(100'000'000);
        const std::size_t count = port.receive(0, frames);
        all.insert(all.end(), frames.begin(), frames.begin() + static_cast<std::ptrdiff_t>(count));
    }
    return all;
}

// Runs a line of Python with `can` imported and `bus` on our group; its output is what it prints.
std::string python(const std::string& body) {
    const std::string command =
        "/usr/bin/python3 -c 'import can\n"
        "bus = can.Bus(interface=\"udp_multicast\", channel=\"239.74.163.2\", port=43113, hop_limit=0)\n" +
        body + "' 2>&1";
    std::string output;
    const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), pclose);
    for (int c = std::fgetc(pipe.get()); c != EOF; c = std::fgetc(pipe.get())) output += static_cast<char>(c);
    return output;
}

TEST(UdpFrame, BytesArePythonCansOwn) {
    // msgpack.packb of python-can 4.1 for Message(arbitration_id=0x18FF1003, data=[1, 2, 3]), time stamp 0.
    const std::string expected =
        "8ba974696d657374616d70cb0000000000000000ae6172626974726174696f6e5f6964ce18ff1003ae69735f657874656e64"
        "65645f6964c3"
        "af69735f72656d6f74655f6672616d65c2ae69735f6572726f725f6672616d65c2a76368616e6e656cc0a3646c6303a46461"
        "7461c403010203"
        "a569735f6664c2ae626974726174655f737769746368c2b56572726f725f73746174655f696e64696361746f72c2";
    Frame frame;
    frame.id = 0x18FF1003;
    frame.extended = true;
    frame.length = 3;
    frame.data = {1, 2, 3};
    std::array<std::uint8_t, 320> datagram;
    const std::size_t size = pack_udp_frame(frame, 0, datagram);
    std::string hex;
    for (std::size_t i = 0; i < size; ++i) {
        char digits[3];
        std::snprintf(digits, sizeof digits, "%02x", datagram[i]);
        hex += digits;
    }
    EXPECT_EQ(hex, expected);
    Frame back;
    ASSERT_TRUE(unpack_udp_frame({datagram.data(), size}, back));
    EXPECT_TRUE(back.same_as(frame));
}

TEST(UdpFrame, EveryFrameSurvivesPackingAndNoGarbageIsTakenForAFrameWithImpossibleContents) {
    std::mt19937 random(11);
    std::array<std::uint8_t, 320> datagram;
    int taken = 0;
    for (int i = 0; i < 50000; ++i) {
        Frame frame;
        frame.extended = random() % 2 == 0;
        frame.id = static_cast<std::uint32_t>(random()) & (frame.extended ? 0x1FFFFFFFU : 0x7FFU);
        frame.fd = random() % 3 == 0;
        const auto length = static_cast<unsigned>(random() % (frame.fd ? 65 : 9));
        frame.length = frame.fd ? fd_length(length) : static_cast<std::uint8_t>(length);
        for (std::size_t k = 0; k < frame.length; ++k) frame.data[k] = static_cast<std::uint8_t>(random());
        const std::size_t size = pack_udp_frame(frame, 1.7e9, datagram);
        Frame back;
        ASSERT_TRUE(unpack_udp_frame({datagram.data(), size}, back));
        ASSERT_TRUE(back.same_as(frame));
        // Damaged and cut: refused, or a frame within its limits.
        for (int flips = 0; flips < 3; ++flips)
            datagram[random() % size] = static_cast<std::uint8_t>(random());
        const std::size_t cut = random() % 2 == 0 ? size : random() % (size + 1);
        if (!unpack_udp_frame({datagram.data(), cut}, back)) continue;
        ++taken;
        ASSERT_LE(back.length, back.fd ? 64 : 8);
        ASSERT_LE(back.id, back.extended ? 0x1FFFFFFFU : 0x7FFU);
    }
    EXPECT_GT(taken, 0);
}

TEST(UdpPort, TwoPortsHearEachOtherButNotThemselves) {
    const auto a = open_port(kBus), b = open_port(kBus);
    Frame frame;
    frame.id = 0x123;
    frame.length = 2;
    frame.data = {0xAB, 0xCD};
    for (int i = 0; i < 500; ++i) {
        frame.data[1] = static_cast<std::uint8_t>(i);
        ASSERT_TRUE(a->send(0, frame));
    }
    const auto heard = gather(*b, 500);
    ASSERT_EQ(heard.size(), 500U);
    for (std::size_t i = 0; i < heard.size(); ++i) ASSERT_EQ(heard[i].data[1], static_cast<std::uint8_t>(i));
    EXPECT_GT(heard[0].timestamp_ns, 1'600'000'000'000'000'000);
    std::array<Frame, 4> frames;
    EXPECT_EQ(a->receive(0, frames), 0U);
    // The sending thread counts a frame after it has gone, when the other end may have it already.
    for (int i = 0; i < 1000 && a->counters().sent < 500U; ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    EXPECT_EQ(a->counters().sent, 500U);
    EXPECT_EQ(b->counters().received, 500U);
}

// Heard by one end, answered by the other: what lies between is told once, with the first frame that answers.
TEST(UdpPort, TellsHowLongACommandWaitedForItsAnswer) {
    const auto controller = open_port(kBus), rig = open_port(kBus);
    Frame frame;
    frame.id = 0x123;
    ASSERT_TRUE(controller->send(0, frame));
    const auto command = gather(*rig, 1);
    ASSERT_EQ(command.size(), 1U);
    const auto waits = std::chrono::milliseconds(5);
    std::this_thread::sleep_for(waits);
    const auto send = [&](std::int64_t answers_ns) {
        frame.answers_ns = answers_ns;
        ASSERT_TRUE(rig->send(0, frame));
    };
    send(command[0].timestamp_ns);
    send(0);                                            // answers nothing
    send(12'345);                                       // a stamp of another clock
    send(command[0].timestamp_ns + 1'000'000'000'000);  // and one of the future
    ASSERT_EQ(gather(*controller, 4).size(), 4U);
    std::int64_t latency = 0;
    ASSERT_TRUE(rig->next_command_latency(latency));
    EXPECT_GE(latency, std::chrono::nanoseconds(waits).count());
    EXPECT_FALSE(rig->next_command_latency(latency));
}

TEST(UdpPort, PythonCanReadsOurFramesAndWeReadPythonCans) {
    const auto port = open_port(kBus);
    EXPECT_EQ(python("bus.send(can.Message(arbitration_id=0x18FF1003, data=[1,2,3,4,5,6,7,8]))\n"
                     "bus.send(can.Message(arbitration_id=0x7A, is_extended_id=False, is_fd=True, "
                     "bitrate_switch=True, data=bytes(range(12))))\n"
                     "bus.send(can.Message(arbitration_id=0x11, is_remote_frame=True, dlc=4))"),
              "");
    const auto heard = gather(*port, 3);
    ASSERT_EQ(heard.size(), 3U);
    EXPECT_TRUE(heard[0].extended);
    EXPECT_EQ(heard[0].id, 0x18FF1003U);
    EXPECT_EQ(heard[0].data[7], 8);
    EXPECT_TRUE(heard[1].fd && heard[1].bit_rate_switch && !heard[1].extended);
    EXPECT_EQ(heard[1].length, 12);
    EXPECT_TRUE(heard[2].remote);
    EXPECT_EQ(heard[2].length, 4);

    // The other way: python says that it listens, then prints what it hears.
    std::unique_ptr<FILE, int (*)(FILE*)> listener(
        popen(
            "/usr/bin/python3 -c 'import can\n"
            "bus = can.Bus(interface=\"udp_multicast\", channel=\"239.74.163.2\", port=43113, hop_limit=0)\n"
            "print(\"ready\", flush=True)\n"
            "for _ in range(2):\n"
            "  m = bus.recv(20); print(hex(m.arbitration_id), m.is_extended_id, m.is_fd, m.dlc, "
            "m.data.hex())' 2>&1",
            "r"),
        pclose);
    char line[256];
    ASSERT_TRUE(std::fgets(line, sizeof line, listener.get()));
    ASSERT_STREQ(line, "ready\n");
    Frame frame;
    frame.id = 0x0CF00400;
    frame.extended = true;
    frame.length = 8;
    frame.data = {0xF0, 1, 2, 3};
    port->send(0, frame);
    frame.fd = true;
    frame.length = 16;
    port->send(0, frame);
    ASSERT_TRUE(std::fgets(line, sizeof line, listener.get()));
    EXPECT_STREQ(line, "0xcf00400 True False 8 f001020300000000\n");
    ASSERT_TRUE(std::fgets(line, sizeof line, listener.get()));
    EXPECT_STREQ(line, "0xcf00400 True True 16 f0010203000000000000000000000000\n");
}

TEST(UdpPort, WhatIsNoFrameIsCountedAsMalformed) {
    const auto port = open_port(kBus);
    EXPECT_EQ(python("import socket\n"
                     "s = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)\n"
                     "for junk in (b\"\", b\"hello\", b\"\\x8b\\xa9timestamp\", "
                     "b\"\\x81\\xa4data\\xc6\\xff\\xff\\xff\\xff\", bytes(1400)):\n"
                     "  s.sendto(junk, (\"239.74.163.2\", 43113))\n"
                     "bus.send(can.Message(arbitration_id=0x1, data=[9]))"),
              "");
    EXPECT_EQ(gather(*port, 1).size(), 1U);
    EXPECT_EQ(port->counters().malformed, 5U);
}

TEST(OpenPort, WhatCannotBeOpenedSaysWhyAndWhatToDoInOneLine) {
    const int probe = ::socket(PF_CAN, SOCK_RAW, CAN_RAW);
    EXPECT_EQ(
        error_of("can:nosuch0"),
        probe >= 0
            ? "can:nosuch0: there is no such interface; make a virtual one: sudo ip link add dev nosuch0 "
              "type vcan && sudo ip link set up nosuch0"
            : "can:nosuch0: this kernel has no CAN (sudo modprobe can_raw); without it use "
              "udpcan:239.74.163.2:43113");
    if (probe >= 0) ::close(probe);
    EXPECT_EQ(error_of("can:"), "can:: the interface is missing, as in can:vcan0");
    EXPECT_EQ(error_of("can:can0?speed=1"),
              "can:can0?speed=1: unknown option \"speed=1\"; there is timestamps=hardware");
    EXPECT_EQ(error_of("udpcan:239.74.163.2"),
              "udpcan:239.74.163.2: group and port are wanted, as in udpcan:239.74.163.2:43113");
    EXPECT_EQ(error_of("udpcan:10.0.0.1:43113"),
              "udpcan:10.0.0.1:43113: \"10.0.0.1\" is not a multicast address; python-can's is 239.74.163.2");
    EXPECT_EQ(error_of("udpcan:239.1.2.3:43113"),
              "udpcan:239.1.2.3:43113: no route for this group; for this machine alone: sudo ip link set lo "
              "multicast on && "
              "sudo ip route add 239.1.2.3/32 dev lo (No such device)");
    EXPECT_EQ(error_of("serial:x"), "serial:x: a CAN bus is can:INTERFACE or udpcan:GROUP:PORT");
}

}  // namespace
}  // namespace shiftrig::io::can
