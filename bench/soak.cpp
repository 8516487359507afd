// shiftrig_soak: scenarios free-running one after the other, again and again, in one process, for as many
// simulated hours as asked for. Watches what must not grow: memory, the violation of rigid constraints, the
// defect of the energy ledger; and that every number stays finite and no frame is lost.
//
//     shiftrig_soak --hours 24 config/scenarios/*.yaml
#include <malloc.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

#include "apps/rig/choices.h"
#include "apps/rig/session.h"
#include "rt/clock.h"

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
};

long resident_pages() {
    long total = 0, resident = 0;
    std::ifstream("/proc/self/statm") >> total >> resident;
    return resident;
}

void run_once(const std::string& scenario, Watched& watched) {
    rig::Choices choices;
    choices.scenario = scenario;
    rig::Rig rig(rig::make_setup(choices));
    const auto signal = [&rig](const char* name) { return rig.signals().find(name); };
    const int input = signal("energy.input"), dissipated = signal("energy.dissipated"), defect = signal("energy.defect");
    double moved = 0;
    rig::SessionOptions options;
    options.loop.period = rig.setup().tick_ns;
    options.loop.slots = std::llround(rig.setup().scenario->duration * 1e9 / static_cast<double>(rig.setup().tick_ns));
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
    watched.lost += static_cast<std::int64_t>(rig.buses().messages_lost());
}

}  // namespace

int main(int argc, char** argv) {
    CLI::App app{"scenarios in a loop, free-running, watched", "shiftrig_soak"};
    double hours = 24;
    std::vector<std::string> scenarios;
    app.add_option("--hours", hours, "simulated")->check(CLI::PositiveNumber)->capture_default_str();
    app.add_option("SCENARIO", scenarios, "files")->required();
    CLI11_PARSE(app, argc, argv);
    // Memory that was ever needed stays with the process, so that "flat" can mean: to the page.
    mallopt(M_TRIM_THRESHOLD, -1);
    mallopt(M_MMAP_MAX, 0);

    Watched watched;
    const rt::SteadyClock clock;
    const std::int64_t began = clock.now();
    long pages_after_first = 0, pages_after_second = 0;
    int passes = 0;
    double simulated = 0;
    while (simulated < hours * 3600 || passes < 3) {
        for (const std::string& scenario : scenarios) {
            if (simulated >= hours * 3600 && passes >= 3) break;
            const std::int64_t before = watched.ticks;
            run_once(scenario, watched);
            simulated += static_cast<double>(watched.ticks - before) * 1e-3;
        }
        ++passes;
        if (passes == 1) pages_after_first = resident_pages();
        if (passes == 2) pages_after_second = resident_pages();
        if (isatty(2)) std::fprintf(stderr, "\r%.2f of %.2f h, %d passes, %ld pages ", simulated / 3600, hours, passes, resident_pages());
    }
    if (isatty(2)) std::fputc('\n', stderr);
    const long pages = resident_pages();
    const double wall = static_cast<double>(clock.now() - began) * 1e-9;
    std::printf("%.3f simulated hours in %d passes of %zu scenarios, %.1f s of wall time (%.0f times real time)\n",
                simulated / 3600, passes, scenarios.size(), wall, simulated / wall);
    std::printf("memory: %ld pages after the first pass, %ld after the second, %ld at the end\n", pages_after_first,
                pages_after_second, pages);
    std::printf("constraint violation: at most %.3g rad/s (bound %.0g)\n", watched.violation, violation_bound);
    std::printf("energy defect: at most %.3g of the energy moved (bound %.0g), in %s\n", watched.defect, defect_bound,
                watched.worst_defect_in.c_str());
    std::printf("%lld state changes, %lld fall-backs, %lld steps not finite, %lld frames lost\n",
                static_cast<long long>(watched.events), static_cast<long long>(watched.fall_backs),
                static_cast<long long>(watched.not_finite), static_cast<long long>(watched.lost));
    const char* complaint = pages > pages_after_second                 ? "memory grew"
                            : watched.violation >= violation_bound     ? "constraints are violated"
                            : watched.defect >= defect_bound           ? "energy defect out of bound"
                            : watched.not_finite > 0                   ? "not finite"
                            : watched.lost > 0                         ? "frames lost"
                                                                       : nullptr;
    if (complaint) std::printf("soak FAILED: %s\n", complaint);
    return complaint ? 1 : 0;
}
