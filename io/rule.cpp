#include "io/rule.h"

#include <cstdio>

namespace shiftrig::io {

namespace {

std::string number(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%g", value);
    return text;
}

}  // namespace

std::string Rule::words() const {
    const bool below = std::isfinite(minimum), above = std::isfinite(maximum);
    if (zero_excluded) return "must not be 0";
    if (below && above && !minimum_excluded)
        return "must be within " + number(minimum) + " and " + number(maximum);
    if (below && above) return "must be > " + number(minimum) + " and at most " + number(maximum);
    if (below) return (minimum_excluded ? "must be > " : "must be at least ") + number(minimum);
    if (above) return "must be at most " + number(maximum);
    return "must be a finite number";
}

}  // namespace shiftrig::io
