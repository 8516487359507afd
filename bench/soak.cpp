// shiftrig_soak: scenarios free-running one after the other, again and again, in one process, for as many
// simulated hours as asked for. Watches what must not grow: memory, the violation of rigid constraints, the
// defect of the energy ledger; and that every number stays finite and no frame is lost.
//
// Memory is watched twice, after every pass, when no rig is alive. Blocks and bytes that malloc has handed out and not
// got back: a leak shows to the block. And the pages of the process: as `shiftrig run` does, the heap is faulted in
// before the first rig, so that a page that comes later means that the heap had to grow. (Without that, pages come one
// by one for many passes although nothing grows: a rig sets aside more than it uses, for modes and events it may
// meet, and which of those reserved pages are written depends on where malloc happens to lay them.)
//
//     shiftrig_soak --hours 24 config/scenarios/*.yaml
#include <malloc.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <iostream>
#include <string>
#include <utility>
#include <vector>

#include "apps/rig/choices.h"
#include "apps/rig/session.h"
#include "apps/shiftrig/arguments.h"
#include "rt/clock.h"
#include "rt/thread.h"

namespace {
std::atomic<long> live_blocks{0}, live_bytes{0};  // handed out by malloc and not yet freed

void* taken(void* block) {
    if (block != nullptr) {
        live_blocks.fetch_add(1, std::memory_order_relaxed);
        live_bytes.fetch_add(static_cast<long>(malloc_usable_size(block)), std::memory_order_relaxed);
    }
    return block;
}
void* given_back(void* block) {
    if (block != nullptr) {
        live_blocks.fetch_sub(1, std::memory_order_relaxed);
        live_bytes.fetch_sub(static_cast<long>(malloc_usable_size(block)), std::memory_order_relaxed);
    }
    return block;
}
}  // namespace

// The C library's own entry points, under which ours stand: whatever the program and its libraries take is counted.
extern "C" {
void* __libc_malloc(size_t size);
void* __libc_calloc(size_t count, size_t size);
void* __libc_realloc(void* block, size_t size);
void* __libc_memalign(size_t alignment, size_t size);
void __libc_free(void* block);

void* malloc(size_t size) noexcept {
    return taken(__libc_malloc(size));
}
void* calloc(size_t count, size_t size) noexcept {
    return taken(__libc_calloc(count, size));
}
void* realloc(void* block, size_t size) noexcept {
    given_back(block);
    void* moved = __libc_realloc(block, size);
    taken(moved == nullptr && size > 0 ? block : moved);  // refused: the old one stays
    return moved;
}
void* aligned_alloc(size_t alignment, size_t size) noexcept {
    return taken(__libc_memalign(alignment, size));
}
int posix_memalign(void** block, size_t alignment, size_t size) noexcept {
    *block = taken(__libc_memalign(alignment, size));
    return *block == nullptr ? ENOMEM : 0;
}
void free(void* block) noexcept {
    __libc_free(given_back(block));
}
}

namespace {

using namespace shiftrig;

constexpr double violation_bound = 1e-9;  // [rad/s]
// Of the energy moved (input + dissipated) in a scenario. The ledger closes at the order of the method; the
// bound is about a hundred times what 1 ms steps leave in the worst of the shipped scenarios.
constexpr double defect_bound = 1e-6;

struct Watched {
    double violation = 0, defect = 0;  // worst [rad/s], [1]
    std::int64_t ticks = 0, events = 0, not_finite = 0, lost = 0, fall_backs = 0;
    std::string worst_defect_in;
    long extent = 0;  // [bytes] of the heap up to its unused end, with a rig in it; largest of the pass
};

struct Memory {
    long pages = 0;              // resident
    long blocks = 0, bytes = 0;  // live in the heap
    bool operator==(const Memory&) const = default;
};

Memory memory() {
    Memory now;
    now.blocks = live_blocks, now.bytes = live_bytes;
    long total = 0;
    std::ifstream("/proc/self/statm") >> total >> now.pages;
    return now;
}

void run_once(const std::string& scenario, Watched& watched) {
    rig::Choices choices;
    choices.scenario = scenario;
    rig::Rig rig(rig::make_setup(choices));
    const auto signal = [&rig](const char* name) { return rig.signals().find(name); };
    const int input = signal("energy.input"), dissipated = signal("energy.dissipated"),
              defect = signal("energy.defect");
    double moved = 0;
    rig::SessionOptions options;
    options.loop.period = rig.setup().tick_ns;
    options.loop.slots =
        std::llround(rig.setup().scenario->duration * 1e9 / static_cast<double>(rig.setup().tick_ns));
    options.loop.pace = rt::Pace::free;
    options.after = [&](rig::Rig& each, const rt::Tick&) {
        const plant::Certificate& certificate = each.certificate();
        watched.violation = std::max(watched.violation, certificate.constraint_violation);
        watched.events += certificate.events;
        watched.fall_backs += certificate.fall_backs;
        const auto finite = [](double x) { return std::isfinite(x); };
        const auto outputs = each.output_values();
        watched.not_finite += !std::all_of(outputs.begin(), outputs.end(), finite);
    };
    rig::Session session(rig, std::move(options));
    watched.ticks += session.run().executed;
    moved = std::abs(rig.value(input)) + std::abs(rig.value(dissipated));
    const double relative = std::abs(rig.value(defect)) / std::max(moved, 1.0);
    if (relative > watched.defect) {
        watched.defect = relative;
        watched.worst_defect_in = scenario;
    }
    const auto heap = mallinfo2();
    watched.extent = std::max(watched.extent, static_cast<long>(heap.arena - heap.keepcost));
    watched.lost += static_cast<std::int64_t>(rig.buses().messages_lost());
}

}  // namespace

