#include "apps/rig/snapshot.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>

#include "apps/rig/fork.h"
#include "io/recording/snapshot.h"
#include "io/yaml_document.h"
#include "recorded_rig.h"
#include "tests/io/synthetic_recording.h"

namespace shiftrig::rig {
namespace {

using io::synthetic::TemporaryFile;

bool is_bookkeeping(const std::string& name) {
    return name.starts_with("certificate.mode_");
}

// plough_upshift up to `at`, written as a snapshot.
void write_snapshot_at(const std::string& path, double at, const Setup& setup = setup_for("plough_upshift")) {
    Rig rig(setup);
    SnapshotTaker taker(rig, at);
    rt::LoopSettings loop;
    loop.pace = rt::Pace::free;
    Collector collector(rig, 3000);
    while (!taker.taken()) {
        rig.tick();
        collector.take(rig);
        taker.offer(rig);
    }
    taker.write(path, rig, loop, collector.finish(rig));
}

void expect_same_tick(const Rig& whole, const Rig& continued) {
    const auto a = values_of(whole), b = values_of(continued);
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
        const auto& name = whole.signals().signal(static_cast<int>(i)).name;
        ASSERT_TRUE(std::memcmp(&a[i], &b[i], sizeof(double)) == 0 || is_bookkeeping(name))
            << name << " at " << whole.sim_time() << " s";
    }
    ASSERT_EQ(whole.plant_events().size(), continued.plant_events().size());
    ASSERT_EQ(whole.rig_events().size(), continued.rig_events().size());
    for (std::size_t i = 0; i < whole.rig_events().size(); ++i)
        ASSERT_EQ(explain(whole.signals(), whole.rig_events()[i]),
                  explain(continued.signals(), continued.rig_events()[i]));
}

// The whole run first catches up with the one that continues a snapshot.
void expect_same_ticks(Rig& whole, Rig& continued, int ticks) {
    while (whole.ticks() < continued.ticks()) whole.tick();
    for (int tick = 0; tick < ticks; ++tick) {
        whole.tick();
        continued.tick();
        ASSERT_NO_FATAL_FAILURE(expect_same_tick(whole, continued));
    }
}

class Continued : public testing::TestWithParam<double> {};

TEST_P(Continued, RunEqualsTheUninterruptedOneBitForBit) {
    TemporaryFile file(".lcmlog");
    write_snapshot_at(file.path, GetParam());
    const io::Manifest snapshot = io::read_snapshot(file.path);
    Rig continued(setup_of(snapshot)), whole(setup_for("plough_upshift"));
    resume(continued, snapshot);
    expect_same_ticks(whole, continued, 2000);
}

// Before, in the fill, in the torque phase and in the inertia phase of the shift.
INSTANTIATE_TEST_SUITE_P(Times, Continued, testing::Values(1.0, 2.1, 2.2, 2.32));

std::vector<std::string> scenarios() {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(SHIFTRIG_SOURCE_DIR "/config/scenarios"))
        if (entry.path().extension() == ".yaml") names.push_back(entry.path().stem());
    std::sort(names.begin(), names.end());
    return names;
}

// A scenario goes on from snapshots at these times [s], in rising order, as it does on its own.
void expect_same_from(const std::string& scenario, const std::vector<double>& times, double end) {
    Rig whole(setup_for(scenario));
    rt::LoopSettings loop;
    loop.pace = rt::Pace::free;
    std::vector<std::unique_ptr<Rig>> continued;
    while (whole.sim_time() < end) {
        if (continued.size() < times.size() && whole.sim_time() >= times[continued.size()]) {
            TemporaryFile file(".lcmlog");
            SnapshotTaker taker(whole, 0);
            taker.offer(whole);
            taker.write(file.path, whole, loop, {});
            const io::Manifest snapshot = io::read_snapshot(file.path);
            continued.push_back(std::make_unique<Rig>(setup_of(snapshot)));
            resume(*continued.back(), snapshot);
        }
        whole.tick();
        for (auto& each : continued) {
            each->tick();
            ASSERT_NO_FATAL_FAILURE(expect_same_tick(whole, *each));
        }
    }
    EXPECT_EQ(continued.size(), times.size());
}

class EveryScenario : public testing::TestWithParam<std::string> {};

// From its first, second and third quarter to the end, of long ones the first half minute: whatever a scenario does to
// machine, buses and controller has begun, is going on or is over in one of them.
TEST_P(EveryScenario, GoesOnFromItsSnapshotsAsIfNothingHadHappened) {
    const double end = std::min(30.0, setup_for(GetParam()).scenario->duration);
    expect_same_from(GetParam(), {0.25 * end, 0.5 * end, 0.75 * end}, end);
}

INSTANTIATE_TEST_SUITE_P(Scenarios, EveryScenario, testing::ValuesIn(scenarios()),
                         [](const auto& each) { return each.param; });

