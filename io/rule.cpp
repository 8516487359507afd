#include "io/rule.h"

#include <cstdio>

namespace shiftrig::io {

std::string in_digits(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%g", value);
    return text;
}

std::string Rule::words() const {
    const bool below = std::isfinite(minimum), above = std::isfinite(maximum);
    if (zero_excluded) return "must not be 0";
    if (below && above && !minimum_excluded)
        return "must be within " + in_digits(minimum) + " and " + in_digits(maximum);
    if (below && above) return "must be > " + in_digits(minimum) + " and at most " + in_digits(maximum);
    if (below) return (minimum_excluded ? "must be > " : "must be at least ") + in_digits(minimum);
    if (above) return "must be at most " + in_digits(maximum);
    return "must be a finite number";
}

}  // namespace shiftrig::io
