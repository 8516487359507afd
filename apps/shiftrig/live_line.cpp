#include "apps/shiftrig/live_line.h"

#include <unistd.h>

#include <cstdio>
#include <numbers>

namespace shiftrig::cli {

namespace {

int first_of(const rig::Rig& rig, const char* kind, const char* quantity) {
    for (int i = 0; i < rig.signals().size(); ++i) {
        const auto& name = rig.signals().signal(i).name;
        if (name.starts_with(kind) && name.ends_with(quantity)) return i;
    }
    return -1;
}

}  // namespace

LiveLine::LiveLine(const rig::Rig& rig) : shown_(isatty(STDERR_FILENO) != 0), own_(rig.own()) {
    const auto& machine = rig.model().description();
    gear_ = rig.signals().find("controller.current_gear");
    engine_ =
        machine.engines.empty() ? -1 : rig.signals().find("mass." + machine.engines.front().mass + ".speed");
    vehicle_ = -1;
    for (const auto& mass : machine.masses)
        if (mass.motion == plant::Motion::translating)
            vehicle_ = rig.signals().find("mass." + mass.name + ".speed");
    slip_ = first_of(rig, "tyre.", ".slip");
}

void LiveLine::take(const rig::Rig& rig) SHIFTRIG_REALTIME {
    if (!shown_ || ++taken_ % 20 != 0) return;
    const auto value = [&](int signal) { return signal < 0 ? 0 : rig.value(signal); };
    latest_.write({rig.sim_time(), value(gear_), value(engine_), value(vehicle_), value(slip_),
                   value(own_.tick_load), value(own_.safe_command)});
}

void LiveLine::show() {
    if (!shown_ || !latest_.has_news()) return;
    const Values v = latest_.read();
    std::fprintf(stderr, "\r\033[Kt %8.2f s", v.time);
    if (gear_ >= 0) std::fprintf(stderr, "   gear %2.0f", v.gear);
    if (engine_ >= 0) std::fprintf(stderr, "   %5.0f rpm", v.engine * 30 / std::numbers::pi);
    if (vehicle_ >= 0) std::fprintf(stderr, "   %6.2f km/h", v.vehicle * 3.6);
    if (slip_ >= 0) std::fprintf(stderr, "   slip %5.1f %%", v.slip * 100);
    std::fprintf(stderr, "   loop %4.1f %%%s", v.load * 100, v.safe > 0.5 ? "   SAFE COMMAND" : "");
    std::fflush(stderr);
}

void LiveLine::end() {
    if (!shown_) return;
    show();
    std::fputc('\n', stderr);
}

}  // namespace shiftrig::cli
