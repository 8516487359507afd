// Golden recordings: standard scenarios on the portable kernel, with the built-in controller. tests/data/golden/ has, per
// scenario, a hash over every value and event of the run and samples to see from where on it differs. They hold for
// every optimisation level. To update after a meant change (docs/recording.md):
//     SHIFTRIG_UPDATE_GOLDEN=1 ctest --test-dir build/release -R Golden
#include <gtest/gtest.h>

#include <charconv>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>

#include "io/recording/checksum.h"
#include "io/recording/csv.h"
#include "recorded_rig.h"

namespace shiftrig::rig {
namespace {

constexpr int sample_every = 250;  // ticks
constexpr double longest = 12;     // [s] of each scenario

// Counts how often a cached operator was found: not the machine's behaviour.
bool is_bookkeeping(const std::string& name) {
    return name.starts_with("certificate.mode_");
}

std::string digits(double value) {
    char text[32];
    return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

// Hash, then `tick signal value` lines.
std::string summary_of(const std::string& scenario) {
    const Setup setup = setup_for(scenario);
    Rig rig(setup);
    const auto ticks =
        static_cast<std::int64_t>(std::min(setup.scenario->duration, longest) * 1e9) / setup.tick_ns;
    std::vector<int> kept, sampled;
    for (int i = 0; i < rig.signals().size(); ++i) {
        const std::string& name = rig.signals().signal(i).name;
        if (!is_bookkeeping(name)) kept.push_back(i);
        if (name == "mass.engine.speed" || name == "mass.vehicle.speed" || name == "clutch.F2.torque" ||
            name == "clutch.F3.pressure" || name == "energy.dissipated")
            sampled.push_back(i);
    }
    std::string bytes, samples;
    const auto add = [&](const auto& number) {
        bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
    };
    std::string chain;  // hash of all ticks so far: the whole need not be kept
    for (std::int64_t tick = 0; tick < ticks; ++tick) {
        rig.tick();
        for (const int i : kept) add(rig.value(i));
        for (const auto& event : rig.plant_events()) {
            add(event.time);
            add(event.kind);
            add(event.device);
            add(event.torque);
            add(event.capacity);
            add(event.slip);
            add(event.value);
            add(event.members);
        }
        if ((tick + 1) % sample_every != 0 && tick + 1 != ticks) continue;
        chain = io::sha256(chain + bytes);
        bytes.clear();
        samples += std::to_string(tick) + " hash " + chain.substr(0, 16) + "\n";
        for (const int i : sampled)
            samples += std::to_string(tick) + " " + io::column_name(rig.signals().signal(i)) + " " +
                       digits(rig.value(i)) + "\n";
    }
    return "sha256 " + chain + "\n" + samples;
}

class Golden : public testing::TestWithParam<const char*> {};

TEST_P(Golden, RunIsTheSameToTheBit) {
    const std::string path = SHIFTRIG_SOURCE_DIR "/tests/data/golden/" + std::string(GetParam()) + ".txt";
    const std::string now = summary_of(GetParam());
    if (std::getenv("SHIFTRIG_UPDATE_GOLDEN")) {
        std::ofstream(path) << now;
        return;
    }
    std::ifstream file(path);
    ASSERT_TRUE(file) << path;
    std::istringstream actual(now);
    std::string expected_line, actual_line;
    std::getline(file, expected_line);
    std::getline(actual, actual_line);
    if (expected_line == actual_line) return;
    while (std::getline(file, expected_line) && std::getline(actual, actual_line))
        ASSERT_EQ(actual_line, expected_line)
            << "the first sample that differs; hashes cover the ticks up to theirs";
    FAIL() << "the hash differs, the samples do not: the golden file is damaged";
}

INSTANTIATE_TEST_SUITE_P(Scenarios, Golden,
                         testing::Values("plough_upshift", "standing_start", "coast_downshift",
                                         "article_fig11_good", "article_fig11_bad", "hold_on_slope"),
                         [](const auto& scenario) { return std::string(scenario.param); });

}  // namespace
}  // namespace shiftrig::rig
