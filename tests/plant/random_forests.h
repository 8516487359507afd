// Random forests of shafts, dampers, clutches, brakes and gears under swinging torques: what both engines take.
#pragma once

#include <cstdint>
#include <random>

#include "plant/description.h"

namespace shiftrig::plant {

// Every number is drawn in a statement of its own: the same machines with every compiler.
struct Forest {
    explicit Forest(std::uint64_t seed) : random(seed) {}
    std::mt19937_64 random;
    double real(double a, double b) { return a + (b - a) * static_cast<double>(random() >> 11) * 0x1p-53; }
    int below(int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); }

    Description build(bool losses);
};

// Hangs about every third mass of any machine on a spring to the housing, of 10…300 rad/s.
void add_mounts(Description& machine, std::uint64_t seed);

}  // namespace shiftrig::plant
