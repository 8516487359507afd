// The plant thread after its start: no allocation, no page fault, exactly the ticks it was asked for. malloc and
// its kin are this program's own here and count, per thread, what is called while a tick runs.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <functional>
#include <optional>
#include <string>
#include <thread>

#include "apps/rig/choices.h"
#include "apps/rig/session.h"
#include "apps/tcu/calibration.h"
#include "apps/tcu/node.h"
#include "io/can/mapping.h"
#include "io/recording/writer.h"
#include "rt/thread.h"

namespace {
thread_local bool counting = false;
std::atomic<long> allocations{0};
void count() {
    if (counting) allocations.fetch_add(1, std::memory_order_relaxed);
}
}  // namespace

// glibc's own entry points, under which ours stand.
extern "C" {
void* __libc_malloc(size_t size);
void* __libc_calloc(size_t count, size_t size);
void* __libc_realloc(void* block, size_t size);
void* __libc_memalign(size_t alignment, size_t size);
void __libc_free(void* block);

void* malloc(size_t size) noexcept {
    count();
    return __libc_malloc(size);
}
void* calloc(size_t number, size_t size) noexcept {
    count();
    return __libc_calloc(number, size);
}
void* realloc(void* block, size_t size) noexcept {
    count();
    return __libc_realloc(block, size);
}
void* aligned_alloc(size_t alignment, size_t size) noexcept {
    count();
    return __libc_memalign(alignment, size);
}
int posix_memalign(void** block, size_t alignment, size_t size) noexcept {
    count();
    *block = __libc_memalign(alignment, size);
    return *block == nullptr ? ENOMEM : 0;
}
void free(void* block) noexcept {
    if (block != nullptr) count();
    __libc_free(block);
}
}

namespace shiftrig::rig {
namespace {

struct Observed {
    std::int64_t executed = 0, skipped = 0;
    long allocations = 0, page_faults = 0;
    std::int64_t shifts_of_state = 0;  // events of the plant: the run was no idle one
    std::int64_t commands_answered = 0;
};

struct Run {
    std::string scenario = "plough_upshift.yaml";
    double duration = 6;  // [s]
    rt::Pace pace = rt::Pace::free;
    std::string bus = "inprocess";
};

// The reference controller on the other end of a real bus, in a thread instead of a process.
class ControllerBeside {
  public:
    explicit ControllerBeside(const std::string& bus)
        : thread_([this, bus] {
              const auto calibration =
                  tcu::read_calibration(SHIFTRIG_SOURCE_DIR "/config/calibration/tractor.yaml");
              const auto mapping = io::can::read_mapping(calibration.bus.mapping);
              tcu::Node node(calibration, bus, &mapping, false);
              for (const rt::SteadyClock clock; !stop_;) {
                  node.bus().wait(1'000'000);
                  node.tick(clock.now());
              }
          }) {}
    ~ControllerBeside() {
        stop_ = true;
        thread_.join();
    }

