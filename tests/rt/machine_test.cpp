// examine_machine against two made-up machines: one as it should be, one where everything stands in the way.
#include "rt/machine.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <fstream>
#include <map>

namespace shiftrig::rt {
namespace {

namespace fs = std::filesystem;

class MachineFiles : public ::testing::Test {
  protected:
    void SetUp() override {
        char name[] = "/tmp/machine_test_XXXXXX";
        root = mkdtemp(name);
    }
    void TearDown() override { fs::remove_all(root); }
    void file(const std::string& path, const std::string& text) {
        fs::create_directories((root / path).parent_path());
        std::ofstream(root / path) << text;
    }
    std::map<std::string, Finding> examine() {
        std::map<std::string, Finding> result;
        for (const Finding& finding : examine_machine(root)) result[finding.subject] = finding;
        return result;
    }
    fs::path root;
};

TEST_F(MachineFiles, PreparedMachineGetsNoAdvice) {
    file("proc/sys/kernel/osrelease", "6.1.0-rt\n");
    file("proc/sys/kernel/version", "#1 SMP PREEMPT_RT Debian\n");
    file("proc/cpuinfo", "processor\t: 0\nmodel name\t: Some CPU\nflags\t\t: fpu sse2\nprocessor\t: 1\n");
    file("sys/devices/system/clocksource/clocksource0/current_clocksource", "tsc\n");
    file("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "performance\n");
    file("proc/sys/kernel/sched_rt_runtime_us", "-1\n");
    file("proc/sys/kernel/sched_rt_period_us", "1000000\n");
    file("sys/devices/system/cpu/isolated", "1,3-4\n");
    file("sys/devices/system/cpu/nohz_full", "1\n");
    file("proc/irq/24/smp_affinity_list", "0,2\n");
    file("sys/devices/system/cpu/smt/active", "0\n");
    file("sys/kernel/mm/transparent_hugepage/enabled", "always [madvise] never\n");
    file("proc/swaps", "Filename\tType\n");
    auto findings = examine();
    for (const char* subject :
         {"kernel", "host", "clock source", "frequency governor", "real-time throttling",
          "isolated processors", "interrupts", "sibling threads (SMT)", "transparent huge pages", "swap"}) {
        EXPECT_EQ(findings[subject].verdict, Verdict::good) << subject << ": " << findings[subject].found;
        EXPECT_EQ(findings[subject].advice, "") << subject;
    }
    EXPECT_EQ(findings["isolated processors"].found, "1,3-4, without tick: 1");
    EXPECT_NE(describe_machine(root).find("PREEMPT_RT Debian"), std::string::npos);
    EXPECT_NE(describe_machine(root).find("2 × Some CPU"), std::string::npos);
}

TEST_F(MachineFiles, EveryObstacleIsNamedWithWhatToChange) {
    file("proc/sys/kernel/osrelease", "6.1.0\n");
    file("proc/sys/kernel/version", "#1 SMP PREEMPT_DYNAMIC Debian\n");
    file("proc/cpuinfo", "flags\t\t: fpu hypervisor sse2\n");
    file("sys/devices/system/clocksource/clocksource0/current_clocksource", "hpet\n");
    file("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "performance\n");
    file("sys/devices/system/cpu/cpu1/cpufreq/scaling_governor", "powersave\n");
    file("proc/sys/kernel/sched_rt_runtime_us", "950000\n");
    file("proc/sys/kernel/sched_rt_period_us", "1000000\n");
    file("sys/devices/system/cpu/isolated", "2-3\n");
    file("proc/irq/24/smp_affinity_list", "0-3\n");
    file("proc/irq/25/smp_affinity_list", "0\n");
    file("sys/devices/system/cpu/smt/active", "1\n");
    file("sys/kernel/mm/transparent_hugepage/enabled", "[always] madvise never\n");
    file("proc/swaps", "Filename\tType\n/dev/sda2 partition\n");
    auto findings = examine();
    for (const char* subject :
         {"kernel", "host", "clock source", "frequency governor", "real-time throttling", "interrupts",
          "sibling threads (SMT)", "transparent huge pages", "swap"}) {
        EXPECT_EQ(findings[subject].verdict, Verdict::warning) << subject;
        EXPECT_NE(findings[subject].advice, "") << subject;
    }
    EXPECT_EQ(findings["frequency governor"].found, "performance powersave");
    EXPECT_EQ(findings["real-time throttling"].found, "950000 of 1000000 µs");
    EXPECT_EQ(findings["interrupts"].found, "1 of 2 lines may interrupt an isolated processor");
    EXPECT_EQ(
        findings["clock source"].advice,
        "echo tsc | sudo tee /sys/devices/system/clocksource/clocksource0/current_clocksource, or boot with "
        "clocksource=tsc");
}

TEST_F(MachineFiles, WhatTheKernelDoesNotTellIsUnknownNotGood) {
    auto findings = examine();
    for (const char* subject : {"clock source", "frequency governor", "real-time throttling", "interrupts",
                                "sibling threads (SMT)", "transparent huge pages", "swap"}) {
        EXPECT_EQ(findings[subject].verdict, Verdict::unknown) << subject;
    }
    EXPECT_EQ(findings["isolated processors"].verdict, Verdict::warning);
}

}  // namespace
}  // namespace shiftrig::rt
