#include "plant/telling.h"

#include <algorithm>
#include <cmath>

#include "plant/devices.h"
#include "plant/few.h"
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

Note& noted(Work& w, int device) {
    Note& note = w.scratch.notes[static_cast<std::size_t>(device)];
    if (!note.pressing && !note.closed && !note.opened) {
        w.scratch.noted[static_cast<std::size_t>(w.scratch.noted_count)] = device;
        ++w.scratch.noted_count;
    }
    return note;
}

// A pair that locked at this very time, and does not hold, only passed through: says what it was before.
unsigned char take_back_lock(Work& w, int pair, double time) {
    Outputs& out = w.outputs;
    if (out.event_count > Outputs::event_capacity) return locked;
    const auto end = out.events.begin() + out.event_count;
    const auto found = std::find_if(out.events.begin(), end, [&](const Event& event) {
        return event.kind == EventKind::lock && event.device == pair && event.time == time;
    });
    if (found == end) return locked;
    unsigned char was = free_running;
    if (found->value != 0) was = slipping(found->value);
    std::move(found + 1, end, found);
    --out.event_count;
    return was;
}

// From what a pair was when the instant began, `was`, to what it is now.
void tell_pair(Work& w, const Mode& mode, int k, unsigned char was, const Sample& s) {
    const unsigned char is = w.contact[k];
    if (was == is) return;
    if (was == locked) was = take_back_lock(w, k, s.at.time);
    if (was == is) return;
    const Note& note = w.scratch.notes[static_cast<std::size_t>(k)];
    const double sense = mode.bound[k] ? 0 : slip_sign(is);
    Event event{.time = s.at.time, .device = device_index(k)};
    if (is == locked) {
        event.kind = EventKind::lock;
        event.value = slip_sign(was);
        event.torque = s.torque[k];
        event.capacity = s.holding[k];
        event.slip = note.slip;
    } else if (is == free_running) {
        event.kind = EventKind::release;
        event.slip = device_slip(w, k, s.z);
    } else if (was == free_running) {
        event.kind = EventKind::engage;
        event.capacity = s.sliding[k];
        event.slip = device_slip(w, k, s.z);
        event.value = slip_sign(is);
    } else if (was == locked) {
        event.kind = EventKind::break_away;
        event.torque = note.torque;
        event.capacity = note.capacity;
        event.value = sense;
    } else {
        event.kind = EventKind::reverse;
        event.capacity = sliding_limit(w.model, k, slip_sign(is), s);
        event.torque = slip_sign(is) * event.capacity;
        event.value = sense;
    }
    log_event(w, event);
}

// Of meshes those are told that come to rest by their losses. Others hold them as well, or instead, in between.
void tell_mesh(Work& w, const Mode& mode, int k, unsigned char was, const LossAtRest& loss, Sample& s) {
    const int device = w.model.pairs + k;
    const unsigned char is = w.contact[device];
    const Note& note = w.scratch.notes[static_cast<std::size_t>(device)];
    double& rests = w.next[w.model.layout.resting + k];
    Event event{.time = s.at.time, .device = device_index(device)};
    if (is == stuck) {
        if (rests != 0) return;
        rests = 1;
        event.kind = EventKind::mesh_sticks;
        event.torque = std::fabs(loss.needed);
        event.capacity = loss.allowed;
    } else {
        if (mode.bound[device]) return;
        const bool passes = rests == 0 && note.closed && motion_sign(was) != motion_sign(is);
        if (rests == 0 && !passes) return;
        rests = 0;
        event.kind = EventKind::mesh_releases;
        const bool alone = note.opened && note.torque > note.capacity;
        if (alone) {
            event.torque = note.torque;
            event.capacity = note.capacity;
        }
        event.value = (passes ? 1 : 0) + (alone ? 0 : 2);
    }
    log_event(w, event);
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

void note_pressing(Work& w, int pair) SHIFTRIG_REALTIME {
    noted(w, pair).pressing = true;
}

void note_closing(Work& w, int device, double slip) SHIFTRIG_REALTIME {
    Note& note = noted(w, device);
    note.closed = true;
    note.slip = slip;
}

void note_opening(Work& w, int pair, const Sample& s) SHIFTRIG_REALTIME {
    Note& note = noted(w, pair);
    note.opened = true;
    note.torque = s.torque[pair];
    note.capacity = static_limit(w, pair, s);
}

void note_release(Work& w, int device, const LossAtRest& loss) SHIFTRIG_REALTIME {
    Note& note = noted(w, device);
    note.opened = true;
    note.torque = std::fabs(loss.needed);
    note.capacity = loss.allowed;
}

void forget_notes(ScratchData& scratch) SHIFTRIG_REALTIME {
    for (int i = 0; i < scratch.noted_count; ++i)
        scratch.notes[static_cast<std::size_t>(scratch.noted[static_cast<std::size_t>(i)])] = {};
    scratch.noted_count = 0;
}

void tell_instant(Work& w, const Mode& mode, Sample& s) SHIFTRIG_REALTIME {
    if (!w.next) return;  // only looks
    const ModelData& m = w.model;
    ScratchData& scratch = w.scratch;
    unsigned char* const told = scratch.told.data();
    const bool begins = !scratch.tells_on && read_integer(w.state) == 0;
    if (!scratch.tells_on) copy_states(scratch.before.data(), m.contact_bytes, told);
    scratch.tells_on = true;
    if (!begins && scratch.noted_count == 0 && same_states(told, w.contact, m.contact_bytes)) return;

    MotionLosses losses(w, mode);
    const auto tell = [&](int k) {
        if (k < m.pairs) {
            tell_pair(w, mode, k, told[k], s);
        } else if (mesh_of(w, k - m.pairs).lossy()) {
            const bool sticks = w.contact[k] == stuck && w.next[m.layout.resting + k - m.pairs] == 0;
            tell_mesh(w, mode, k - m.pairs, told[k], sticks ? losses.of(k - m.pairs, s) : LossAtRest{}, s);
        }
        told[k] = w.contact[k];
    };
    // Causes first.
    for (int i = 0; i < scratch.noted_count; ++i) tell(scratch.noted[static_cast<std::size_t>(i)]);
    for (int k = 0; k < m.first_flank; ++k) tell(k);
    forget_notes(scratch);
    copy_states(w.contact, m.contact_bytes, told);
}

void tell_step(Work& w, const Mode& mode) SHIFTRIG_REALTIME {
    const Sample& s = w.scratch.begin();
    tell_turns(w, s);
    tell_loops(w, mode, s);
    if (mode.redundant || (mode.wedges && some_pushes(w, mode, s)))
        w.outputs.certificate.flags |= Certificate::tie_up;
}

}  // namespace shiftrig::plant::detail
