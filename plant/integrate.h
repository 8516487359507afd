// One part of a step, by the model's engine. Internal to plant/.
#pragma once

#include "plant/ark3.h"
#include "plant/etd3.h"

namespace shiftrig::plant::detail {

// The engine for long chains, or the one for everything else.
inline void integrate(Work& w, const Mode& mode, double end_fraction) SHIFTRIG_REALTIME {
    if (mode.tree) {
        advance_tree(w, mode, end_fraction);
    } else {
        advance(w, mode, end_fraction);
    }
}

}  // namespace shiftrig::plant::detail