int main(int argc, char** argv) {
    CLI::App app{"scenarios in a loop, free-running, watched", "shiftrig_soak"};
    double hours = 24;
    std::vector<std::string> scenarios;
    cli::add_number(app, "--hours", hours, {0, 1e5, true}, "simulated")->capture_default_str();
    app.add_option("SCENARIO", scenarios, "files")->required();
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : 2;
    }
    // Memory that was ever needed stays with the process, and what will be needed is there: "flat" can mean to the page.
    rt::set_up_memory({.lock = false});

    Watched watched;
    const rt::SteadyClock clock;
    const std::int64_t began = clock.now();
    Memory first, last;  // after passes
    long first_extent = 0, largest_extent = 0;
    int passes = 0, changes = 0;
    double simulated = 0;
    while (simulated < hours * 3600 || passes < 3) {
        for (const std::string& scenario : scenarios) {
            if (simulated >= hours * 3600 && passes >= 3) break;
            const std::int64_t before = watched.ticks;
            run_once(scenario, watched);
            simulated += static_cast<double>(watched.ticks - before) * 1e-3;
        }
        ++passes;
        const Memory now = memory();
        if (passes == 1) first = last = now, first_extent = watched.extent;
        largest_extent = std::max(largest_extent, std::exchange(watched.extent, 0));
        if (now != last) {
            ++changes;
            std::printf("memory after pass %d: %ld pages, %ld blocks of %ld bytes live\n", passes, now.pages,
                        now.blocks, now.bytes);
        }
        last = now;
        if (isatty(2))
            std::fprintf(stderr, "\r%.2f of %.2f h, %d passes, %ld pages ", simulated / 3600, hours, passes,
                         now.pages);
    }
    if (isatty(2)) std::fputc('\n', stderr);
    const double wall = static_cast<double>(clock.now() - began) * 1e-9;
    std::printf(
        "%.3f simulated hours in %d passes of %zu scenarios, %.1f s of wall time (%.0f times real time), "
        "%.1f s of processor time\n",
        simulated / 3600, passes, scenarios.size(), wall, simulated / wall,
        static_cast<double>(std::clock()) / CLOCKS_PER_SEC);
    std::printf(
        "memory after the first pass: %ld pages, %ld blocks of %ld bytes live; at the end: %ld pages, %ld "
        "blocks of %ld bytes; changed after %d passes\n",
        first.pages, first.blocks, first.bytes, last.pages, last.blocks, last.bytes, changes);
    std::printf("heap in use up to byte %ld in the first pass, %ld in any\n", first_extent, largest_extent);
    std::printf("constraint violation: at most %.3g rad/s (bound %.0g)\n", watched.violation,
                violation_bound);
    std::printf("energy defect: at most %.3g of the energy moved (bound %.0g), in %s\n", watched.defect,
                defect_bound, watched.worst_defect_in.c_str());
    std::printf("%lld state changes, %lld fall-backs, %lld steps not finite, %lld frames lost\n",
                static_cast<long long>(watched.events), static_cast<long long>(watched.fall_backs),
                static_cast<long long>(watched.not_finite), static_cast<long long>(watched.lost));
    const char* complaint = changes > 0                            ? "memory is not flat"
                            : watched.violation >= violation_bound ? "constraints are violated"
                            : watched.defect >= defect_bound       ? "energy defect out of bound"
                            : watched.not_finite > 0               ? "not finite"
                            : watched.lost > 0                     ? "frames lost"
                                                                   : nullptr;
    if (complaint) std::printf("soak FAILED: %s\n", complaint);
    return complaint ? 1 : 0;
}
