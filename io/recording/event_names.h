// plant::EventKind by the names that scenarios, exports and tables use.
#pragma once

#include <string_view>

#include "plant/plant.h"

namespace shiftrig::io {

inline std::string_view name(plant::EventKind kind) {
    using K = plant::EventKind;
    switch (kind) {
        case K::lock:
            return "lock";
        case K::break_away:
            return "break_away";
        case K::engage:
            return "engage";
        case K::release:
            return "release";
        case K::mesh_sticks:
            return "mesh_sticks";
        case K::mesh_releases:
            return "mesh_releases";
        case K::drive_side:
            return "drive_side";
        case K::tie_up:
            return "tie_up";
        case K::fall_back:
            return "fall_back";
        case K::engine_stalls:
            return "engine_stalls";
        case K::engine_starts:
            return "engine_starts";
        case K::facing_warning:
            return "facing_warning";
        case K::facing_failure:
            return "facing_failure";
        case K::flank_closes:
            return "flank_closes";
        case K::flank_opens:
            return "flank_opens";
        case K::untold:
            return "untold";
        case K::reverse:
            return "reverse";
    }
    return "unknown";
}

}  // namespace shiftrig::io
