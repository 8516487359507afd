#include <algorithm>
#include <cmath>
#include <cstdint>

#include "plant/connectors.h"
#include "plant/format.h"
#include "plant/model_data.h"

namespace shiftrig::plant {
namespace {

// A torque of an event: with one decimal from 1 Nm on, below with three digits.
std::string amount(const Event& event, double value) {
    const double size = std::max(std::fabs(event.torque), std::fabs(event.capacity));
    if (size >= 1 && std::fabs(value) < 0.05) value = 0;  // no −0.0
    if (size >= 1 || std::fabs(value) <= 1e-9 * size) return format("%.1f", value + 0.);
    return format("%.3g", value);
}

// Does the device act on a body that moves straight on? Then it has forces and m/s.
bool is_straight(const detail::ModelData& m, int device) {
    if (device < 0 || device >= m.pairs) return false;
    for (const Link& link : m.structure.pairs[static_cast<std::size_t>(device)].links) {
        if (link.mass < 0) continue;
        return std::find(m.translating.begin(), m.translating.end(), link.mass) != m.translating.end();
    }
    return false;
}

std::string loop_of(const detail::ModelData& m, const Event& event) {
    std::string names;
    for (int i = 0; i < most_members; ++i) {
        if (event.members >> i & 1)
            names += (names.empty() ? "" : ", ") +
                     m.device_names[static_cast<std::size_t>(event.device) + static_cast<std::size_t>(i)];
    }
    return names + (event.members >> most_members & 1 ? " and others" : "");
}

// What rest takes of the losses, and what they allow.
std::string rest(const Event& event) {
    return amount(event, std::fabs(event.torque)) + " Nm of its losses, which allow " +
           amount(event, event.capacity);
}

}  // namespace

bool tells(const Model& model, std::size_t device, EventKind kind) noexcept {
    const detail::ModelData& m = model.data();
    const int k = static_cast<int>(device);
    const FacingHeat* const heat = k < m.pairs ? m.pair_laws[device].heat : nullptr;
    switch (kind) {
        case EventKind::lock:
        case EventKind::break_away:
        case EventKind::engage:
        case EventKind::release:
        case EventKind::reverse:
        case EventKind::tie_up:
            return k < m.pairs;
        case EventKind::mesh_sticks:
        case EventKind::mesh_releases:
        case EventKind::drive_side:
            return k >= m.pairs && k < m.first_flank;
        case EventKind::flank_closes:
        case EventKind::flank_opens:
            return k >= m.first_flank && k < m.contact_bytes;
        case EventKind::engine_stalls:
        case EventKind::engine_starts:
            return k >= m.contact_bytes;
        case EventKind::fall_back:
            return k < m.contact_bytes;
        case EventKind::facing_warning:
            return heat != nullptr && heat->warn_temperature > 0;
        case EventKind::facing_failure:
            return heat != nullptr && heat->fail_temperature > 0;
        case EventKind::untold:
            return false;
    }
    return false;
}

bool has_margin(EventKind kind) noexcept {
    switch (kind) {
        case EventKind::lock:
        case EventKind::break_away:
        case EventKind::tie_up:
        case EventKind::mesh_sticks:
        case EventKind::mesh_releases:
            return true;
        default:
            return false;
    }
}

std::string explain(const Model& model, const Event& event) {
    const detail::ModelData& m = model.data();
    const auto device = static_cast<std::size_t>(event.device < 0 ? 0 : event.device);
    const std::string name = event.device < 0 ? "model" : m.device_names[device];
    const bool straight = is_straight(m, event.device);
    const std::string torque = straight ? "force " : "torque ", unit = straight ? " N" : " Nm",
                      speed = straight ? " m/s" : " rad/s";
    std::string line = format("t=%.7f ", event.time) + name + " ";
    std::string words;
    for_each_connector(m.description, [&](const auto& connector) {
        if (event.device >= 0 && connector.name == name) words = in_words(connector, event);
    });
    if (!words.empty()) return line + words;
    switch (event.kind) {
        case EventKind::lock:
            return line + format("locks: slip %.3g, ", event.slip) + torque + amount(event, event.torque) +
                   " of " + amount(event, event.capacity) + unit + " static";
        case EventKind::break_away: {
            // Located, it stands at its limit but for what locating leaves. With something left it goes because others do in
            // this instant, or because what it can hold falls.
            const double left = margin(event), little = 1e-4 * event.capacity;
            const char* const how = left > little    ? " of "
                                    : left < -little ? " beyond "
                                                     : " at its limit of ";
            return line + "breaks away: " + torque + amount(event, event.torque) + how +
                   amount(event, event.capacity) + unit + " static" + (left > little ? " just before" : "") +
                   (event.value == 0 ? ", and slides on where others hold it" : "");
        }
        case EventKind::reverse:
            return line + (event.value == 0 ? "pushes" : "slips") + " the other way: " + torque +
                   amount(event, event.torque) + " of " + amount(event, event.capacity) + unit + " sliding";
        case EventKind::engage:
            return line + format("engages: slip %.3f", event.slip) + speed + ", capacity " +
                   amount(event, event.capacity) + unit;
        case EventKind::release:
            return line + format("is free: slip %.3f", event.slip) + speed;
        case EventKind::mesh_sticks:
            return line + "sticks: rest needs " + rest(event);
        case EventKind::mesh_releases:
            if (event.value == 2) return line + "moves again, with others that held it";
            if (event.value == 3) return line + "passes through rest, carried along by others";
            return line + (event.value == 0 ? "moves again" : "passes through rest") + ": rest would need " +
                   rest(event);
        case EventKind::drive_side:
            return line + (event.value < 0 ? "is driven" : "drives") + ": torque on its first link " +
                   amount(event, event.torque) + " Nm";
        case EventKind::tie_up:
            return line + "carries " + amount(event, event.torque) + " of " + amount(event, event.capacity) +
                   unit + " in the closed loop of " + loop_of(m, event) +
                   ": how they share the torque is not unique";
        case EventKind::fall_back:
            return line +
                   "and what follows it change from here on, not where they should: more state changes in "
                   "this step than "
                   "are located";
        case EventKind::untold:
            return line + format("has %.0f more changes of state in this step than it can tell", event.value);
        default:
            break;  // told by the device itself
    }
    return line;
}

}  // namespace shiftrig::plant
