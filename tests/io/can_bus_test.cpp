#include <gtest/gtest.h>

#include <array>
#include <random>
#include <vector>

#include "io/can/inprocess.h"

namespace shiftrig::io::can {
namespace {

Frame extended(std::uint32_t id, std::uint8_t first = 0) {
    Frame frame;
    frame.id = id;
    frame.extended = true;
    frame.length = 8;
    frame.data[0] = first;
    return frame;
}

std::vector<Frame> drain(CanPort& port, std::int64_t now_ns) {
    std::array<Frame, 64> buffer;
    const std::size_t count = port.receive(now_ns, buffer);
    return {buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(count)};
}

TEST(InProcessBus, IdealBusDeliversToEveryOtherEndInOrderAndNeverToTheSender) {
    InProcessBus bus(3);
    ASSERT_TRUE(bus.end(0).send(5, extended(0x0CF00400, 1)));
    ASSERT_TRUE(bus.end(1).send(7, extended(0x18FF1003, 2)));
    EXPECT_EQ(drain(bus.end(0), 10).size(), 1U);
    EXPECT_EQ(drain(bus.end(1), 10).size(), 1U);
    const auto both = drain(bus.end(2), 10);
    ASSERT_EQ(both.size(), 2U);
    EXPECT_TRUE(both[0].same_as(extended(0x0CF00400, 1)));
    EXPECT_EQ(both[0].timestamp_ns, 5);
    EXPECT_TRUE(both[1].same_as(extended(0x18FF1003, 2)));
    EXPECT_TRUE(drain(bus.end(2), 11).empty());
}

TEST(InProcessBus, LowestIdentifierWinsAmongFramesOfTheSameInstantAndTheOthersWaitTheirTurn) {
    InProcessBus bus(3, {.bit_rate = 250e3});
    const Frame low_priority = extended(0x18FF1003), high_priority = extended(0x0CF00400);
    bus.end(0).send(1000, low_priority);
    bus.end(1).send(1000, high_priority);
    const std::int64_t first_end = 1000 + classic_bits(high_priority) * 4000LL;
    const std::int64_t second_end = first_end + classic_bits(low_priority) * 4000LL;

    EXPECT_TRUE(drain(bus.end(2), first_end - 1).empty());
    auto frames = drain(bus.end(2), first_end);
    ASSERT_EQ(frames.size(), 1U);
    EXPECT_EQ(frames[0].id, high_priority.id);
    EXPECT_EQ(frames[0].timestamp_ns, first_end);
    EXPECT_TRUE(drain(bus.end(2), second_end - 1).empty());
    frames = drain(bus.end(2), second_end);
    ASSERT_EQ(frames.size(), 1U);
    EXPECT_EQ(frames[0].id, low_priority.id);
    EXPECT_EQ(frames[0].timestamp_ns, second_end);
    EXPECT_EQ(bus.busy_ns(), second_end - 1000);
}

TEST(InProcessBus, AFrameOnTheWireIsNotInterruptedByAMoreUrgentOne) {
    InProcessBus bus(2, {.bit_rate = 250e3});
    const Frame slow = extended(0x18FF1003);
    bus.end(0).send(0, slow);
    bus.end(1).send(100'000, extended(0));  // 0.1 ms later, while the first takes at least 0.5 ms
    const auto frames = drain(bus.end(1), 600'000 + 100'000);
    ASSERT_EQ(frames.size(), 1U);
    EXPECT_EQ(frames[0].timestamp_ns, classic_bits(slow) * 4000LL);
}

TEST(InProcessBus, StandardFrameBeatsAnExtendedOneWithTheSameElevenBaseBits) {
    InProcessBus bus(3, {.bit_rate = 500e3});
    Frame standard;
    standard.id = 0x0CF00400 >> 18;
    standard.length = 8;
    bus.end(0).send(0, extended(0x0CF00400));
    bus.end(1).send(0, standard);
    const auto frames = drain(bus.end(2), 10'000'000);
    ASSERT_EQ(frames.size(), 2U);
    EXPECT_FALSE(frames[0].extended);
}

TEST(InProcessBus, AFullQueueRefusesAndCounts) {
    InProcessBus bus(2, {.bit_rate = 250e3, .queue_frames = 3});
    for (int i = 0; i < 3; ++i) EXPECT_TRUE(bus.end(0).send(0, extended(1)));
    EXPECT_FALSE(bus.end(0).send(0, extended(1)));
    EXPECT_EQ(bus.end(0).counters().send_dropped, 1U);
    EXPECT_EQ(bus.end(0).counters().sent, 3U);
    InProcessBus ideal(2, {.queue_frames = 3});
    for (int i = 0; i < 4; ++i) EXPECT_TRUE(ideal.end(0).send(0, extended(1)));
    EXPECT_EQ(ideal.end(1).counters().receive_dropped, 1U);
    EXPECT_EQ(drain(ideal.end(1), 0).size(), 3U);
}

// Bits written out one by one, stuffed and checked by the textbook, as an oracle of the fast count.
int bits_by_the_textbook(const Frame& frame) {
    std::vector<int> bits{0};
    const auto put = [&bits](std::uint64_t value, int count) {
        for (int i = count - 1; i >= 0; --i) bits.push_back(static_cast<int>((value >> i) & 1));
    };
    if (frame.extended) {
        put(frame.id >> 18, 11), put(3, 2), put(frame.id & 0x3FFFF, 18), put(0, 3);
    } else {
        put(frame.id, 11), put(0, 3);
    }
    put(frame.length, 4);
    for (int i = 0; i < frame.length; ++i) put(frame.data[static_cast<std::size_t>(i)], 8);
    // CRC as the remainder of polynomial division by x^15+x^14+x^10+x^8+x^7+x^4+x^3+1.
    std::vector<int> remainder = bits;
    remainder.insert(remainder.end(), 15, 0);
    const std::array<int, 16> divisor{1, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1};
    for (std::size_t i = 0; i + 15 < remainder.size(); ++i)
        if (remainder[i])
            for (std::size_t k = 0; k < 16; ++k) remainder[i + k] ^= divisor[k];
    bits.insert(bits.end(), remainder.end() - 15, remainder.end());
    std::vector<int> stuffed;
    int run = 0, last = -1;
    for (const int bit : bits) {
        stuffed.push_back(bit);
        run = bit == last ? run + 1 : 1;
        last = bit;
        if (run == 5) {
            stuffed.push_back(1 - bit);
            last = 1 - bit;
            run = 1;
        }
    }
    return static_cast<int>(stuffed.size()) + 3 + 7 + 3;
}

TEST(FrameLength, CountsStuffBitsExactlyAndStaysWithinTheKnownBounds) {
    std::mt19937 random(1);
    for (int i = 0; i < 20000; ++i) {
        Frame frame;
        frame.extended = i % 2 == 0;
        frame.id = static_cast<std::uint32_t>(random()) & (frame.extended ? 0x1FFFFFFFU : 0x7FFU);
        frame.length = static_cast<std::uint8_t>(random() % 9);
        const auto style = random() % 3;
        for (auto& byte : frame.data)
            byte = static_cast<std::uint8_t>(style == 0 ? 0 : style == 1 ? 0xFF : random());
        const int bits = classic_bits(frame);
        ASSERT_EQ(bits, bits_by_the_textbook(frame));
        ASSERT_LE(bits, worst_case_classic_bits(frame.extended, frame.length));
        ASSERT_GE(bits, (frame.extended ? 67 : 47) + 8 * frame.length);
    }
    EXPECT_EQ(worst_case_classic_bits(true, 8), 160);
    EXPECT_EQ(worst_case_classic_bits(false, 8), 135);
}

}  // namespace
}  // namespace shiftrig::io::can
