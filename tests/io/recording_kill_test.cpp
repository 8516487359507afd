// kill -9 at random moments: every log opens, and nothing older than the stated bound is missing.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>

#include <atomic>
#include <random>
#include <thread>

#include "synthetic_recording.h"

namespace shiftrig::io {
namespace {

using namespace synthetic;
using Clock = std::chrono::steady_clock;

std::int64_t now_ns() {
    return Clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
}

// What the child has done, seen by the parent after its death.
struct Shared {
    std::atomic<std::int64_t> handed_over_ns[1 << 20];  // by tick
    std::atomic<std::int64_t> ticks;
    std::atomic<std::int64_t> worst_wake_up_ns;  // how late this machine let a thread of the child run
};

[[noreturn]] void record_forever(const std::string& path, Shared& shared) {
    std::thread([&] {
        while (true) {
            const std::int64_t before = now_ns();
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
            const std::int64_t late = now_ns() - before - 5'000'000;
            if (late > shared.worst_wake_up_ns) shared.worst_wake_up_ns = late;
        }
    }).detach();
    RecordingWriter writer(path);
    writer.begin(manifest());
    Tick t;
    for (std::int64_t n = 0;; ++n) {
        fill(t, n);
        t.record.wall_ns = now_ns();
        if (!writer.tick(t.record)) ::_exit(3);
        shared.handed_over_ns[n] = t.record.wall_ns;
        shared.ticks = n + 1;
        std::this_thread::sleep_for(std::chrono::microseconds(500));
    }
}

class KilledRecording : public testing::TestWithParam<const char*> {};

TEST_P(KilledRecording, IsReadableUpToTheStatedBound) {
    auto* shared = static_cast<Shared*>(
        ::mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0));
    ASSERT_NE(shared, MAP_FAILED);
    std::mt19937 random(2);
    std::int64_t worst_lost_ns = 0;
    for (int trial = 0; trial < 50; ++trial) {
        TemporaryFile file(GetParam());
        shared->ticks = 0;
        shared->worst_wake_up_ns = 0;
        const pid_t child = ::fork();
        if (child == 0) record_forever(file.path, *shared);
        while (shared->ticks == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        std::this_thread::sleep_for(std::chrono::microseconds(random() % 150'000));
        const std::int64_t killed_ns = now_ns();
        ::kill(child, SIGKILL);
        int status = 0;
        ::waitpid(child, &status, 0);
        ASSERT_TRUE(WIFSIGNALED(status)) << "the child ended by itself";

        RecordingReader reader(file.path);
        RecordedTick tick;
        std::int64_t kept = 0;
        Tick expected;
        while (reader.next(tick)) {
            fill(expected, kept++);
            ASSERT_TRUE(same_bits(tick.outputs, expected.outputs));
        }
        EXPECT_EQ(reader.ending(), Ending::cut_short) << reader.complaint();
        if (kept >= shared->ticks) continue;
        const std::int64_t lost_ns = killed_ns - shared->handed_over_ns[kept];
        worst_lost_ns = std::max(worst_lost_ns, lost_ns);
        // The bound holds as far as the machine let the log thread run at all.
        EXPECT_LE(lost_ns,
                  std::chrono::nanoseconds(RecordingWriter::flush_bound).count() + shared->worst_wake_up_ns)
            << "trial " << trial;
    }
    RecordProperty("worst_lost_us", static_cast<int>(worst_lost_ns / 1000));
    ::munmap(shared, sizeof(Shared));
}

INSTANTIATE_TEST_SUITE_P(PlainAndCompressed, KilledRecording, testing::Values(".lcmlog", ".lcmlog.zst"));

}  // namespace
}  // namespace shiftrig::io
