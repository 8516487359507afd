#include <cmath>
#include <cstdint>

#include "plant/connectors.h"
#include "plant/format.h"
#include "plant/model_data.h"

namespace shiftrig::plant {

std::string explain(const Model& model, const Event& event) {
    const detail::ModelData& m = model.data();
    const auto device = static_cast<std::size_t>(event.device < 0 ? 0 : event.device);
    const std::string name = event.device < 0 ? "model" : m.device_names[device];
    const char* unit = "Nm";
    const auto say = [](const char* pattern, auto... values) { return format(pattern, values...); };
    std::string line = say("t=%.7f ", event.time) + name + " ";
    std::string words;
    for_each_connector(m.description, [&](const auto& connector) {
        if (event.device >= 0 && connector.name == name) words = in_words(connector, event);
    });
    if (!words.empty()) return line + words;
    switch (event.kind) {
        case EventKind::lock:
            return line + say("locks: slip %.3g, torque %.1f of %.1f %s static", event.slip, event.torque,
                              event.capacity, unit);
        case EventKind::break_away:
            return line +
                   say("breaks away: torque %.1f beyond %.1f %s static", event.torque, event.capacity, unit);
        case EventKind::engage:
            return line + say("engages: slip %.3f rad/s, capacity %.1f %s", event.slip, event.capacity, unit);
        case EventKind::release:
            return line + say("is free: slip %.3f rad/s", event.slip);
        case EventKind::mesh_sticks:
            return line + say("sticks: rest needs %.1f %s of its loss, which allows %.1f",
                              std::fabs(event.torque), unit, event.capacity);
        case EventKind::mesh_releases:
            return line + say("moves again: rest would need %.1f %s of its loss, which allows %.1f",
                              std::fabs(event.torque), unit, event.capacity);
        case EventKind::drive_side:
            return line + (event.slip < 0 ? "is driven" : "drives") +
                   say(": torque on its first link %.1f %s", event.torque, unit);
        case EventKind::tie_up: {
            std::string loop;
            const auto members = static_cast<std::uint64_t>(event.slip);
            for (std::size_t k = 0; k < m.device_names.size() && k < 64; ++k) {
                if (members >> k & 1) loop += (loop.empty() ? "" : ", ") + m.device_names[k];
            }
            return line +
                   say("carries %.1f of %.1f %s in the closed loop of ", event.torque, event.capacity, unit) +
                   loop + ": how they share the torque is not unique";
        }
        case EventKind::fall_back:
            return line +
                   "has more state changes in this step than are located: the rest act from the next step on";
        default:
            break;  // told by the device itself
    }
    return line;
}

}  // namespace shiftrig::plant
