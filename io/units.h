// Units as a user writes them: the suffix of a name that leaves the program. Every suffix is a plain
// factor to SI, so 0 means 0 in each of them.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "plant/signal.h"

namespace shiftrig::io {

struct UnitSpelling {
    std::string_view suffix;          // "_rpm"
    double factor;                    // SI value = factor · written value
    std::optional<plant::Unit> unit;  // of a signal that can be written so; none: only in model files
};

// The longest spelling a name ends with; nullptr if it ends with none.
const UnitSpelling* unit_spelling(std::string_view name);

// Every suffix by which a signal of this unit can be written: "_rad_s or _rpm".
std::string suffixes_of(plant::Unit unit);

}  // namespace shiftrig::io
