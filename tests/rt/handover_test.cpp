#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <thread>

#include "rt/latest_value.h"
#include "rt/queue.h"

namespace shiftrig::rt {
namespace {

struct Block {
    std::array<std::int64_t, 64> words{};
};
Block block_of(std::int64_t number) {
    Block block;
    block.words.fill(number);
    return block;
}

TEST(LatestValue, ReadsItsInitialValueUntilSomethingIsWritten) {
    LatestValue<int> latest(7);
    EXPECT_FALSE(latest.has_news());
    EXPECT_EQ(latest.read(), 7);
    latest.write(8);
    latest.write(9);
    EXPECT_TRUE(latest.has_news());
    EXPECT_EQ(latest.read(), 9);
    EXPECT_EQ(latest.read(), 9);
}

TEST(LatestValue, ReaderNeverSeesATornOrAnOlderValueAndEndsWithTheLast) {
    constexpr std::int64_t writes = 200'000;
    LatestValue<Block> latest;
    std::thread writer([&] {
        for (std::int64_t i = 1; i <= writes; ++i) latest.write(block_of(i));
    });
    std::int64_t seen = 0;
    while (seen < writes) {
        const Block& block = latest.read();
        for (const std::int64_t word : block.words) ASSERT_EQ(word, block.words[0]);
        ASSERT_GE(block.words[0], seen);
        seen = block.words[0];
    }
    writer.join();
}

TEST(Queue, StalledConsumerCostsCountedValuesAndNeverBlocksTheProducer) {
    Queue<int> queue(100);
    int pushed = 0;
    for (int i = 0; i < 1000; ++i) pushed += queue.push(i);
    EXPECT_GE(pushed, 100);
    EXPECT_LT(pushed, 1000);
    EXPECT_EQ(queue.dropped(), 1000 - pushed);
    int value = -1, popped = 0;
    while (queue.pop(value)) EXPECT_EQ(value, popped++);
    EXPECT_EQ(popped, pushed);
}

TEST(Queue, KeepsOrderBetweenThreads) {
    Queue<std::int64_t> queue(512);
    constexpr std::int64_t count = 200'000;
    std::thread producer([&] {
        for (std::int64_t i = 0; i < count; ++i) {
            while (!queue.push(i)) std::this_thread::yield();
        }
    });
    std::int64_t value = 0;
    for (std::int64_t expected = 0; expected < count; ++expected) {
        while (!queue.pop(value)) std::this_thread::yield();
        ASSERT_EQ(value, expected);
    }
    producer.join();
}

}  // namespace
}  // namespace shiftrig::rt
