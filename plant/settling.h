// The parts of settling that those who change states need as well. Internal to plant/.
#pragma once

#include "plant/devices.h"
#include "plant/piece.h"
#include "plant/transitions.h"

namespace shiftrig::plant::detail {

// Loss directions that agree with the torques they lead to ([Algin] eq. (16)–(25), but decided by the lossy
// torques): start from the present ones and flip the worst offender until there is none.
// `complete`: the torques of the present states are in the sample.
Mode& find_directions(Work& work, unsigned char* contact, Sample& sample,
                      bool complete = false) SHIFTRIG_REALTIME;

// The same for states that are only tried: the certificate does not tell where none agree.
struct Tried {
    Mode& mode;
    bool agrees;
};
Tried try_directions(Work& work, unsigned char* contact, Sample& sample) SHIFTRIG_REALTIME;

// The locked pair of the piece that uses most of its static capacity.
struct Use {
    int pair = -1;
    double share = 0;  // torque over capacity
};
Use most_used(const Work& work, const unsigned char* contact, const Sample& sample,
              const Piece& piece = {}) SHIFTRIG_REALTIME;

// The pair breaks away at the sample. Meshes that leaned on their losses begin anew: which way they go now,
// release_drive() finds out.
void open_pair(Work& work, const Mode& mode, int pair, Sample& sample) SHIFTRIG_REALTIME;

// A lossy mesh that others hold at rest takes any loss torque up to the limit of either direction. So before a pair opens, the
// mesh that relieves the most used pair most is set to its limit. Says whether one was; else rearrange() asks all at rest.
bool lean_on_losses(Work& work, const Mode& mode, const Use& most, Sample& sample) SHIFTRIG_REALTIME;

// A locked pair at its limit or beyond gives way, unless meshes at rest or other pairs take its load; `most` is the most
// used one. Does anything move?
bool give_way(Work& work, const Mode& mode, const Use& most, int pair, Sample& sample) SHIFTRIG_REALTIME;

}  // namespace shiftrig::plant::detail
