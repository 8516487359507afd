// Which devices at rest have to do with one another. Internal to plant/.
#pragma once

#include "plant/forces.h"

namespace shiftrig::plant::detail {

// The devices that may take a load from one another: those on masses that gears, rows, locked pairs and pairs at rest join.
// What hangs on it by shafts and dampers feels nothing of it in the same instant. Held in scratch.piece.
struct Piece {
    const ModelData* model = nullptr;
    const int* joined =
        nullptr;  // by mass, on a tree by position: the first of those it is joined to. None: all are one piece
    int first = -1;  // of this one
    bool holds(int device) const SHIFTRIG_REALTIME;
};

// The piece around a device at the sample; −1: everything.
Piece piece_around(const Work& work, const Mode& mode, int device, const Sample& sample) SHIFTRIG_REALTIME;

}  // namespace shiftrig::plant::detail
