// What this machine offers a real-time loop: one finding per thing that shapes latency, with what to
// change where it stands in the way. Reads /proc and /sys only; changes nothing.
#pragma once

#include <string>
#include <vector>

namespace shiftrig::rt {

enum class Verdict {
    good,
    warning,  // costs latency; `advice` says what to change
    unknown,  // the kernel does not tell (usual in virtual machines and containers)
};

struct Finding {
    std::string subject;  // "clock source"
    Verdict verdict = Verdict::unknown;
    std::string found;   // "tsc"
    std::string advice;  // a command or setting; empty where nothing is to be done
};

// `root` stands for "/" (tests bring their own files). What belongs to the process (limits, capabilities)
// is that of the caller.
std::vector<Finding> examine_machine(const std::string& root = "");

// `6.18.44 #1 SMP PREEMPT_DYNAMIC x86_64, 2 × AMD EPYC, hypervisor` for reports of measured figures.
std::string describe_machine(const std::string& root = "");

}  // namespace shiftrig::rt
