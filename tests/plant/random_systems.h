// Random regular mechanical systems: any machine a user could write down from masses, shafts, dampers,
// clutches, brakes, gears and planetary rows, with everything that makes such a machine hard: loops,
// light bodies between heavy ones, lossy meshes that stick, several clutches acting in one instant.
#pragma once

#include <cstdint>
#include <string>

#include "plant/description.h"
#include "tests/plant/reference/fields.h"

namespace shiftrig {

struct RandomSystem {
    plant::Description description;
    // No housing, gear or quadratic load: Σ Jω changes by the impulse of the sources alone.
    bool momentum_is_conserved = false;
    std::vector<reference::InputChange> inputs;  // throttle, grade, commands; in order of time
    bool turns_round = true;                     // has no engine: mirrored() is the same machine
    std::string traits;                          // "n=7 light lossy loop row shift …", for statistics
};

// The same seed gives the same system on every machine.
RandomSystem random_system(std::uint64_t seed, double seconds);

// The same machines with some of their clutches replaced by freewheels.
RandomSystem random_system_with_freewheels(std::uint64_t seed, double seconds);

// The same machines with play in some of their shafts.
RandomSystem random_system_with_backlashes(std::uint64_t seed, double seconds);

// The same machines with friction factors from tables in some of their clutches: rising and falling over the slip, with kinks.
RandomSystem random_system_with_friction_tables(std::uint64_t seed, double seconds);

// One to five masses on gears and rows, at rest between brakes and clutches that mostly hold more than they pass on sliding,
// under loads that grow, wave or stay: what holds together, and what gives way first.
RandomSystem random_system_of_brakes(std::uint64_t seed, double seconds);

// The machine with about every third mass on a spring to the housing (random_forests.h).
RandomSystem with_mounts(RandomSystem system, std::uint64_t seed);

// Both machines in one description, joined by nothing; names of the second begin with "b.".
plant::Description side_by_side(plant::Description a, const plant::Description& b);

// The same machine with everything turned round: initial speeds and twists, torques, the sense in which freewheels block.
plant::Description mirrored(plant::Description description);
std::vector<reference::InputChange> mirrored(std::vector<reference::InputChange> inputs);

// ∫ waveform dt from 0 to `until`.
double impulse(const plant::Waveform& waveform, double until);

}  // namespace shiftrig
