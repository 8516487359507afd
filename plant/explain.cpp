#include <cmath>
#include <cstdint>
#include <cstdio>

#include "plant/model_data.h"

namespace shiftrig::plant {

namespace {

// A freewheel locks and lets go by the sense of its torque, not by pressure.
std::string explain_freewheel(const FreewheelLaw& law, const Event& event) {
    char text[160];
    const auto say = [&](const char* format, auto... values) {
        std::snprintf(text, sizeof text, format, values...);
        return std::string(text);
    };
    if (event.kind == EventKind::break_away && is_next_to_overrun(law, event.torque))
        return say("overruns: torque fell to %.1f Nm, it passes on none beyond a drag of %.1f", event.torque,
                   law.drag);
    if (event.kind == EventKind::break_away)
        return say("slips overloaded: torque %.1f beyond the rated %.1f Nm", event.torque, law.rated);
    if (event.kind == EventKind::lock)
        return say("locks: slip %.3g, torque %.1f of %.1f Nm rated", event.slip, event.torque, law.rated);
    return say(law.sense * event.slip < 0 ? "begins overrunning: slip %.3f rad/s"
                                          : "begins slipping: slip %.3f rad/s",
               event.slip);
}

}  // namespace

std::string explain(const Model& model, const Event& event) {
    const detail::ModelData& m = model.data();
    const auto device = static_cast<std::size_t>(event.device < 0 ? 0 : event.device);
    const std::string name = event.device < 0 ? "model" : m.device_names[device];
    const char* unit = "Nm";
    char text[256];
    const auto say = [&](const char* format, auto... values) {
        std::snprintf(text, sizeof text, format, values...);
        return std::string(text);
    };
    std::string line = say("t=%.7f ", event.time) + name + " ";
    const bool is_pair = event.device >= 0 && static_cast<int>(device) < m.pairs;
    const int freewheel = is_pair ? m.pair_laws[device].freewheel : -1;
    if (freewheel >= 0 && event.kind <= EventKind::engage)
        return line + explain_freewheel(m.freewheels[static_cast<std::size_t>(freewheel)], event);
    switch (event.kind) {
        case EventKind::lock:
            return line + say("locks: slip %.3g, torque %.1f of %.1f %s static", event.slip, event.torque, event.capacity, unit);
        case EventKind::break_away:
            return line + say("breaks away: torque %.1f beyond %.1f %s static", event.torque, event.capacity, unit);
        case EventKind::engage:
            return line + say("engages: slip %.3f rad/s, capacity %.1f %s", event.slip, event.capacity, unit);
        case EventKind::release: return line + say("is free: slip %.3f rad/s", event.slip);
        case EventKind::mesh_sticks:
            return line + say("sticks: rest needs %.1f %s of its loss, which allows %.1f", std::fabs(event.torque), unit, event.capacity);
        case EventKind::mesh_releases:
            return line + say("moves again: rest would need %.1f %s of its loss, which allows %.1f", std::fabs(event.torque), unit, event.capacity);
        case EventKind::drive_side:
            return line + (event.slip < 0 ? "is driven" : "drives") + say(": torque on its first link %.1f %s", event.torque, unit);
        case EventKind::tie_up: {
            std::string loop;
            const auto members = static_cast<std::uint64_t>(event.slip);
            for (std::size_t k = 0; k < m.device_names.size() && k < 64; ++k) {
                if (members >> k & 1) loop += (loop.empty() ? "" : ", ") + m.device_names[k];
            }
            return line + say("carries %.1f of %.1f %s in the closed loop of ", event.torque, event.capacity, unit) + loop +
                   ": how they share the torque is not unique";
        }
        case EventKind::fall_back: return line + "has more state changes in this step than are located: the rest act from the next step on";
        case EventKind::engine_stalls: return line + say("stalls at %.1f rad/s", event.slip);
        case EventKind::engine_starts: return line + say("runs at %.1f rad/s", event.slip);
        case EventKind::facing_warning: return line + say("facing passes its warning temperature: %.0f degC", event.slip);
        case EventKind::facing_failure: return line + say("facing passes its failure temperature: %.0f degC", event.slip);
        case EventKind::flank_closes:
            return line + say("closes its %s flank at %.3f rad/s",
                              event.capacity > 0 ? "forward" : "backward", event.slip);
        case EventKind::flank_opens:
            return line + say("opens its %s flank at %.3f rad/s", event.capacity > 0 ? "forward" : "backward",
                              event.slip);
    }
    return line;
}

}  // namespace shiftrig::plant
