#include "io/can/units.h"

#include <array>
#include <numbers>
#include <utility>

namespace shiftrig::io::can {

namespace {

using plant::Unit;
constexpr double kDegree = std::numbers::pi / 180;

constexpr std::pair<std::string_view, UnitConversion> kUnits[] = {
    {"", {}},
    {"-", {}},
    {"1", {}},
    {"bit", {}},
    {"count", {}},
    {"ratio", {}},
    {"%", {Unit::one, 0.01, 0}},
    {"rad", {Unit::radian, 1, 0}},
    {"deg", {Unit::radian, kDegree, 0}},
    {"°", {Unit::radian, kDegree, 0}},
    {"rad/s", {Unit::radian_per_second, 1, 0}},
    {"rpm", {Unit::radian_per_second, std::numbers::pi / 30, 0}},
    {"RPM", {Unit::radian_per_second, std::numbers::pi / 30, 0}},
    {"1/min", {Unit::radian_per_second, std::numbers::pi / 30, 0}},
    {"U/min", {Unit::radian_per_second, std::numbers::pi / 30, 0}},
    {"min-1", {Unit::radian_per_second, std::numbers::pi / 30, 0}},
    {"Hz", {Unit::radian_per_second, 2 * std::numbers::pi, 0}},
    {"m", {Unit::metre, 1, 0}},
    {"km", {Unit::metre, 1000, 0}},
    {"mm", {Unit::metre, 1e-3, 0}},
    {"m/s", {Unit::metre_per_second, 1, 0}},
    {"km/h", {Unit::metre_per_second, 1 / 3.6, 0}},
    {"kmh", {Unit::metre_per_second, 1 / 3.6, 0}},
    {"kph", {Unit::metre_per_second, 1 / 3.6, 0}},
    {"mph", {Unit::metre_per_second, 0.44704, 0}},
    {"m/s2", {Unit::metre_per_second2, 1, 0}},
    {"m/s²", {Unit::metre_per_second2, 1, 0}},
    {"m/s^2", {Unit::metre_per_second2, 1, 0}},
    {"N", {Unit::newton, 1, 0}},
    {"kN", {Unit::newton, 1000, 0}},
    {"Nm", {Unit::newton_metre, 1, 0}},
    {"N*m", {Unit::newton_metre, 1, 0}},
    {"kNm", {Unit::newton_metre, 1000, 0}},
    {"Pa", {Unit::pascal, 1, 0}},
    {"kPa", {Unit::pascal, 1e3, 0}},
    {"MPa", {Unit::pascal, 1e6, 0}},
    {"mbar", {Unit::pascal, 100, 0}},
    {"bar", {Unit::pascal, 1e5, 0}},
    {"psi", {Unit::pascal, 6894.757293168361, 0}},
    {"A", {Unit::ampere, 1, 0}},
    {"mA", {Unit::ampere, 1e-3, 0}},
    {"J", {Unit::joule, 1, 0}},
    {"kJ", {Unit::joule, 1000, 0}},
    {"W", {Unit::watt, 1, 0}},
    {"kW", {Unit::watt, 1000, 0}},
    {"°C", {Unit::celsius, 1, 0}},
    {"degC", {Unit::celsius, 1, 0}},
    {"deg C", {Unit::celsius, 1, 0}},
    {"C", {Unit::celsius, 1, 0}},
    {"K", {Unit::celsius, 1, -273.15}},
    {"s", {Unit::second, 1, 0}},
    {"ms", {Unit::second, 1e-3, 0}},
    {"min", {Unit::second, 60, 0}},
    {"h", {Unit::second, 3600, 0}},
    {"kg", {Unit::kilogram, 1, 0}},
    {"t", {Unit::kilogram, 1000, 0}},
};

}  // namespace

std::optional<UnitConversion> unit_conversion(std::string_view spelling) {
    while (spelling.starts_with(' ')) spelling.remove_prefix(1);
    while (spelling.ends_with(' ')) spelling.remove_suffix(1);
    for (const auto& [known, conversion] : kUnits)
        if (known == spelling) return conversion;
    return std::nullopt;
}

std::string_view quantity(plant::Unit unit) {
    switch (unit) {
        case Unit::one:
            return "a plain number";
        case Unit::radian:
            return "an angle";
        case Unit::radian_per_second:
            return "an angular speed";
        case Unit::metre:
            return "a length";
        case Unit::metre_per_second:
            return "a speed";
        case Unit::metre_per_second2:
            return "an acceleration";
        case Unit::newton:
            return "a force";
        case Unit::newton_metre:
            return "a torque";
        case Unit::pascal:
            return "a pressure";
        case Unit::ampere:
            return "a current";
        case Unit::joule:
            return "an energy";
        case Unit::watt:
            return "a power";
        case Unit::celsius:
            return "a temperature";
        case Unit::second:
            return "a time";
        case Unit::kilogram:
            return "a mass";
    }
    return "a quantity";
}

}  // namespace shiftrig::io::can
