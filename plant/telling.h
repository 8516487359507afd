// Events: what is written down of a change of state, and those that belong to no single change. Internal to plant/.
#pragma once

#include "plant/forces.h"
#include "plant/stuck_meshes.h"

namespace shiftrig::plant::detail {

constexpr std::int16_t device_index(int device) noexcept {  // of an event
    return static_cast<std::int16_t>(device);
}

// False where the step holds no more events: it is only counted.
bool log_event(Work& work, const Event& event) SHIFTRIG_REALTIME;

// To be told of this instant, once it is settled, if it stands: a pair is pressed or released; a pair or mesh came to rest with this slip left; a locked pair gave
// way; a stuck mesh (a contact byte) moves, since its rest needs more than its losses allow.
void note_pressing(Work& work, int pair) SHIFTRIG_REALTIME;
void note_closing(Work& work, int device, double slip) SHIFTRIG_REALTIME;
void note_opening(Work& work, int pair, const Sample& sample) SHIFTRIG_REALTIME;
void note_release(Work& work, int device, const LossAtRest& loss) SHIFTRIG_REALTIME;

// What was noted is not told any more.
void forget_notes(ScratchData& scratch) SHIFTRIG_REALTIME;

// Tells what is otherwise now than it was before this instant, whatever was tried in between. Of the first instant of a run also the
// meshes that rest in it.
void tell_instant(Work& work, const Mode& mode, Sample& sample) SHIFTRIG_REALTIME;

// At the end of a step: power that turned round in a mesh, pairs that now share a torque in a closed loop.
void tell_step(Work& work, const Mode& mode) SHIFTRIG_REALTIME;

}  // namespace shiftrig::plant::detail
