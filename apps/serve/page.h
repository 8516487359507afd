// The dashboard's page (web/dist/dashboard.html), built into the program.
#pragma once

#include <string_view>

namespace shiftrig::serve {

extern const std::string_view dashboard_page;

}  // namespace shiftrig::serve
