// Numbers in words, by printf's rules; up to 255 characters. Not for the step. Internal to plant/.
#pragma once

#include <cstdio>
#include <string>

namespace shiftrig::plant {

template <class... Values>
std::string format(const char* pattern, Values... values) {
    char text[256];
    std::snprintf(text, sizeof text, pattern, values...);
    return text;
}

}  // namespace shiftrig::plant
