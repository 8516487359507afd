// A million random and mutated frames at a whole rig: its plant stays finite, its tick allocates nothing.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

#include "apps/rig/choices.h"
#include "io/can/codec.h"
#include "tests/io/count_allocations.h"

namespace shiftrig::rig {
namespace {

// Commands with and without a right seal, other messages of ours with any content, J1939's own groups, anything.
io::can::Frame random_frame(std::mt19937& random) {
    static constexpr std::uint32_t ours[] = {0x18FF1003, 0x18FF1103, 0x18FF1203, 0x0C000003,
                                             0x0CF00203, 0x18F00503, 0x18EAFFF9, 0x18EA80F9,
                                             0x18EEFF80, 0x1CECFF03, 0x1CEBFF03, 0x1CEC8003};
    io::can::Frame frame;
    frame.extended = random() % 10 != 0;
    frame.id = random() % 4 == 0 ? static_cast<std::uint32_t>(random()) : ours[random() % std::size(ours)];
    frame.id &= frame.extended ? 0x1FFFFFFFU : 0x7FFU;
    frame.length = static_cast<std::uint8_t>(random() % 4 == 0 ? random() % 9 : 8);
    frame.remote = random() % 50 == 0;
    for (std::size_t i = 0; i < 8; ++i) frame.data[i] = static_cast<std::uint8_t>(random());
    if (random() % 4 != 0) {
        const auto counter = static_cast<unsigned>(random() % 16);
        frame.data[7] = static_cast<std::uint8_t>(
            counter | io::can::tsc1_checksum(frame.id, frame.data.data(), counter) << 4);
    }
    return frame;
}

TEST(FrameFuzz, AMillionFramesLeaveThePlantFiniteAndTheTickWithoutAllocation) {
    Choices choices;
    choices.scenario = SHIFTRIG_SOURCE_DIR "/config/scenarios/plough_upshift.yaml";
    choices.buses = {"inprocess"};
    choices.controller = "none";
    Rig rig(make_setup(choices));
    io::can::CanPort* attacker = rig.buses().far_end();
    ASSERT_NE(attacker, nullptr);
    std::mt19937 random(4);
    std::array<io::can::Frame, 64> heard;
    bool shifted = false, safe = false;
    int allocations = 0;
    for (int tick = 0; tick < 100'000; ++tick) {
        for (int i = 0; i < 10; ++i) attacker->send(rig.sim_time_ns(), random_frame(random));
        {
            const io::CountAllocations counting;
            rig.tick();
            allocations += counting.count();
        }
        while (attacker->receive(rig.sim_time_ns(), heard) == heard.size()) {
        }
        shifted = shifted || rig.plant_events().size() > 0;
        safe = safe || rig.value(rig.own().safe_command) > 0;
        for (const double number : rig.output_values())
            ASSERT_TRUE(std::isfinite(number)) << "at " << rig.sim_time();
    }
    EXPECT_EQ(allocations, 0);
    EXPECT_TRUE(shifted) << "what was believed had consequences";
    EXPECT_TRUE(safe) << "and what was not, too";
}

}  // namespace
}  // namespace shiftrig::rig
