#include "rt/thread.h"

#include <alloca.h>
#include <fcntl.h>
#include <malloc.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>

namespace shiftrig::rt {

namespace {

std::string this_program() {
    char path[4096];
    const ssize_t length = readlink("/proc/self/exe", path, sizeof path);
    return length > 0 ? std::string(path, static_cast<std::size_t>(length)) : "shiftrig";
}

std::string grant_capabilities() {
    return "sudo setcap cap_sys_nice,cap_ipc_lock+ep " + this_program();
}

bool has_capability(int bit) {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);) {
        if (line.rfind("CapEff:", 0) == 0) return (std::strtoull(line.c_str() + 7, nullptr, 16) >> bit) & 1;
    }
    return false;
}

// Never inlined, so that the pages it touches lie below every frame the loop will use.
[[gnu::noinline]] void touch_stack(std::size_t bytes) {
    auto* block = static_cast<volatile char*>(alloca(bytes));
    for (std::size_t i = 0; i < bytes; i += 1024) block[i] = 0;
}

void touch_heap(std::size_t bytes) {
    // Keep what was touched: never give memory back to the kernel, never map single large blocks.
    mallopt(M_TRIM_THRESHOLD, -1);
    mallopt(M_TOP_PAD, 16 * 1024 * 1024);
    mallopt(M_MMAP_MAX, 0);
    if (auto* block = static_cast<volatile char*>(std::malloc(bytes))) {
        for (std::size_t i = 0; i < bytes; i += 1024) block[i] = 0;
        std::free(const_cast<char*>(block));
    }
}

}  // namespace

std::string to_string(const Refusal& refusal) {
    return refusal.what + "; to grant it: " + refusal.remedy;
}

Refusals set_up_thread(const ThreadSettings& settings) {
    Refusals refusals;
    pthread_setname_np(pthread_self(), settings.name.substr(0, 15).c_str());
    if (!settings.processors.empty()) {
        cpu_set_t set;
        CPU_ZERO(&set);
        std::string list;
        for (const int processor : settings.processors) {
            static_assert(most_processors == CPU_SETSIZE);
            if (processor >= 0 && processor < CPU_SETSIZE) CPU_SET(processor, &set);
            if (!list.empty()) list += ',';
            list += std::to_string(processor);
        }
        if (const int error = pthread_setaffinity_np(pthread_self(), sizeof set, &set)) {
            refusals.push_back(
                {"processors " + list + " for the " + settings.name + " thread: " + std::strerror(error),
                 "choose from the processors that `taskset -cp $$` shows"});
        }
    }
    if (settings.fifo_priority > 0) {
        sched_param parameter{};
        parameter.sched_priority = settings.fifo_priority;
        if (const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameter)) {
            refusals.push_back({"FIFO priority " + std::to_string(settings.fifo_priority) + " for the " +
                                    settings.name + " thread: " + std::strerror(error),
                                error == EINVAL ? "a priority from 1 to 99" : grant_capabilities()});
        }
    }
    touch_stack(settings.stack_to_touch);
    return refusals;
}

Refusals set_up_memory(const MemorySettings& settings) {
    Refusals refusals;
    touch_heap(settings.heap_to_touch);
    if (!settings.lock) return refusals;
    rlimit limit{};
    getrlimit(RLIMIT_MEMLOCK, &limit);
    // With a limit, locking what is mapped may succeed and every later mapping fail: all or nothing.
    constexpr int cap_ipc_lock = 14;
    if (limit.rlim_cur != RLIM_INFINITY && limit.rlim_max == RLIM_INFINITY) {
        limit.rlim_cur = RLIM_INFINITY;
        setrlimit(RLIMIT_MEMLOCK, &limit);
    }
    if (!has_capability(cap_ipc_lock) && limit.rlim_cur != RLIM_INFINITY) {
        refusals.push_back(
            {"locked memory: only " + std::to_string(limit.rlim_cur / 1024) + " kB may be locked",
             grant_capabilities() + "  (or `ulimit -l unlimited` in a privileged shell)"});
    } else if (mlockall(MCL_CURRENT | MCL_FUTURE) != 0) {
        refusals.push_back(
            {std::string("locked memory: mlockall: ") + std::strerror(errno), grant_capabilities()});
    }
    return refusals;
}

AwakeProcessors::~AwakeProcessors() {
    if (file_ >= 0) close(file_);
}

Refusals AwakeProcessors::hold(int microseconds) {
    file_ = open("/dev/cpu_dma_latency", O_WRONLY | O_CLOEXEC);
    const auto value = static_cast<std::int32_t>(microseconds);
    if (file_ >= 0 && write(file_, &value, sizeof value) == sizeof value) return {};
    return {{std::string("/dev/cpu_dma_latency: ") + std::strerror(errno),
             errno == ENOENT ? "a kernel with CONFIG_CPU_IDLE" : "sudo chmod o+w /dev/cpu_dma_latency"}};
}

PageFaults page_faults_of_this_thread() noexcept {
    rusage usage{};
    getrusage(RUSAGE_THREAD, &usage);
    return {usage.ru_majflt, usage.ru_minflt};
}

}  // namespace shiftrig::rt
