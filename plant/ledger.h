// Energy: where every joule of a step went. Internal to plant/.
#pragma once

#include "plant/forces.h"

namespace shiftrig::plant::detail {

// Kinetic energy of the masses and strain energy of the shafts [J], with that of closed flanks where their contact states
// are given.
double stored_energy(const ModelData& model, const double* z) SHIFTRIG_REALTIME;
double stored_energy(const ModelData& model, const double* z, const unsigned char* contact) SHIFTRIG_REALTIME;

// Books the part of a step from `begin` to `end` in `mode`: input work, heat of every pair, all other
// losses, way of the translating masses; by Simpson's rule with the middle state from Hermite's cubic.
void book(Work& work, const Mode& mode) SHIFTRIG_REALTIME;

}  // namespace shiftrig::plant::detail
