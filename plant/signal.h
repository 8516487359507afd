// Signals: the named quantities by which the world outside speaks with the plant. A model lists its
// inputs and outputs once; DBC files, LCM types, recordings, CSV columns and scenarios map onto these
// names, and nobody outside needs to know what is inside.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace shiftrig::plant {

// The units that occur; inside the plant everything is SI (temperatures in °C).
enum class Unit {
    one,                // dimensionless: ratios, slip, commands 0…1, counts, flags
    radian,             // rad
    radian_per_second,  // rad/s
    metre,              // m
    metre_per_second,   // m/s
    metre_per_second2,  // m/s²
    newton,             // N
    newton_metre,       // Nm
    pascal,             // Pa
    ampere,             // A
    joule,              // J
    watt,               // W
    celsius,            // °C
    second,             // s
    kilogram,           // kg
};

// The suffix a name carries where it leaves the program (`_pa`, `_rad_s`); empty for dimensionless.
std::string_view suffix(Unit unit);
// The unit as people write it ("rad/s", "Nm", "").
std::string_view symbol(Unit unit);

// One named quantity. Names read kind.device.quantity: `clutch.F1.pressure_command`, `mass.engine.speed`.
struct Signal {
    std::string name;
    Unit unit = Unit::one;
    double initial = 0;       // value before anyone sets it, in `unit`
    double minimum = -1e300;  // inputs outside [minimum, maximum] are limited by the assembly, and counted
    double maximum = 1e300;
    std::string description;  // one line for help texts and schemas

    // An input as it acts: within its range, not-a-number taken as the initial value.
    double limited(double value) const noexcept {
        return value != value ? initial : value < minimum ? minimum : value > maximum ? maximum : value;
    }
};

}  // namespace shiftrig::plant
