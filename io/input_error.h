// What is wrong with something a user wrote: one line that names the place and the rule,
// `config/tractor.yaml:31:5: clutch "F2": friction_radius_m = -0.09; must be > 0`.
#pragma once

#include <stdexcept>
#include <string>

namespace shiftrig::io {

// Names may hold line breaks, and what else a terminal obeys: they are shown as \n, \t, \x1b.
inline std::string one_line(const std::string& text) {
    std::string line;
    for (const char c : text) {
        constexpr const char* digits = "0123456789abcdef";
        const auto byte = static_cast<unsigned char>(c);
        if (c == '\n')
            line += "\\n";
        else if (c == '\t')
            line += "\\t";
        else if (byte < ' ' || byte == 0x7F)
            line += std::string("\\x") + digits[byte >> 4] + digits[byte & 15];
        else
            line += c;
    }
    return line;
}

class InputError : public std::runtime_error {
  public:
    explicit InputError(const std::string& what) : std::runtime_error(one_line(what)) {}
    // line and column count from 1; 0 leaves them out.
    InputError(const std::string& file, int line, int column, const std::string& what)
        : InputError(file + (line > 0 ? ":" + std::to_string(line) : "") +
                     (line > 0 && column > 0 ? ":" + std::to_string(column) : "") + ": " + what) {}
};

}  // namespace shiftrig::io
