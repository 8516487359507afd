// Random vehicles: drive trains of every kind between an engine and the ground, so that the nonlinear fields (engine, converter,
// tyre, road, plough, drag) meet contact states that change.
#pragma once

#include "tests/plant/random_systems.h"

namespace shiftrig {

// An engine or a motor; a clutch or a converter, with or without a lock-up clutch; two gears under load, a planetary row, one gear or
// none; one to three wheels on tyres or Coulomb contacts, a differential, a trailer; starting, driving, coasting, braking to
// standstill, rolling back, standing, spinning, lugging until the engine stalls.
RandomSystem random_vehicle(std::uint64_t seed, double seconds);

// The same vehicles with wet plates behind proportional valves in place of many of their clutches, in oil that drags the open ones.
RandomSystem random_vehicle_with_wet_clutches(std::uint64_t seed, double seconds);

}  // namespace shiftrig
