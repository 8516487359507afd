// What the machine grants differs; that every request is either in force afterwards or refused with a
// line and a remedy does not. The unprivileged cases run in a child that gave up its privileges.
#include "rt/thread.h"

#include <gtest/gtest.h>
#include <pthread.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <functional>
#include <thread>

#include "rt/loop.h"

namespace shiftrig::rt {
namespace {

bool locked_memory_is_in_force() {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);) {
        if (line.rfind("VmLck:", 0) == 0) return std::strtol(line.c_str() + 6, nullptr, 10) > 0;
    }
    return false;
}

// Runs in a child process; its text comes back.
std::string in_child(const std::function<std::string()>& body, bool unprivileged) {
    int channel[2];
    EXPECT_EQ(pipe(channel), 0);
    const pid_t child = fork();
    if (child == 0) {
        if (unprivileged) {
            const rlimit none{0, 0};
            setrlimit(RLIMIT_RTPRIO, &none);
            const rlimit little{65536, 65536};
            setrlimit(RLIMIT_MEMLOCK, &little);
            if (getuid() == 0 && (setgid(65534) != 0 || setuid(65534) != 0)) _exit(1);
        }
        const std::string text = body();
        const bool written = write(channel[1], text.data(), text.size()) == static_cast<ssize_t>(text.size());
        _exit(written ? 0 : 1);
    }
    close(channel[1]);
    std::string text;
    char buffer[4096];
    for (ssize_t n; (n = read(channel[0], buffer, sizeof buffer)) > 0;)
        text.append(buffer, static_cast<std::size_t>(n));
    close(channel[0]);
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
    return text;
}

TEST(Thread, PriorityAndProcessorAreInForceOrRefusedWithARemedy) {
    std::thread([] {
        ThreadSettings settings;
        settings.fifo_priority = 42;
        settings.processors = {0};
        const Refusals refusals = set_up_thread(settings);
        int policy = 0;
        sched_param parameter{};
        pthread_getschedparam(pthread_self(), &policy, &parameter);
        cpu_set_t set;
        pthread_getaffinity_np(pthread_self(), sizeof set, &set);
        const bool fifo = policy == SCHED_FIFO && parameter.sched_priority == 42;
        const bool pinned = CPU_COUNT(&set) == 1 && CPU_ISSET(0, &set);
        EXPECT_EQ(refusals.size(), static_cast<std::size_t>(!fifo) + static_cast<std::size_t>(!pinned));
        for (const Refusal& refusal : refusals) EXPECT_FALSE(refusal.remedy.empty());
    }).join();
}

TEST(Thread, ProcessorThatDoesNotExistIsRefused) {
    std::thread([] {
        ThreadSettings settings;
        settings.processors = {1023};
        const Refusals refusals = set_up_thread(settings);
        ASSERT_EQ(refusals.size(), 1u);
        EXPECT_EQ(to_string(refusals[0]),
                  "processors 1023 for the plant thread: Invalid argument; to grant it: "
                  "choose from the processors that `taskset -cp $$` shows");
    }).join();
}

TEST(Thread, WithoutPrivilegesPriorityIsRefusedWithTheCommandThatGrantsIt) {
    const std::string text = in_child(
        [] {
            ThreadSettings settings;
            settings.fifo_priority = 80;
            std::string lines;
            for (const Refusal& refusal : set_up_thread(settings)) lines += to_string(refusal) + "\n";
            return lines;
        },
        true);
    EXPECT_EQ(text.substr(0, text.rfind(' ')),
              "FIFO priority 80 for the plant thread: Operation not permitted; to grant it: "
              "sudo setcap cap_sys_nice,cap_ipc_lock+ep");
}

TEST(Memory, IsLockedOrRefusedWithARemedy) {
    const std::string text = in_child(
        [] {
            MemorySettings settings;
            settings.heap_to_touch = 1 << 20;
            const Refusals refusals = set_up_memory(settings);
            return std::to_string(refusals.size()) + (locked_memory_is_in_force() ? " locked" : " unlocked");
        },
        false);
    EXPECT_TRUE(text == "0 locked" || text == "1 unlocked") << text;
}

TEST(Memory, WithoutPrivilegesLockingIsRefusedAndLaterThreadsStillStart) {
    const std::string text = in_child(
        [] {
            MemorySettings settings;
            settings.heap_to_touch = 1 << 20;
            std::string lines;
            for (const Refusal& refusal : set_up_memory(settings)) lines += to_string(refusal) + "\n";
            std::thread([&] { lines += "thread ran"; }).join();
            return lines;
        },
        true);
    EXPECT_EQ(
        text.rfind(
            "locked memory: only 64 kB may be locked; to grant it: sudo setcap cap_sys_nice,cap_ipc_lock+ep",
            0),
        0u)
        << text;
    EXPECT_NE(text.find("\nthread ran"), std::string::npos) << text;
}

TEST(AwakeProcessors, AreHeldOrRefusedWithARemedy) {
    AwakeProcessors awake;
    for (const Refusal& refusal : awake.hold()) {
        EXPECT_EQ(refusal.what.rfind("/dev/cpu_dma_latency: ", 0), 0u);
        EXPECT_FALSE(refusal.remedy.empty());
    }
}

// A stretch of work on the stack and the heap within the prefaulted sizes takes no page fault, although
// nothing was locked.
TEST(Memory, PrefaultedStackAndHeapTakeNoPageFaultLater) {
    const std::string text = in_child(
        [] {
            MemorySettings memory;
            memory.lock = false;
            memory.heap_to_touch = 8 << 20;
            set_up_memory(memory);
            set_up_thread({});
            const auto use = [](int depth, const auto& self) -> int {
                volatile char frame[4096];
                frame[0] = static_cast<char>(depth);
                frame[4095] = static_cast<char>(depth);
                return depth == 0 ? frame[0] : self(depth - 1, self) + frame[4095];
            };
            const PageFaults before = page_faults_of_this_thread();
            int sink = use(50, use);
            for (int i = 0; i < 1000; ++i) {
                auto* block = static_cast<volatile char*>(std::malloc(4 << 20));
                for (int k = 0; k < 4 << 20; k += 4096) block[k] = static_cast<char>(i);
                sink += block[i];
                std::free(const_cast<char*>(block));
            }
            const PageFaults after = page_faults_of_this_thread();
            return std::to_string(after.major - before.major + after.minor - before.minor) +
                   (sink == -1 ? "!" : "");
        },
        false);
    EXPECT_EQ(text, "0");
}

TEST(Loop, RunsExactlyWithoutAnyPrivilege) {
    const std::string text = in_child(
        [] {
            set_up_memory({});
            ThreadSettings thread;
            thread.fifo_priority = 80;
            set_up_thread(thread);
            LoopSettings settings;
            settings.slots = 50;
            auto loop = std::make_unique<Loop<>>(settings);
            loop->run([](const Tick&) {});
            return std::to_string(loop->report().executed + loop->report().skipped);
        },
        true);
    EXPECT_EQ(text, "50");
}

}  // namespace
}  // namespace shiftrig::rt
