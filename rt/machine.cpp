#include "rt/machine.h"

#include <sys/resource.h>
#include <sys/utsname.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <set>
#include <sstream>

namespace shiftrig::rt {

namespace {

namespace fs = std::filesystem;

// The first line of a file, without surrounding blanks; nothing if it cannot be read.
std::optional<std::string> first_line(const fs::path& path) {
    std::ifstream file(path);
    std::string line;
    if (!file || !std::getline(file, line)) return std::nullopt;
    const auto first = line.find_first_not_of(" \t");
    if (first == std::string::npos) return std::string();
    return line.substr(first, line.find_last_not_of(" \t") - first + 1);
}

// "0-2,5" → {0, 1, 2, 5}
std::set<int> processor_list(const std::string& text) {
    std::set<int> result;
    std::istringstream parts(text);
    for (std::string part; std::getline(parts, part, ',');) {
        const auto dash = part.find('-');
        const int first = std::atoi(part.c_str());
        const int last = dash == std::string::npos ? first : std::atoi(part.c_str() + dash + 1);
        for (int i = first; !part.empty() && i <= last; ++i) result.insert(i);
    }
    return result;
}

std::string kernel_version(const fs::path& root) {
    utsname name{};
    uname(&name);
    const auto version = first_line(root / "proc/sys/kernel/version");
    const auto release = first_line(root / "proc/sys/kernel/osrelease");
    return release.value_or(name.release) + " " + version.value_or(name.version) + " " + name.machine;
}

Finding kernel(const fs::path& root) {
    Finding finding{"kernel", Verdict::warning, kernel_version(root), ""};
    const bool realtime = first_line(root / "sys/kernel/realtime") == "1" ||
                          finding.found.find("PREEMPT_RT") != std::string::npos;
    if (realtime) {
        finding.verdict = Verdict::good;
    } else {
        finding.advice =
            "a PREEMPT_RT kernel bounds the worst case (Debian: sudo apt install linux-image-rt-amd64)";
    }
    return finding;
}

Finding clock_source(const fs::path& root) {
    const fs::path folder = root / "sys/devices/system/clocksource/clocksource0";
    const auto present = first_line(folder / "current_clocksource");
    Finding finding{"clock source", Verdict::unknown, present.value_or("not told"), ""};
    if (!present) return finding;
    // Read from user space without entering the kernel: these three. hpet and acpi_pm cost a slow bus access.
    const bool fast = *present == "tsc" || *present == "kvm-clock" || *present == "arch_sys_counter";
    finding.verdict = fast ? Verdict::good : Verdict::warning;
    if (!fast) {
        finding.advice = "echo tsc | sudo tee /" +
                         (folder / "current_clocksource").lexically_relative(root).string() +
                         ", or boot with clocksource=tsc";
    }
    return finding;
}

Finding timer_resolution() {
    timespec resolution{};
    clock_getres(CLOCK_MONOTONIC, &resolution);
    const bool fine = resolution.tv_sec == 0 && resolution.tv_nsec == 1;
    return {"timer resolution", fine ? Verdict::good : Verdict::warning,
            std::to_string(resolution.tv_sec * 1'000'000'000 + resolution.tv_nsec) + " ns",
            fine ? "" : "a kernel with CONFIG_HIGH_RES_TIMERS, and no highres=off on its command line"};
}

Finding governor(const fs::path& root) {
    std::set<std::string> governors;
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(root / "sys/devices/system/cpu", error)) {
        if (const auto line = first_line(entry.path() / "cpufreq/scaling_governor")) governors.insert(*line);
    }
    if (governors.empty()) return {"frequency governor", Verdict::unknown, "not told", ""};
    std::string list;
    for (const std::string& name : governors) list += (list.empty() ? "" : " ") + name;
    const bool good = governors == std::set<std::string>{"performance"};
    return {"frequency governor", good ? Verdict::good : Verdict::warning, list,
            good ? "" : "sudo cpupower frequency-set -g performance"};
}

Finding sleep_states() {
    if (access("/dev/cpu_dma_latency", W_OK) == 0) {
        return {"sleep states", Verdict::good, "/dev/cpu_dma_latency can be held", ""};
    }
    if (access("/dev/cpu_dma_latency", F_OK) == 0) {
        return {"sleep states", Verdict::warning, "/dev/cpu_dma_latency is not writable",
                "sudo chmod o+w /dev/cpu_dma_latency"};
    }
    return {"sleep states", Verdict::unknown, "no /dev/cpu_dma_latency", ""};
}

Finding throttling(const fs::path& root) {
    const auto runtime = first_line(root / "proc/sys/kernel/sched_rt_runtime_us");
    const auto period = first_line(root / "proc/sys/kernel/sched_rt_period_us");
    if (!runtime || !period) return {"real-time throttling", Verdict::unknown, "not told", ""};
    if (*runtime == "-1" || std::atol(runtime->c_str()) >= std::atol(period->c_str())) {
        return {"real-time throttling", Verdict::good, "off", ""};
    }
    return {"real-time throttling", Verdict::warning, *runtime + " of " + *period + " µs",
            "a loop that computes for longer is held back; where a rig needs a whole processor: "
            "sudo sysctl kernel.sched_rt_runtime_us=-1"};
}

Finding limits() {
    rlimit priority{}, memory{};
    getrlimit(RLIMIT_RTPRIO, &priority);
    getrlimit(RLIMIT_MEMLOCK, &memory);
    std::ifstream status("/proc/self/status");
    unsigned long long capabilities = 0;
    for (std::string line; std::getline(status, line);) {
        if (line.rfind("CapEff:", 0) == 0) capabilities = std::strtoull(line.c_str() + 7, nullptr, 16);
    }
    constexpr int cap_ipc_lock = 14, cap_sys_nice = 23;
    const bool may_fifo = (capabilities >> cap_sys_nice & 1) || priority.rlim_max > 0;
    const bool may_lock = (capabilities >> cap_ipc_lock & 1) || memory.rlim_max == RLIM_INFINITY;
    std::string found = may_fifo ? "FIFO priority granted" : "no FIFO priority";
    found += may_lock ? ", locked memory granted"
                      : ", locked memory only " + std::to_string(memory.rlim_max / 1024) + " kB";
    return {"limits", may_fifo && may_lock ? Verdict::good : Verdict::warning, found,
            may_fifo && may_lock
                ? ""
                : "sudo setcap cap_sys_nice,cap_ipc_lock+ep on the program, or rtprio 95 and memlock "
                  "unlimited in /etc/security/limits.d"};
}

Finding isolated_processors(const fs::path& root) {
    const auto isolated = first_line(root / "sys/devices/system/cpu/isolated");
    const auto quiet = first_line(root / "sys/devices/system/cpu/nohz_full");
    if (isolated && !isolated->empty()) {
        return {
            "isolated processors", Verdict::good,
            *isolated + (quiet && !quiet->empty() && *quiet != "(null)" ? ", without tick: " + *quiet : ""),
            ""};
    }
    return {"isolated processors", Verdict::warning, "none",
            "boot with isolcpus=N nohz_full=N rcu_nocbs=N and run the plant thread on N (--cpu N)"};
}

Finding interrupts(const fs::path& root) {
    std::error_code error;
    const std::set<int> isolated =
        processor_list(first_line(root / "sys/devices/system/cpu/isolated").value_or(""));
    int lines = 0, intruding = 0;
    for (const auto& entry : fs::directory_iterator(root / "proc/irq", error)) {
        const auto list = first_line(entry.path() / "smp_affinity_list");
        if (!list) continue;
        ++lines;
        const std::set<int> on = processor_list(*list);
        intruding +=
            std::any_of(on.begin(), on.end(), [&](int processor) { return isolated.count(processor) > 0; });
    }
    if (lines == 0) return {"interrupts", Verdict::unknown, "not told", ""};
    if (isolated.empty()) {
        return {"interrupts", Verdict::warning,
                std::to_string(lines) + " lines, no processor kept free of them",
                "isolate a processor first, then keep interrupts off it (irqaffinity= on the kernel's "
                "command line)"};
    }
    const std::string found = std::to_string(intruding) + " of " + std::to_string(lines) +
                              " lines may interrupt an isolated processor";
    if (intruding == 0) return {"interrupts", Verdict::good, found, ""};
    return {"interrupts", Verdict::warning, found,
            "for f in /proc/irq/*/smp_affinity_list; do echo 0 | sudo tee $f; done   (and stop irqbalance)"};
}

Finding swap(const fs::path& root) {
    std::ifstream file(root / "proc/swaps");
    if (!file) return {"swap", Verdict::unknown, "not told", ""};
    int lines = -1;  // the heading
    for (std::string line; std::getline(file, line);) ++lines;
    if (lines <= 0) return {"swap", Verdict::good, "none", ""};
    return {"swap", Verdict::warning, std::to_string(lines) + " areas",
            "locked memory keeps the rig out of it; or sudo swapoff -a"};
}

Finding huge_pages(const fs::path& root) {
    const auto line = first_line(root / "sys/kernel/mm/transparent_hugepage/enabled");
    if (!line) return {"transparent huge pages", Verdict::unknown, "not told", ""};
    const auto open = line->find('['), close = line->find(']');
    const std::string chosen = open == std::string::npos || close == std::string::npos
                                   ? *line
                                   : line->substr(open + 1, close - open - 1);
    if (chosen != "always") return {"transparent huge pages", Verdict::good, chosen, ""};
    return {"transparent huge pages", Verdict::warning, chosen,
            "echo madvise | sudo tee /sys/kernel/mm/transparent_hugepage/enabled"};
}

Finding sibling_threads(const fs::path& root) {
    const auto active = first_line(root / "sys/devices/system/cpu/smt/active");
    if (!active) return {"sibling threads (SMT)", Verdict::unknown, "not told", ""};
    if (*active == "0") return {"sibling threads (SMT)", Verdict::good, "off", ""};
    return {"sibling threads (SMT)", Verdict::warning, "on",
            "leave the sibling of the plant's processor idle, or echo off | sudo tee "
            "/sys/devices/system/cpu/smt/control"};
}

bool under_hypervisor(const fs::path& root) {
    std::ifstream file(root / "proc/cpuinfo");
    for (std::string line; std::getline(file, line);) {
        if (line.rfind("flags", 0) == 0) return line.find(" hypervisor") != std::string::npos;
    }
    return false;
}

Finding host(const fs::path& root) {
    if (!under_hypervisor(root)) return {"host", Verdict::good, "no hypervisor seen", ""};
    return {"host", Verdict::warning, "a virtual machine: its host decides when it runs",
            "for latencies that count, run on the bare machine"};
}

}  // namespace

std::vector<Finding> examine_machine(const std::string& root) {
    const fs::path base = root.empty() ? "/" : root;
    return {kernel(base),
            host(base),
            clock_source(base),
            timer_resolution(),
            governor(base),
            sleep_states(),
            throttling(base),
            limits(),
            isolated_processors(base),
            interrupts(base),
            sibling_threads(base),
            huge_pages(base),
            swap(base)};
}

std::string describe_machine(const std::string& root) {
    const fs::path base = root.empty() ? "/" : root;
    std::ifstream file(base / "proc/cpuinfo");
    int processors = 0;
    std::string model;
    for (std::string line; std::getline(file, line);) {
        processors += line.rfind("processor", 0) == 0;
        if (line.rfind("model name", 0) == 0) model = line.substr(line.find(':') + 2);
    }
    return kernel_version(base) + ", " + std::to_string(processors) + " × " + model +
           (under_hypervisor(base) ? ", virtual machine" : "");
}

}  // namespace shiftrig::rt
