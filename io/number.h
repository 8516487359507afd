// Numbers that a user writes outside a YAML file: on the command line, in its NAME=VALUE.
#pragma once

#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

namespace shiftrig::io {

// All of `text` as a number, as in a file: no nan, no inf, nothing that a double cannot hold.
inline std::optional<double> finite_number(std::string_view text) {
    if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
        return std::nullopt;
    return value;
}

}  // namespace shiftrig::io
