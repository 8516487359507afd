// Lossy meshes at rest: what they take to stay so, and whether they go. Internal to plant/.
#pragma once

#include "plant/forces.h"
#include "plant/piece.h"

namespace shiftrig::plant::detail {

LossAtRest loss_at_rest(const Work& work, int mesh, const Sample& sample) SHIFTRIG_REALTIME;
// The same of each mesh that moves with this leader: what all the losses of that motion would have to be, as a torque at this mesh,
// and what they can be. By mesh.
void family_losses(Work& work, const Mode& mode, int leader, Sample& sample,
                   LossAtRest* losses) SHIFTRIG_REALTIME;
// With whom a stuck mesh moves; −1: others hold it.
int leader_of(Work& work, const Mode& mode, int mesh) SHIFTRIG_REALTIME;
// loss_at_rest() of one mesh after the other, as torques of all the losses of its motion where it has one.
class MotionLosses {
  public:
    MotionLosses(Work& work, const Mode& now) : w(work), mode(now) {}
    LossAtRest of(int mesh, Sample& sample) SHIFTRIG_REALTIME;

  private:
    Work& w;
    const Mode& mode;
    int known = -1;  // the leader whose family's losses are in scratch.losses
};
// What is left of the loss that a stuck mesh can take [Nm].
double loss_left(const Work& work, int mesh, const Sample& sample) SHIFTRIG_REALTIME;

// Would one of the piece have to lose more than it can?
bool loses_too_much(const Work& work, const Mode& mode, const Sample& sample,
                    const Piece& piece = {}) SHIFTRIG_REALTIME;

// Does the leader's own loss suffice, beyond rounding, whatever its family could add? Then nothing goes, and there is no
// need to try.
bool is_held(const Work& work, int leader, const Sample& sample) SHIFTRIG_REALTIME;

// A family is let go together, each member with the sign that the motion gives it. It goes if, one way and with
// its own consistent losses, it accelerates that way. Where other stuck meshes hold it only together, one of those goes
// with it. Returns the acceleration towards the better of all ways beyond rounding, positive if it goes, with the
// states it then has in scratch.release; the sample is as before.
double release_drive(Work& work, const Mode& mode, int leader, Sample& sample) SHIFTRIG_REALTIME;

// Lets the first family go that does. Says whether one did.
bool release_stuck_meshes(Work& work, const Mode& mode, Sample& sample) SHIFTRIG_REALTIME;

// A stuck mesh that nothing sets in motion, but whose loss would have to be more than it can be, stays at its limit, and a
// pair at rest that had been at its own takes the rest: it locks. The counterpart of lean_on_losses(). Where there is none, but a
// locked pair to whose torque it matters, everything at rest is asked together.
bool leave_to_others(Work& work, const Mode& mode, Sample& sample) SHIFTRIG_REALTIME;

}  // namespace shiftrig::plant::detail
