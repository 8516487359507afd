// The frame of a report (web/dist/report.html), built into the program.
#pragma once

#include <string_view>

namespace shiftrig::analysis {

extern const std::string_view report_page;

}  // namespace shiftrig::analysis
