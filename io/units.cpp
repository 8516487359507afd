#include "io/units.h"

#include <array>
#include <numbers>
#include <string>

namespace shiftrig::io {

namespace {

using plant::Unit;

constexpr std::array spellings{
    UnitSpelling{"_rad_s", 1, Unit::radian_per_second},
    UnitSpelling{"_rpm", 2 * std::numbers::pi / 60, Unit::radian_per_second},
    UnitSpelling{"_m_s", 1, Unit::metre_per_second},
    UnitSpelling{"_kmh", 1 / 3.6, Unit::metre_per_second},
    UnitSpelling{"_pa", 1, Unit::pascal},
    UnitSpelling{"_bar", 1e5, Unit::pascal},
    UnitSpelling{"_percent", 0.01, Unit::one},
    UnitSpelling{"_rad", 1, Unit::radian},
    UnitSpelling{"_m", 1, Unit::metre},
    UnitSpelling{"_m_s2", 1, Unit::metre_per_second2},
    UnitSpelling{"_n", 1, Unit::newton},
    UnitSpelling{"_nm", 1, Unit::newton_metre},
    UnitSpelling{"_a", 1, Unit::ampere},
    UnitSpelling{"_j", 1, Unit::joule},
    UnitSpelling{"_w", 1, Unit::watt},
    UnitSpelling{"_degc", 1, Unit::celsius},
    UnitSpelling{"_s", 1, Unit::second},
    UnitSpelling{"_kg", 1, Unit::kilogram},
    UnitSpelling{"_mm", 1e-3, std::nullopt},
    UnitSpelling{"_cm", 1e-2, std::nullopt},
    UnitSpelling{"_cm3", 1e-6, std::nullopt},
    UnitSpelling{"_l_per_min", 1e-3 / 60, std::nullopt},
    UnitSpelling{"_bar_per_s", 1e5, std::nullopt},
    UnitSpelling{"_nm_per_bar", 1e-5, std::nullopt},
};

}  // namespace

const UnitSpelling* unit_spelling(std::string_view name) {
    const UnitSpelling* best = nullptr;
    for (const auto& spelling : spellings)
        if (name.ends_with(spelling.suffix) && (!best || spelling.suffix.size() > best->suffix.size()))
            best = &spelling;
    return best;
}

std::string suffixes_of(plant::Unit unit) {
    std::string text = unit == Unit::one ? "no suffix" : "";
    for (const auto& spelling : spellings) {
        if (spelling.unit != unit) continue;
        if (!text.empty()) text += " or ";
        text += spelling.suffix;
    }
    return text;
}

}  // namespace shiftrig::io
