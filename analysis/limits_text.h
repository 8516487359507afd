// config/limits.yaml, built into the program.
#pragma once

#include <string_view>

namespace shiftrig::analysis {

extern const std::string_view limits_text;

}  // namespace shiftrig::analysis