// The controller begins anew in the very tick after its silence, and must do so after a snapshot in between as well.
TEST(Snapshot, OfTheLastTicksOfASilenceKnowsOfIt) {
    expect_same_from("silent_controller", {3.998, 3.999, 4, 4.001}, 6);
}

// What happens to the calibration's file afterwards is nothing to a snapshot.
TEST(Snapshot, HoldsItsCalibration) {
    TemporaryFile file(".lcmlog"), calibration(".yaml");
    const std::string shipped = io::read_text(shipped_calibration());
    std::string text = shipped;
    const std::string relative = "../can/tractor.yaml";
    text.replace(text.find(relative), relative.size(), SHIFTRIG_SOURCE_DIR "/config/can/tractor.yaml");
    std::ofstream(calibration.path) << text;
    Choices choices;
    choices.scenario = SHIFTRIG_SOURCE_DIR "/config/scenarios/plough_upshift.yaml";
    choices.controller = "builtin:" + calibration.path;
    const rig::Setup setup = make_setup(choices);
    write_snapshot_at(file.path, 2.1, setup);
    std::filesystem::remove(calibration.path);

    const io::Manifest snapshot = io::read_snapshot(file.path);
    Rig continued(setup_of(snapshot)), whole(setup);
    resume(continued, snapshot);
    expect_same_ticks(whole, continued, 500);
}

// A model names its CAN files relative to itself, and may have been named relative to a folder that is not this one.
TEST(Snapshot, FindsTheFilesOfItsModelFromAnyFolder) {
    const TemporaryFile file("shiftrig_elsewhere.snap");
    const auto here = std::filesystem::current_path();
    std::filesystem::current_path(SHIFTRIG_SOURCE_DIR "/config");
    Choices choices;
    choices.scenario = "scenarios/plough_upshift.yaml";
    write_snapshot_at(file.path, 0.1, make_setup(choices));
    std::filesystem::current_path(std::filesystem::temp_directory_path());
    const io::Manifest snapshot = io::read_snapshot(file.path);
    EXPECT_FALSE(std::filesystem::path(snapshot.model_path).is_absolute()) << snapshot.model_path;
    const auto setup = setup_of(snapshot);
    std::filesystem::current_path(here);
    Rig rig(setup);
    resume(rig, snapshot);
    rig.tick();
    EXPECT_NEAR(rig.sim_time(), 0.101, 1e-9);
}

TEST(Snapshot, WithoutItsCalibrationIsRefused) {
    TemporaryFile file(".lcmlog");
    write_snapshot_at(file.path, 0.1);
    io::Manifest snapshot = io::read_snapshot(file.path);
    snapshot.facts.erase("calibration_text");
    EXPECT_THROW(setup_of(snapshot), io::InputError);
}

TEST(Snapshot, OfAnotherMachineIsRefused) {
    TemporaryFile file(".lcmlog");
    write_snapshot_at(file.path, 0.5);
    const io::Manifest snapshot = io::read_snapshot(file.path);
    Rig other(setup_for("article_fig11_good"));
    EXPECT_THROW(resume(other, snapshot), io::InputError);
}

TEST(Snapshot, RecordingIsNoSnapshot) {
    TemporaryFile file(".lcmlog");
    io::synthetic::write(file.path, 3);
    try {
        io::read_snapshot(file.path);
        FAIL();
    } catch (const io::RecordingError& error) {
        EXPECT_EQ(
            error.what(),
            file.path + ": is a recording, not a snapshot; `shiftrig run --snapshot-at T FILE` makes one");
    }
}

std::vector<Branch> forked(const std::string& path, const std::vector<std::string>& vary, int threads,
                           std::int64_t branches = 12) {
    std::vector<Variation> variations;
    for (const auto& text : vary) variations.push_back(parse_variation(text));
    ForkOptions options;
    options.threads = threads;
    std::atomic<std::int64_t> done{0};
    const Plan plan(std::move(variations), branches, 5);
    return fork(io::read_snapshot(path), plan, options, done);
}

TEST(Fork, RankingIsTheSameWhateverTheThreads) {
    TemporaryFile file(".lcmlog");
    write_snapshot_at(file.path, 2.14);
    const std::vector<std::string> vary = {"calibration.shift.inertia_time_s=0.15:0.4",
                                           "environment.mobility_number=40:60"};
    const auto one = forked(file.path, vary, 1), three = forked(file.path, vary, 3);
    ASSERT_EQ(one.size(), 12u);
    for (std::size_t i = 0; i < one.size(); ++i) {
        EXPECT_EQ(one[i].number, three[i].number) << "rank " << i + 1;
        EXPECT_EQ(one[i].burden, three[i].burden);
        EXPECT_TRUE(one[i].completed);
    }
    EXPECT_LT(one.front().burden, one.back().burden);
}

TEST(Fork, LeakingClutchRanksBehindASoundOne) {
    TemporaryFile file(".lcmlog");
    write_snapshot_at(file.path, 2.14);
    const auto branches = forked(file.path, {"clutch.F3.leak=0.5,0"}, 2);
    ASSERT_EQ(branches.size(), 2u);
    EXPECT_EQ(branches[0].values[0], 0);
    EXPECT_GT(branches[1].burden, branches[0].burden);
}

