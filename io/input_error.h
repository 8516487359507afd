// What is wrong with something a user wrote: one line that names the place and the rule,
// `config/tractor.yaml:31:5: clutch "F2": friction_radius_m = -0.09; must be > 0`.
#pragma once

#include <stdexcept>
#include <string>

namespace shiftrig::io {

class InputError : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
    // line and column count from 1; 0 leaves them out.
    InputError(const std::string& file, int line, int column, const std::string& what)
        : std::runtime_error(file + (line > 0 ? ":" + std::to_string(line) : "") +
                             (line > 0 && column > 0 ? ":" + std::to_string(column) : "") + ": " + what) {}
};

}  // namespace shiftrig::io
