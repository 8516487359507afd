// Energy: where every joule of a step went. Internal to plant/.
#pragma once

#include "plant/forces.h"
#include "plant/modes.h"

namespace shiftrig::plant::detail {

// Kinetic energy of the masses and strain energy of the shafts [J], with that of closed flanks where their contact states
// are given.
double stored_energy(const ModelData& model, const double* z) SHIFTRIG_REALTIME;
double stored_energy(const ModelData& model, const double* z, const unsigned char* contact) SHIFTRIG_REALTIME;

// Books the part of a step from `begin` to `end` in `mode`: input work, heat of every pair, all other
// losses, way of the translating masses; by Simpson's rule. The exponential engine takes the forces with which the step was
// made and the motion that they gave half way, in as many parts as stiff shafts and fast dampers need; on a tree the motion half way is
// Hermite's cubic and forces are taken anew (docs/mechanics.md, Account of energy).
void book(Work& work, const Mode& mode) SHIFTRIG_REALTIME;

// How the ledger divides a length of time: into equal parts, an even number, and the first of them anew, into parts 1/16 as
// long, and so on, so many levels deep. Shafts that swing need parts of the same length throughout; what fast dampers take is
// gone after the first four.
struct LedgerGrid {
    int parts = 2, levels = 0;
};

// Of a length of time that is this share of a step.
LedgerGrid ledger_grid(const ModelData& model, const Mode& mode, double share) SHIFTRIG_REALTIME;

// The most that any mode of the machine asks for: no motion dies out faster than all dampers together make it do.
int most_ledger_levels(const Structure& structure, double step_size);

// Their operators, for a whole step.
void build_ledger(const ModelData& model, Mode& mode, double* workspace, int* integers) SHIFTRIG_REALTIME;

// The operators of one of those parts, of which only what they give to the end is asked for (step_operators.cpp).
StepOperators build_ledger_operators(const ModelData& model, const Mode& mode, double length, double* memory,
                                     double* workspace, int* integers) SHIFTRIG_REALTIME;

}  // namespace shiftrig::plant::detail
