// What the loop asks of the machine: a FIFO priority, a processor, locked and prefaulted memory, a CPU
// that does not sleep deeply. Each may be refused; a refusal is a line that says what is missing and the
// command that would grant it. Nothing here is fatal: without any privilege the loop runs and says so.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace shiftrig::rt {

struct Refusal {
    std::string what;    // "FIFO priority 80 for the plant thread: Operation not permitted"
    std::string remedy;  // "sudo setcap cap_sys_nice,cap_ipc_lock+ep /usr/bin/shiftrig"
};
// `what; to grant it: remedy`
std::string to_string(const Refusal& refusal);
using Refusals = std::vector<Refusal>;

inline constexpr int most_processors = 1024;  // that an affinity can name: CPU_SETSIZE

struct ThreadSettings {
    std::string name = "plant";               // as seen in top and traces, at most 15 characters
    int fifo_priority = 0;                    // 1…99; 0 leaves the thread as it is
    std::vector<int> processors;              // to run on; empty: any
    std::size_t stack_to_touch = 256 * 1024;  // [bytes] prefaulted below the caller's frame
};
// Applies to the calling thread.
Refusals set_up_thread(const ThreadSettings& settings);

struct MemorySettings {
    bool lock = true;                              // mlockall, now and in future
    std::size_t heap_to_touch = 64 * 1024 * 1024;  // [bytes] faulted in and kept by the allocator
};
// For the whole process, before its threads are started.
Refusals set_up_memory(const MemorySettings& settings);

// While it lives the processors take no sleep state with a longer way back than the given latency
// (/dev/cpu_dma_latency, held open).
class AwakeProcessors {
  public:
    AwakeProcessors() = default;
    AwakeProcessors(const AwakeProcessors&) = delete;
    AwakeProcessors& operator=(const AwakeProcessors&) = delete;
    ~AwakeProcessors();
    Refusals hold(int microseconds = 0);

  private:
    int file_ = -1;
};

// Page faults of the calling thread so far (major and minor).
struct PageFaults {
    long major = 0, minor = 0;
};
PageFaults page_faults_of_this_thread() noexcept;

}  // namespace shiftrig::rt
