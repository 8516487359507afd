// The whole rig in lockstep on a bus that misbehaves: the same seed leaves the same tick records, bit for bit.
// SHIFTRIG_FAULT_RUNS=1000 SHIFTRIG_FAULT_FROM=0 choose how many seeds, and the first.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <random>
#include <set>

#include "apps/rig/choices.h"
#include "apps/rig/session.h"

namespace shiftrig::rig {
namespace {

const std::string scenarios = SHIFTRIG_SOURCE_DIR "/config/scenarios/";

int number_from(const char* name, int otherwise) {
    const char* given = std::getenv(name);
    return given ? std::atoi(given) : otherwise;
}

// FNV-1a, eight bytes at a time.
struct Fingerprint {
    std::uint64_t value = 14695981039346656037U;
    template <class T>
    void add(std::span<const T> items) {
        const auto bytes = std::as_bytes(items);
        for (std::size_t i = 0; i < bytes.size(); i += 8) {
            std::uint64_t word = 0;
            std::memcpy(&word, &bytes[i], std::min<std::size_t>(8, bytes.size() - i));
            value = (value ^ word) * 1099511628211U;
        }
    }
    void add(double number) { add(std::span<const double>(&number, 1)); }
};

// One to five faults of any kind on any message at any time of three seconds, on an ideal bus or one that takes its time.
std::string faults_of(unsigned seed) {
    std::minstd_rand random(seed + 1);
    const auto below = [&random](unsigned bound) { return static_cast<unsigned>(random() % bound); };
    const auto unit = [&random] { return static_cast<double>(random() % 1000) / 1000; };
    const auto one_of = [&](const auto& names) {
        return std::string(names[below(static_cast<unsigned>(std::size(names)))]);
    };
    static constexpr std::array messages = {
        "ClutchCommandA", "ClutchCommandB", "ClutchCommandC", "ClutchFeedbackA",
        "ShaftSpeedsA",   "ShaftSpeedsB",   "EEC1",           "TC1"};
    static constexpr std::array sealed = {"ClutchCommandA", "ClutchCommandB", "ClutchFeedbackA",
                                          "ShaftSpeedsB"};
    std::string yaml =
        "{seed: " + std::to_string(seed) + (below(2) ? ", bit_rate: 250000" : "") + ", faults: [";
    const unsigned count = 1 + below(5);
    for (unsigned i = 0; i < count; ++i) {
        const double from = 3 * unit(), until = from + 0.01 + unit();
        const std::string when =
            ", from_s: " + std::to_string(from) + ", until_s: " + std::to_string(until) + "}, ";
        const std::string often = ", probability: " + std::to_string(0.001 + 0.999 * unit());
        const std::string what = ", message: " + one_of(messages), whole = ", message: " + one_of(sealed);
        switch (below(11)) {
            case 0:
                yaml += "{fault: drop" + what + often + when;
                break;
            case 1:
                yaml += "{fault: delay" + what + often + ", by_ms: " + std::to_string(1 + below(40)) + when;
                break;
            case 2:
                yaml += "{fault: jitter" + often + ", by_ms: " + std::to_string(1 + below(15)) + when;
                break;
            case 3:
                yaml += "{fault: duplicate" + often + when;
                break;
            case 4:
                yaml += "{fault: reorder" + often + when;
                break;
            case 5:
                yaml += "{fault: corrupt, bits: " + std::to_string(1 + below(4)) + often + when;
                break;
            case 6:
                yaml += "{fault: freeze, message: ShaftSpeedsB, signal: PowershiftOutput" + when;
                break;
            case 7:
                yaml += "{fault: wrong_counter" + whole + often + when;
                break;
            case 8:
                yaml += "{fault: wrong_checksum" + whole + often + when;
                break;
            case 9:
                yaml += "{fault: babble, id: " + std::to_string(below(1U << 29)) +
                        ", rate_hz: " + std::to_string(100 + below(1900)) + when;
                break;
            default:
                yaml += "{fault: bus_off" + when;
        }
    }
    return yaml.substr(0, yaml.size() - 2) + "]}";
}

struct Outcome {
    std::uint64_t records = 0;  // fingerprint of all tick records
    bool safe_command = false;  // it acted at some time
    bool finite = true;
};

Outcome run(unsigned seed) {
    static constexpr std::array subjects = {"plough_upshift", "plough_downshift", "kick_down",
                                            "coast_downshift"};
    auto scenario = io::read_scenario(scenarios + subjects[seed % subjects.size()] + ".yaml");
    scenario.start.settle = std::min(scenario.start.settle, 2.0);
    scenario.bus_faults = YAML::Load(faults_of(seed));
    Choices choices;
    choices.lockstep = true;
    Rig rig(make_setup(choices, std::move(scenario)));

    Outcome outcome;
    Fingerprint records;
    SessionOptions options;
    options.loop.period = rig.setup().tick_ns;
    options.loop.pace = rt::Pace::lockstep;
    options.loop.slots = 3'500;
    options.after = [&](Rig& r, const rt::Tick&) {
        records.add(r.input_values());
        records.add(r.output_values());
        records.add(r.rig_values());
        records.add(r.state().bytes());
        for (const auto& event : r.plant_events()) {
            records.add(static_cast<double>(event.kind) + 256 * event.device);
            for (const double number : {event.time, event.torque, event.capacity, event.slip})
                records.add(number);
        }
        outcome.safe_command = outcome.safe_command || r.value(r.own().safe_command) > 0;
        for (const double number : r.output_values())
            outcome.finite = outcome.finite && std::isfinite(number);
    };
    Session(rig, std::move(options)).run();
    outcome.records = records.value;
    return outcome;
}

TEST(BusFaults, LockstepRunsAreRepeatedBitForBitFromTheirSeeds) {
    const int runs = number_from("SHIFTRIG_FAULT_RUNS", 40), first = number_from("SHIFTRIG_FAULT_FROM", 0);
    std::set<std::uint64_t> different;
    int safe_commands = 0;
    for (int seed = first; seed < first + runs; ++seed) {
        const Outcome once = run(static_cast<unsigned>(seed)), again = run(static_cast<unsigned>(seed));
        ASSERT_EQ(once.records, again.records)
            << "seed " << seed << ": " << faults_of(static_cast<unsigned>(seed));
        EXPECT_TRUE(once.finite) << "seed " << seed << ": " << faults_of(static_cast<unsigned>(seed));
        different.insert(once.records);
        safe_commands += once.safe_command;
    }
    std::printf("%d runs, each twice: %zu different ones, the safe command acted in %d\n", runs,
                different.size(), safe_commands);
    EXPECT_GE(different.size(), static_cast<std::size_t>(0.9 * runs)) << "seeds make a difference";
    EXPECT_GT(safe_commands, runs / 20);
    EXPECT_LT(safe_commands, runs);
}

}  // namespace
}  // namespace shiftrig::rig
