// A bus that misbehaves on purpose, and always in the same way.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <map>

#include "io/can/faults.h"
#include "io/can/inprocess.h"
#include "io/input_error.h"
#include "tests/io/can_rig_signals.h"
#include "tests/io/count_allocations.h"

namespace shiftrig::io::can {
namespace {

constexpr std::int64_t kMs = 1'000'000;

const Mapping& mapping() {
    static const Mapping the_mapping = tractor_mapping();
    return the_mapping;
}

FaultPlan plan_of(const std::string& yaml) {
    return parse_faults(YAML::Load(yaml), "x.yaml", mapping());
}

// Numbered frames through a faulty port, one a millisecond, both ways.
struct Wire {
    explicit Wire(const std::string& yaml) : faulty(bus.end(0), plan_of(yaml), mapping()) {}
    InProcessBus bus{2};
    FaultyPort faulty;
    std::array<Frame, 64> frames;
    std::vector<std::pair<int, int>> received, sent;  // (number, arrival in ms)

    static Frame numbered(int number, std::uint32_t id = 0x18FF1003) {
        Frame frame;
        frame.id = id;
        frame.extended = true;
        frame.length = 8;
        frame.data[0] = static_cast<std::uint8_t>(number);
        return frame;
    }
    void run(int from_ms, int to_ms) {
        for (int ms = from_ms; ms < to_ms; ++ms) {
            bus.end(1).send(ms * kMs, numbered(ms));
            std::size_t count = faulty.receive(ms * kMs, frames);
            for (std::size_t i = 0; i < count; ++i) received.emplace_back(frames[i].data[0], ms);
            faulty.send(ms * kMs, numbered(ms, 0x18FF2080));
            count = bus.end(1).receive(ms * kMs, frames);
            for (std::size_t i = 0; i < count; ++i) sent.emplace_back(frames[i].data[0], ms);
        }
    }
};

TEST(Faults, DropHitsItsMessageItsDirectionAndItsTimeOnly) {
    Wire wire("[{fault: drop, message: ClutchCommandA, direction: received, from_s: 0.010, until_s: 0.020}]");
    wire.run(0, 30);
    ASSERT_EQ(wire.received.size(), 20U);
    for (const auto& [number, ms] : wire.received) EXPECT_TRUE(number < 10 || number >= 20) << number;
    EXPECT_EQ(wire.sent.size(), 30U);
    FaultEvent event;
    ASSERT_TRUE(wire.faulty.next_event(event));
    EXPECT_TRUE(event.begins);
    EXPECT_EQ(event.time_ns, 10 * kMs);
    ASSERT_TRUE(wire.faulty.next_event(event));
    EXPECT_FALSE(event.begins);
    EXPECT_EQ(event.frames, 10U);
    EXPECT_FALSE(wire.faulty.next_event(event));
    EXPECT_EQ(describe(wire.faulty.plan().faults[0]), "drop ClutchCommandA");
}

TEST(Faults, ProbabilityDropsAboutThatShareOfFramesAndTheSameOnesEachTime) {
    const std::string yaml = "{seed: 9, faults: [{fault: drop, probability: 0.25}]}";
    Wire a(yaml), b(yaml), other("{seed: 10, faults: [{fault: drop, probability: 0.25}]}");
    for (Wire* wire : {&a, &b, &other}) wire->run(0, 250);
    // Of 500 frames a quarter is lost, ± 4.5 standard deviations (√(500·¼·¾) = 9.7).
    EXPECT_NEAR(static_cast<double>(a.received.size() + a.sent.size()), 375, 44);
    EXPECT_EQ(a.received, b.received);
    EXPECT_EQ(a.sent, b.sent);
    EXPECT_NE(a.received, other.received);
}

TEST(Faults, DelayIsExactAndJitterStaysWithinItsBound) {
    Wire delayed("[{fault: delay, by_ms: 7}]");
    delayed.run(0, 50);
    for (const auto& [number, ms] : delayed.received) EXPECT_EQ(ms, number + 7);
    for (const auto& [number, ms] : delayed.sent) EXPECT_EQ(ms, number + 7);
    EXPECT_EQ(delayed.received.size(), 43U);

    Wire jittered("[{fault: jitter, by_ms: 5}]");
    jittered.run(0, 200);
    std::map<int, int> lateness;
    for (const auto& [number, ms] : jittered.received) ++lateness[ms - number];
    EXPECT_GE(lateness.begin()->first, 0);
    EXPECT_LE(lateness.rbegin()->first, 5);
    EXPECT_GT(lateness.size(), 3U);
    EXPECT_FALSE(std::is_sorted(jittered.received.begin(), jittered.received.end()))
        << "frames overtake each other";
}

TEST(Faults, DuplicateComesTwiceAndReorderSwapsNeighbours) {
    Wire twice("[{fault: duplicate}]");
    twice.run(0, 10);
    ASSERT_EQ(twice.received.size(), 20U);
    EXPECT_EQ(twice.received[6], twice.received[7]);

    Wire swapped("[{fault: reorder}]");
    swapped.run(0, 10);
    const std::vector<std::pair<int, int>> expected{{1, 1}, {0, 1}, {3, 3}, {2, 3}, {5, 5},
                                                    {4, 5}, {7, 7}, {6, 7}, {9, 9}, {8, 9}};
    EXPECT_EQ(swapped.received, expected);
}

TEST(Faults, CorruptFlipsSoManyBitsOfTheData) {
    Wire wire("[{fault: corrupt, bits: 3, direction: received}]");
    int flipped = 0;
    for (int i = 0; i < 200; ++i) {
        wire.bus.end(1).send(i * kMs, Wire::numbered(i));
        ASSERT_EQ(wire.faulty.receive(i * kMs, wire.frames), 1U);
        const Frame original = Wire::numbered(i);
        int bits = 0;
        for (std::size_t k = 0; k < 8; ++k)
            bits += std::popcount(static_cast<unsigned>(original.data[k] ^ wire.frames[0].data[k]));
        ASSERT_TRUE(bits == 3 || bits == 1) << bits;  // the same bit may be hit twice
        flipped += bits == 3;
    }
    EXPECT_GT(flipped, 150);
}

TEST(Faults, BusOffSilencesBothWaysAndIsSeenInTheState) {
    Wire wire("[{fault: bus_off, from_s: 0.010, until_s: 0.020}]");
    wire.run(0, 15);
    EXPECT_EQ(wire.faulty.state(), PortState::bus_off);
    wire.run(15, 30);
    EXPECT_EQ(wire.faulty.state(), PortState::up);
    EXPECT_EQ(wire.received.size(), 20U);
    EXPECT_EQ(wire.sent.size(), 20U);
    EXPECT_EQ(wire.faulty.counters().bus_off_events, 1U);
    EXPECT_EQ(wire.faulty.counters().send_dropped, 10U);
}

// Number n is due at n + 7 ms; the bus is off from 10 to 20 ms, so numbers 3 to 12 meet it on their way, and it refuses 10 to 19.
TEST(Faults, WhatIsUnderWayWhenTheBusGoesOffIsLostAndCounted) {
    Wire wire("[{fault: delay, by_ms: 7}, {fault: bus_off, from_s: 0.010, until_s: 0.020}]");
    wire.run(0, 40);
    std::vector<std::pair<int, int>> expected;
    for (int number = 0; number < 33; ++number)
        if (number < 3 || number >= 20) expected.emplace_back(number, number + 7);
    EXPECT_EQ(wire.received, expected);
    EXPECT_EQ(wire.sent, expected);
    const PortCounters counters = wire.faulty.counters();
    EXPECT_EQ(counters.receive_dropped, 17U);  // 3 … 19
    EXPECT_EQ(counters.send_dropped, 17U);
}

TEST(Faults, ABabblerTakesTheBusFromEverybodyElse) {
    InProcessBus bus(2, {.bit_rate = 250e3});
    FaultyPort faulty(bus.end(0), plan_of("[{fault: babble, rate_hz: 2500, id: 0x0}]"), mapping());
    std::array<Frame, 64> frames;
    int ours = 0;
    for (int ms = 0; ms < 1000; ++ms) {
        faulty.receive(ms * kMs, frames);
        if (ms % 10 == 0) bus.end(1).send(ms * kMs, Wire::numbered(ms));
        const std::size_t count = bus.end(1).receive(ms * kMs, frames);
        for (std::size_t i = 0; i < count; ++i) EXPECT_EQ(frames[i].id, 0U);
    }
    // 2500 frames of the most urgent identifier are more than the bus carries: the others never get through.
    const std::size_t count = bus.end(0).receive(999 * kMs, frames);
    for (std::size_t i = 0; i < count; ++i) ours += frames[i].id == 0x18FF1003;
    EXPECT_LE(ours, 1);
    EXPECT_GT(static_cast<double>(bus.busy_ns()), 0.99e9);
}

// ---- seen by the links on both sides ---------------------------------------------------------------------------

struct Sides {
    explicit Sides(const std::string& yaml, const InProcessOptions& options = {})
        : bus(2, options), faulty(bus.end(0), plan_of(yaml), mapping()) {}
    InProcessBus bus;
    FaultyPort faulty;
    SignalTable rig = rig_signals(), tcu;
    CanLink rig_link{mapping(), faulty, rig, {.role = Role::rig}};
    CanLink tcu_link{mapping(), bus.end(1), tcu, {.role = Role::controller}};