  private:
    std::atomic<bool> stop_{false};
    std::thread thread_;
};

// A scenario in a thread set up as the plant thread of `shiftrig run` is, recorded, collected and traced.
Observed observe(const Run& run) {
    Choices choices;
    choices.scenario = std::string(SHIFTRIG_SOURCE_DIR) + "/config/scenarios/" + run.scenario;
    choices.buses = {run.bus};
    Rig rig(make_setup(choices));
    std::optional<ControllerBeside> controller;
    if (run.bus != "inprocess") controller.emplace(run.bus);
    rt::set_up_memory({});
    char path[] = "/tmp/realtime_test_XXXXXX";
    close(mkstemp(path));
    Observed observed;
    {
        io::RecordingWriter recording(path);
        SessionOptions options;
        options.loop.period = rig.setup().tick_ns;
        options.loop.slots = static_cast<std::int64_t>(run.duration * 1e9) / rig.setup().tick_ns;
        options.loop.pace = run.pace;
        Collector collector(rig, options.loop.slots);
        rt::Trace trace(20'000);
        options.recording = &recording;
        options.collector = &collector;
        options.trace = &trace;
        rt::PageFaults at_start;
        options.before = [&](Rig&, const rt::Tick& tick) {
            if (tick.executed == 0) {
                at_start = rt::page_faults_of_this_thread();
                allocations = 0;
            }
            counting = true;
        };
        // The recorder's and the collector's work of the tick comes before this hook.
        options.after = [&](Rig& each, const rt::Tick&) {
            counting = false;
            observed.shifts_of_state += static_cast<std::int64_t>(each.plant_events().size());
        };
        Session session(rig, std::move(options));
        std::thread([&] {
            rt::set_up_thread({});
            session.run();
            const rt::PageFaults at_end = rt::page_faults_of_this_thread();
            observed.page_faults = at_end.major - at_start.major + at_end.minor - at_start.minor;
        }).join();
        observed.allocations = allocations;
        observed.executed = session.report().executed;
        observed.skipped = session.report().skipped;
        observed.commands_answered = session.command_to_signal().count();
        recording.end();
    }
    unlink(path);
    return observed;
}

// In a child, so that locked memory stays its own.
Observed observe_in_child(const Run& run) {
    int channel[2];
    EXPECT_EQ(pipe(channel), 0);
    const pid_t child = fork();
    if (child == 0) {
        const Observed observed = observe(run);
        const bool written = write(channel[1], &observed, sizeof observed) == sizeof observed;
        _exit(written ? 0 : 1);
    }
    close(channel[1]);
    Observed observed;
    EXPECT_EQ(read(channel[0], &observed, sizeof observed), static_cast<ssize_t>(sizeof observed));
    close(channel[0]);
    int status = 0;
    EXPECT_EQ(waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
    return observed;
}

TEST(AllocationCounter, SeesAnAllocation) {
    allocations = 0;
    counting = true;
    auto* block =
        new std::function<int()>([big = std::array<char, 256>{}] { return static_cast<int>(big[0]); });
    counting = false;
    EXPECT_GE(allocations, 1);
    delete block;
}

TEST(PlantThread, NeitherAllocatesNorFaultsInAnyTickOfAShift) {
    const Observed observed = observe_in_child({});
    EXPECT_EQ(observed.executed, 6000);
    EXPECT_GT(observed.shifts_of_state, 3);
    EXPECT_EQ(observed.allocations, 0);
    EXPECT_EQ(observed.page_faults, 0);
}

// New modes are built, faults act, the safe command comes and goes: still nothing.
TEST(PlantThread, NeitherAllocatesNorFaultsInLaunchReversalFaultsAndTieUp) {
    for (const char* scenario :
         {"standing_start.yaml", "shuttle_reversal.yaml", "silent_controller.yaml", "stuck_closed.yaml",
          "overlapping_pressures.yaml", "speed_sensor_loss.yaml", "cold_oil.yaml"}) {
        const Observed observed = observe_in_child({.scenario = scenario, .duration = 5});
        EXPECT_EQ(observed.executed, 5000) << scenario;
        EXPECT_EQ(observed.allocations, 0) << scenario;
        EXPECT_EQ(observed.page_faults, 0) << scenario;
    }
}

TEST(PlantThread, NeitherAllocatesNorFaultsAtWallPaceAndAccountsForEveryTick) {
    const Observed observed = observe_in_child({.duration = 3, .pace = rt::Pace::wall});
    EXPECT_EQ(observed.executed + observed.skipped, 3000);
    EXPECT_EQ(observed.allocations, 0);
    EXPECT_EQ(observed.page_faults, 0);
}

// Where this bus is to be had only (ctest knows where).
class PlantThreadOnABus : public testing::TestWithParam<const char*> {};

TEST_P(PlantThreadOnABus, NeitherAllocatesNorFaultsWhileTheControllerCommandsIt) {
    const Observed observed = observe_in_child({.duration = 4, .pace = rt::Pace::wall, .bus = GetParam()});
    EXPECT_EQ(observed.executed + observed.skipped, 4000);
    EXPECT_GT(observed.commands_answered, 0);
    EXPECT_EQ(observed.allocations, 0);
    EXPECT_EQ(observed.page_faults, 0);
}

INSTANTIATE_TEST_SUITE_P(Udpcan, PlantThreadOnABus, testing::Values("udpcan:239.74.163.2:43113?ttl=0"));
INSTANTIATE_TEST_SUITE_P(Lcm, PlantThreadOnABus, testing::Values("lcm:udpm://239.255.76.67:7667?ttl=0"));
INSTANTIATE_TEST_SUITE_P(Vcan, PlantThreadOnABus, testing::Values("can:vcan0"));

}  // namespace
}  // namespace shiftrig::rig
