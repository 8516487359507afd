// Units as DBC files spell them, and what they are in the rig's units.
#pragma once

#include <optional>
#include <string_view>

#include "plant/signal.h"

namespace shiftrig::io::can {

struct UnitConversion {
    plant::Unit unit = plant::Unit::one;
    double factor = 1, offset = 0;  // value in `unit` = written value · factor + offset
};

// "rpm", "kPa", "km/h", "°C", "%", "" …; nothing if the spelling is not known.
std::optional<UnitConversion> unit_conversion(std::string_view spelling);

// "a pressure", "an angular speed": for messages.
std::string_view quantity(plant::Unit unit);

}  // namespace shiftrig::io::can
