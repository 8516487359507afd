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

// A mesh begins to move. If it came to rest in this very instant it only passed through: that is told as one event.
void log_release(Work& work, int device, double time, const LossAtRest& loss) SHIFTRIG_REALTIME;

// A locked pair begins to slip in this sense. One that only began to be pressed in this very instant held nothing: that is told
// as its engaging.
void log_break_away(Work& work, int pair, double sense, const Sample& sample) SHIFTRIG_REALTIME;

// Closings since the last call are told with the torques that they lead to.
void tell_closings(Work& work, const Mode& mode, Sample& sample) SHIFTRIG_REALTIME;

// Meshes that are at rest when a run begins.
void tell_resting(Work& work, const Mode& mode, Sample& sample) SHIFTRIG_REALTIME;

// At the end of a step: power that turned round in a mesh, pairs that now share a torque in a closed loop.
void tell_step(Work& work, const Mode& mode) SHIFTRIG_REALTIME;

}  // namespace shiftrig::plant::detail
