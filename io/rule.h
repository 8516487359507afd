// What a number in a file must obey: checked where it is read, written into the schema, and put into
// words for the error message, all from the same value.
#pragma once

#include <cmath>
#include <limits>
#include <string>

namespace shiftrig::io {

struct Rule {
    double minimum = -std::numeric_limits<double>::infinity();
    double maximum = std::numeric_limits<double>::infinity();
    bool minimum_excluded = false;
    bool zero_excluded = false;

    bool holds(double value) const {
        return std::isfinite(value) && value >= minimum && value <= maximum &&
               !(minimum_excluded && value == minimum) && !(zero_excluded && value == 0);
    }
    std::string words() const;  // "must be > 0"
};

// A number as messages have it: "0.05", "1e+06".
std::string in_digits(double value);

// Of a table [[x, y], …]; that x rises goes without saying.
struct Columns {
    Rule x, y;
};

namespace rules {
inline constexpr double unbounded = std::numeric_limits<double>::infinity();
inline constexpr Rule any{};
inline constexpr Rule positive{0, unbounded, true, false};
inline constexpr Rule not_negative{0};
inline constexpr Rule at_least_one{1};
inline constexpr Rule at_most_one{-unbounded, 1};
inline constexpr Rule not_zero{-unbounded, unbounded, false, true};
inline constexpr Rule fraction{0, 1};
inline constexpr Rule efficiency{0, 1, true, false};
inline constexpr Rule share = efficiency;
}  // namespace rules

}  // namespace shiftrig::io