    void tick(int ms) {
        rig_link.receive(ms * kMs, rig);
        rig_link.send(ms * kMs, rig);
        tcu_link.receive(ms * kMs, tcu);
        tcu_link.send(ms * kMs, tcu);
    }
    static MessageReport report(const CanLink& link, const std::string& name) {
        for (const auto& message : link.report())
            if (message.name == name) return message;
        return {};
    }
};

TEST(Faults, AWrongChecksumAndAStandingCounterAreCaughtAndAFrozenSignalIsNot) {
    Sides checksum("[{fault: wrong_checksum, message: ClutchCommandA, direction: received, from_s: 0.05}]");
    Sides counter("[{fault: wrong_counter, message: ClutchCommandA, direction: received, from_s: 0.05}]");
    Sides frozen("[{fault: freeze, message: ShaftSpeedsB, signal: Wheels, direction: sent, from_s: 0.05}]");
    for (int ms = 0; ms < 300; ++ms) {
        for (Sides* sides : {&checksum, &counter, &frozen}) {
            value(sides->rig, "sensor.wheels.speed") = 1e-2 * ms;
            sides->tick(ms);
        }
    }
    EXPECT_GE(Sides::report(checksum.rig_link, "ClutchCommandA").wrong_checksum, 24U);
    EXPECT_FALSE(checksum.rig_link.command_valid());
    EXPECT_EQ(value(checksum.rig, "bus.ClutchCommandA.status"), 4);
    EXPECT_GE(Sides::report(counter.rig_link, "ClutchCommandA").wrong_counter, 23U);
    EXPECT_FALSE(counter.rig_link.command_valid());
    EXPECT_EQ(Sides::report(frozen.tcu_link, "ShaftSpeedsB").wrong_checksum, 0U);
    EXPECT_EQ(value(frozen.tcu, "bus.ShaftSpeedsB.status"), 1);
    EXPECT_LT(std::fabs(value(frozen.tcu, "sensor.wheels.speed")), 0.62) << "the value of 0.05 s";
    EXPECT_GT(value(frozen.tcu, "sensor.output.speed"), -1);
}

// Every fault at once on an overloaded bus, from 1000 seeds, each twice: the tables agree bit for bit.
TEST(Faults, AThousandSeededRunsAreRepeatedBitForBit) {
    const auto run = [](int seed) {
        Sides sides(
            "{seed: " + std::to_string(seed) +
                ", faults: [{fault: drop, probability: 0.1}, {fault: jitter, by_ms: 9, probability: 0.3}, "
                "{fault: duplicate, probability: 0.05}, {fault: corrupt, bits: 2, probability: 0.05}, "
                "{fault: reorder, probability: 0.1}, {fault: babble, rate_hz: 500, id: 0x10, from_s: 0.05, "
                "until_s: 0.1}, "
                "{fault: bus_off, from_s: 0.12, until_s: 0.15}]}",
            {.bit_rate = 250e3});
        std::uint64_t hash = 14695981039346656037U;
        double integral = 0;
        for (int ms = 0; ms < 200; ++ms) {
            // A stand-in for plant and controller, so that what arrives has consequences.
            integral += 1e-3 * value(sides.rig, "clutch.F1.pressure_command");
            value(sides.rig, "clutch.F1.pressure") = integral;
            value(sides.rig, "sensor.engine.speed") = 100 + 1e-6 * integral;
            const double pressure = value(sides.tcu, "clutch.F1.pressure");
            value(sides.tcu, "clutch.F1.pressure_command") =
                std::isnan(pressure) ? 1e5 : 5e5 + 0.7 * pressure;
            sides.tick(ms);
            for (const SignalTable* table : {&sides.rig, &sides.tcu})
                for (const double number : table->value) {
                    hash ^= std::bit_cast<std::uint64_t>(number);
                    hash *= 1099511628211U;
                }
        }
        return hash;
    };
    std::map<std::uint64_t, int> different;
    for (int seed = 0; seed < 1000; ++seed) {
        const std::uint64_t first = run(seed);
        ASSERT_EQ(run(seed), first) << "seed " << seed;
        ++different[first];
    }
    EXPECT_GT(different.size(), 990U) << "seeds make a difference";
}

TEST(Faults, NothingIsAllocatedWhileFaultsAct) {
    Sides sides(
        "[{fault: jitter, by_ms: 9}, {fault: duplicate, probability: 0.5}, {fault: reorder, probability: "
        "0.5}, {fault: babble, rate_hz: 900, id: 0x1}]");
    const CountAllocations allocations;
    for (int ms = 0; ms < 1000; ++ms) sides.tick(ms);
    EXPECT_EQ(allocations.count(), 0);
}

TEST(Faults, WhatIsWrongInAScenarioIsNamedWithItsPlace) {
    const auto error_of = [](const std::string& yaml) -> std::string {
        try {
            plan_of(yaml);
        } catch (const InputError& error) {
            return error.what();
        }
        return "accepted";
    };
    EXPECT_EQ(error_of("[{fault: drap}]"),
              "x.yaml:1:10: bus_faults: fault: \"drap\" is none of drop, delay, jitter, duplicate, reorder, "
              "corrupt, freeze, "
              "wrong_counter, wrong_checksum, babble, bus_off");
    EXPECT_EQ(error_of("[{fault: delay}]"), "x.yaml:1:2: bus_faults: delay needs by_ms");
    EXPECT_EQ(error_of("[{fault: drop, probability: 1.5}]"), "x.yaml:1:29: bus_faults: 1.5 is out of range");
    EXPECT_EQ(error_of("[{fault: drop, message: Nix}]"), "x.yaml:1:25: bus_faults: " SHIFTRIG_SOURCE_DIR
                                                         "/config/can/shiftrig.dbc has no message \"Nix\"");
    EXPECT_EQ(error_of("[{fault: freeze, message: EEC1, signal: Nix}]"),
              "x.yaml:1:41: bus_faults: message \"EEC1\" has no signal \"Nix\"");
    EXPECT_EQ(error_of("[{fault: wrong_counter, message: EEC1}]"),
              "x.yaml:1:2: bus_faults: wrong_counter needs a message with a counter");
    EXPECT_EQ(error_of("[{fault: drop, from_s: 2, until_s: 1}]"),
              "x.yaml:1:2: bus_faults: until_s must be after from_s");
    EXPECT_EQ(error_of("{seeds: 1, faults: []}"), "x.yaml:1:2: bus_faults: unknown key \"seeds\"");
    EXPECT_EQ(error_of("[{fault: drop, when: 1}]"), "x.yaml:1:16: bus_faults: unknown key \"when\"");
}

}  // namespace
}  // namespace shiftrig::io::can
