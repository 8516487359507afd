// A chain of masses with a clutch every fifth, driven by a swinging torque: what the engine for long chains is for.
#pragma once

#include <string>

#include "tests/plant/parts.h"

namespace shiftrig::plant {

inline Description chain(int n) {
    Description d;
    d.name = "chain";
    for (int j = 0; j < n; ++j) {
        const std::string b = "m" + std::to_string(j), a = "m" + std::to_string(j - 1);
        d.masses.push_back(mass(b, 1 + 0.1 * (j % 7), 100));
        if (j == 0) continue;
        if (j % 5 == 0) {
            d.clutches.push_back(clutch("c" + b, a, b, 300, 1.1));
        } else {
            d.shafts.push_back({"s" + b, a, b, 2e4, 10, 0});
        }
    }
    d.sources = {source("m0", sine(200, 3))};
    return d;
}

}  // namespace shiftrig::plant