TEST(Fork, ModelParametersAreVariedRelativeToWhatTheyAre) {
    TemporaryFile file(".lcmlog");
    write_snapshot_at(file.path, 2.14);
    const auto branches = forked(file.path, {"model.masses.vehicle.mass_kg=+-10%"}, 2, 3);
    ASSERT_EQ(branches.size(), 3u);
    for (const auto& branch : branches) {
        EXPECT_EQ(branch.error, "");
        EXPECT_GE(branch.values[0], 0.9);
        EXPECT_LE(branch.values[0], 1.1);
    }
    EXPECT_NE(branches[0].burden, branches[1].burden);
}

TEST(Fork, UnknownNameIsToldWithItsNeighbours) {
    TemporaryFile file(".lcmlog");
    write_snapshot_at(file.path, 0.1);
    try {
        forked(file.path, {"clutch.F3.leek=0,1"}, 1);
        FAIL();
    } catch (const io::InputError& error) {
        EXPECT_TRUE(std::string(error.what())
                        .starts_with("--vary clutch.F3.leek: no such signal, or not with its unit's suffix; "
                                     "nearest: clutch.F3.leak"))
            << error.what();
    }
}

std::string fork_refusal(const std::string& path, const std::string& vary) {
    try {
        forked(path, {vary}, 1, 2);
        return "";
    } catch (const io::InputError& error) {
        return error.what();
    }
}

TEST(Fork, SignalBeyondItsRangeIsRefusedBeforeAnyBranch) {
    TemporaryFile file(".lcmlog");
    write_snapshot_at(file.path, 0.1);
    EXPECT_EQ(fork_refusal(file.path, "clutch.F3.leak=0,2"),
              "--vary clutch.F3.leak = 2; must be within 0 and 1");
    EXPECT_EQ(fork_refusal(file.path, "environment.grade_percent=0:2000"),
              "--vary environment.grade_percent = 2000; must be within -1000 and 1000");
    EXPECT_EQ(fork_refusal(file.path, "driver.throttle=+-60%"),
              "--vary driver.throttle = 1.16496; must be within 0 and 1");
    EXPECT_EQ(fork_refusal(file.path, "driver.lever=2,2.5"),
              "--vary driver.lever = 2.5; must be a whole number");
    EXPECT_EQ(fork_refusal(file.path, "driver.lever=2:3"),
              "--vary driver.lever: takes whole numbers; write NAME=A,B,C");
    EXPECT_EQ(fork_refusal(file.path, "mass.vehicle.speed_kmh=3"),
              "--vary mass.vehicle.speed_kmh: this signal is not the user's to set");
}

TEST(Fork, BranchesThatCannotRunStandLast) {
    TemporaryFile file(".lcmlog");
    write_snapshot_at(file.path, 2.14);
    const auto branches = forked(file.path, {"model.masses.vehicle.mass_kg=-5,7000"}, 1);
    ASSERT_EQ(branches.size(), 2u);
    EXPECT_EQ(branches[0].error, "");
    EXPECT_TRUE(branches[1].refused);
    EXPECT_TRUE(branches[1].error.ends_with("mass_kg = -5; must be > 0")) << branches[1].error;
}

TEST(Fork, BranchThatDoesNotStayFiniteIsNotJudged) {
    TemporaryFile file(".lcmlog");
    write_snapshot_at(file.path, 2.14);
    const auto branches = forked(file.path, {"model.masses.vehicle.mass_kg=1e-300"}, 1);
    ASSERT_EQ(branches.size(), 1u);
    EXPECT_FALSE(branches[0].refused);
    EXPECT_FALSE(branches[0].shifted);
    EXPECT_TRUE(branches[0].error.ends_with("ticks the state is not finite")) << branches[0].error;
}

TEST(Variation, IsReadAsWritten) {
    EXPECT_EQ(parse_variation("clutch.F3.leak=0,0.5").values, (std::vector<double>{0, 0.5}));
    EXPECT_EQ(parse_variation("calibration.a.b=1:2:3").values, (std::vector<double>{1, 1.5, 2}));
    const auto around = parse_variation("model.x=+-10%");
    EXPECT_TRUE(around.relative && around.values.empty());
    EXPECT_DOUBLE_EQ(around.low, 0.9);
    EXPECT_DOUBLE_EQ(around.high, 1.1);
    EXPECT_THROW(parse_variation("clutch.F3.leak"), io::InputError);
    for (const char* wrong : {"a", "nan", "1:inf", "1:1e400", "1:2:nan", "1:2:2.5", "1:2:1", "-1e308:1e308",
                              "+-nan%", "+--5%", "+-0%"})
        EXPECT_THROW(parse_variation(std::string("clutch.F3.leak=") + wrong), io::InputError) << wrong;
}

}  // namespace
}  // namespace shiftrig::rig
