#include "plant/telling.h"

#include <algorithm>
#include <cmath>

#include "plant/devices.h"
#include "plant/modes.h"
#include "plant/wedged.h"

namespace shiftrig::plant::detail {
namespace {

// Power that turns round in a mesh, once the mesh is loaded: idle pinions turn to and fro around nothing.
void tell_turns(Work& w, const Sample& s) {
    const ModelData& m = w.model;
    double* const told = w.next + m.layout.drive_sides;
    const double* const torque = s.torque + m.pairs;
    const ContactTable& table = w.operators.table;
    const MeshFlow flow{torque, table.direction, table.drive, m.meshes};
    if (!m.kernel.loops.some_turned(flow, told, m.noteworthy_torque)) return;
    for (const int k : m.lossy_meshes) {
        const double x = table.direction[k];
        if (told[k] == x || x == 0 || std::fabs(torque[k]) < m.noteworthy_torque) continue;
        if (told[k] != 0) {
            log_event(w, {.time = w.start + w.h,
                          .kind = EventKind::drive_side,
                          .device = device_index(m.pairs + k),
                          .torque = torque[k],
                          .value = x});
        }
        told[k] = x;
    }
}

// The members of the loop that the pair is in.
void tell_loop(Work& w, const Mode& mode, int pair, const Sample& s) {
    const ModelData& m = w.model;
    int first = 0;
    while (mode.loop[first] != mode.loop[pair]) ++first;
    Event event{.time = w.start + w.h,
                .kind = EventKind::tie_up,
                .device = device_index(first),
                .torque = s.torque[first],
                .capacity = s.holding[first]};
    for (int k = first; k < m.pairs; ++k) {
        if (mode.loop[k] == mode.loop[pair])
            event.members |= std::uint64_t{1} << std::min(k - first, most_members);
    }
    if (w.outputs.event_count >= Outputs::event_capacity) return;  // in the next step, then
    log_event(w, event);
    double* const told = w.next + m.layout.loops;
    for (int k = first; k < m.pairs; ++k) {
        if (mode.loop[k] == mode.loop[pair]) told[k] = 1;
    }
}

// Loops that have become closed, or larger.
void tell_loops(Work& w, const Mode& mode, const Sample& s) {
    const ModelData& m = w.model;
    double& any = w.next[m.layout.tie_up];
    if (!mode.redundant && any == 0) return;
    double* const told = w.next + m.layout.loops;
    any = 0;
    for (int k = 0; k < m.pairs; ++k) {
        if (mode.loop[k] == 0) {
            told[k] = 0;
            continue;
        }
        if (told[k] == 0) tell_loop(w, mode, k, s);
        any = 1;
    }
}

// A pair that pushes at no slip, since others hold it there: what they carry of it hangs on what has been.
bool some_pushes(const Work& w, const Mode& mode, const Sample& s) {
    for (int k = 0; k < w.model.actuated_pairs; ++k) {
        if (is_wedged(w, mode, k) && s.sliding[k] > 0) return true;
    }
    return false;
}

bool is_told(const Work& w, int device) {
    const int count = std::min(w.outputs.event_count, Outputs::event_capacity);
    const auto& events = w.outputs.events;
    return std::any_of(events.begin(), events.begin() + count, [&](const Event& event) {
        return event.kind == EventKind::mesh_sticks && event.device == device;
    });
}

// What was told last of the device in this instant.
Event* last_told(Work& w, int device, double time) {
    const int count = std::min(w.outputs.event_count, Outputs::event_capacity);
    for (int i = count - 1; i >= 0; --i) {
        Event& event = w.outputs.events[static_cast<std::size_t>(i)];
        if (event.device == device && event.time == time) return &event;
    }
    return nullptr;
}

}  // namespace

bool log_event(Work& w, const Event& event) SHIFTRIG_REALTIME {
    constexpr int capacity = Outputs::event_capacity;
    auto& events = w.outputs.events;
    const int index = w.outputs.event_count++;
    if (index < capacity) {
        events[static_cast<std::size_t>(index)] = event;
        return true;
    }
    events.back() = {.time = event.time, .kind = EventKind::untold, .value = index + 2. - capacity};
    return false;
}

void log_release(Work& w, int device, double time, const LossAtRest& loss) SHIFTRIG_REALTIME {
    Event event{.time = time,
                .kind = EventKind::mesh_releases,
                .device = device_index(device),
                .torque = loss.needed,
                .capacity = loss.allowed};
    Event* const last = last_told(w, device, time);
    if (last && last->kind == EventKind::mesh_sticks) {
        event.value = 1;
        *last = event;
        return;
    }
    log_event(w, event);
}

void log_break_away(Work& w, int pair, double sense, const Sample& s) SHIFTRIG_REALTIME {
    const Event event{.time = s.at.time,
                      .kind = EventKind::break_away,
                      .device = device_index(pair),
                      .torque = s.torque[pair],
                      .capacity = static_limit(w, pair, s),
                      .value = sense};
    Event* const last = last_told(w, pair, event.time);
    if (last && last->kind == EventKind::lock && last->value == 1) {
        *last = {.time = event.time,
                 .kind = EventKind::engage,
                 .device = event.device,
                 .capacity = sliding_limit(w.model, pair, sense, s)};
        return;
    }
    log_event(w, event);
}

void tell_closings(Work& w, const Mode& mode, Sample& s) SHIFTRIG_REALTIME {
    const int count = std::min(w.outputs.event_count, Outputs::event_capacity);
    int known = -1;  // whose family's losses are there
    for (int& i = w.scratch.told_events; i < count; ++i) {
        Event& event = w.outputs.events[static_cast<std::size_t>(i)];
        if (event.kind == EventKind::lock) {
            event.torque = s.torque[event.device];
        } else if (event.kind == EventKind::mesh_sticks) {
            const int mesh = event.device - w.model.pairs, leader = leader_of(w, mode, mesh);
            LossAtRest* const losses = w.scratch.losses.data();
            if (leader >= 0 && leader != known) family_losses(w, mode, leader, s, losses);
            if (leader >= 0) known = leader;
            const LossAtRest loss = leader >= 0 ? losses[mesh] : loss_at_rest(w, mesh, s);
            event.torque = std::fabs(loss.needed);
            event.capacity = loss.allowed;
        }
    }
}

void tell_resting(Work& w, const Mode& mode, Sample& s) SHIFTRIG_REALTIME {
    for (const int k : w.model.lossy_meshes) {
        const int device = w.model.pairs + k;
        if (w.contact[device] != stuck || is_told(w, device)) continue;
        log_event(w, {.time = s.at.time, .kind = EventKind::mesh_sticks, .device = device_index(device)});
    }
    tell_closings(w, mode, s);
}

void tell_step(Work& w, const Mode& mode) SHIFTRIG_REALTIME {
    const Sample& s = w.scratch.begin();
    tell_turns(w, s);
    tell_loops(w, mode, s);
    if (mode.redundant || (mode.wedges && some_pushes(w, mode, s))) w.outputs.certificate.flags |= 1;
}

}  // namespace shiftrig::plant::detail
