// What builders of random machines share: their dice, names that count up, the description they fill.
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include "tests/plant/dice.h"
#include "tests/plant/random_systems.h"

namespace shiftrig {

class RandomBuilder {
  protected:
    RandomBuilder(std::uint64_t seed, double seconds) : dice_(seed), seconds_(seconds) {}

    plant::Description& d() { return system_.description; }
    std::string name(const char* kind) { return kind + std::to_string(++count_); }
    void trait(const char* word) { system_.traits += std::string(" ") + word; }
    double instant() { return 1e-3 * dice_.integer(5, static_cast<int>(seconds_ * 900)); }
    double inertia(const std::string& mass) {
        for (const auto& m : d().masses)
            if (m.name == mass) return m.inertia;
        return 0;
    }
    RandomSystem finish() {
        system_.traits = "n=" + std::to_string(d().masses.size()) + system_.traits;
        return std::move(system_);
    }

    Dice dice_;
    double seconds_;
    RandomSystem system_;

  private:
    int count_ = 0;
};

}  // namespace shiftrig
