// Draws by hand: the distributions of the standard library differ between implementations.
#pragma once

#include <cmath>
#include <cstdint>
#include <random>

namespace shiftrig {

class Dice {
  public:
    explicit Dice(std::uint64_t seed) : engine_(seed * 0x9E3779B97F4A7C15ull + 1) { engine_.discard(8); }
    double uniform(double low, double high) {
        return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1.0p-53;
    }
    double logarithmic(double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); }
    int integer(int low, int high) { return low + static_cast<int>(uniform(0, 1) * (high - low + 1)); }
    bool chance(double probability) { return uniform(0, 1) < probability; }

  private:
    std::mt19937_64 engine_;
};

}  // namespace shiftrig
