// Changes of contact state: which device changes when, and what else follows from it. Internal to plant/.
#pragma once

#include "plant/forces.h"

namespace shiftrig::plant::detail {

// Brings contact states and loss directions into agreement with the sample's instant: engages and releases
// pairs by their capacity, chooses every mesh's x by the lossy torques, opens what is overloaded ([Algin]
// eq. (12)), lets stuck meshes go. Pairs that begin to press at rest close, and where others can take a load, so may what is at
// rest: it is the bound on passes that says that this ends (beyond it bit 1 of the certificate is set). Leaves forces and
// internal torques of the settled mode in the sample. `complete`: forces and torques are there already.
Mode& settle(Work& work, Sample& sample, bool complete = false) SHIFTRIG_REALTIME;

enum class Change {
    state,    // a pair opens or closes, a mesh comes to rest
    turn,     // the power through a mesh turns round
    release,  // a stuck mesh goes
    overrun,  // a pair lets go in its weak sense
    limit,    // a stuck mesh stays, but has to leave to others what is too much for its loss
    flank,    // a flank closes or opens
    hold,     // a pair that others keep from slipping can hold its share
};

// Once the crossing lies behind, settle() does the rest.
constexpr bool acts_by_itself(Change change) noexcept {
    return change == Change::turn || change == Change::release || change == Change::limit;
}

// Of the others nothing is lost where they are not located: correct_directions() and settle() see to them.
constexpr bool is_event(Change change) noexcept {
    return change != Change::turn && change != Change::limit;
}

struct Crossing {
    int device = -1;   // contact byte: pair, mesh or flank; −1: nobody changes
    double theta = 1;  // where between begin and end, 0…1
    Change change = Change::state;
};

// The first device whose state does not hold until the end of the part just computed: a slip speed that
// changes sign ([Algin] eq. (13)), a torque above the static capacity (eq. (12)). Where shafts are so stiff that
// they swing within the step, reversals of power are looked for as well; elsewhere correct_directions() does.
// Where no instant will be located (`locates` is false), an event stands before all that is none: it must not be hidden.
Crossing first_crossing(Work& work, const Mode& mode, Sample& begin, Sample& end,
                        bool locates = true) SHIFTRIG_REALTIME;

// The same among flanks alone.
Crossing first_flank(const Work& work, const Sample& begin, const Sample& end) SHIFTRIG_REALTIME;

// Has a flank closed or opened half way that at the end is as it was, or may one have done so between? The part is too long
// for it.
bool hides_contact(const Work& work) SHIFTRIG_REALTIME;

// Where between begin and end the margin of a device that holds at both is so small that it may have been negative:
// a slip that comes to zero and goes back, a torque that is too much for an instant. 1: nowhere.
double first_dip(Work& work, const Mode& mode) SHIFTRIG_REALTIME;

// Does the state of this device fail to hold at the end sample? Bound slips are zero by others' doing.
bool violated(const Work& work, const Mode& mode, int device, const Sample& end) SHIFTRIG_REALTIME;

// How far from its change the device is at the sample: slip in the direction of its motion, capacity left, torque
// beyond the point where both losses of a mesh agree, what a stuck mesh lacks to go. Negative: behind it.
double crossing_margin(Work& work, const Mode& mode, const Crossing& crossing,
                       Sample& sample) SHIFTRIG_REALTIME;

// A pair that can hold nothing yet, and carries nothing yet, gives way in the sense of its torque at the end of the part.
void look_onward(Work& work, int device) SHIFTRIG_REALTIME;

// Changes the state of one device at the sample, and with it of all that its closing brings to rest. False: a mesh at
// rest takes over what is too much for it, and nothing begins to move.
bool change_state(Work& work, int device, Sample& sample) SHIFTRIG_REALTIME;

// The article's next-step rule: every device whose state did not hold changes at the end of the step.
void change_all(Work& work, const Mode& mode, Sample& sample) SHIFTRIG_REALTIME;

// Power that turned round inside the part just computed: its end is moved by the impulse that the other loss
// would have given from then on, and the mesh takes the other direction. Keeps the order across reversals
// without locating them. Returns the mode at the end.
Mode& correct_directions(Work& work, Mode& mode) SHIFTRIG_REALTIME;

// ω⁺ = B J ω: the impulse through the active rigid set of `mode` that makes its speeds agree. Returns the
// kinetic energy lost [J].
double join(Work& work, const Mode& mode, double* speeds) SHIFTRIG_REALTIME;

// ż = L z + S̃ f of the sample.
void sample_rate(const Work& work, const Mode& mode, Sample& sample) SHIFTRIG_REALTIME;

}  // namespace shiftrig::plant::detail
