// The three-stage exponential Runge–Kutta step of order 3 ([Cox]), exact in everything linear. Internal.
#pragma once

#include "plant/forces.h"

namespace shiftrig::plant::detail {

// From the settled `begin` over `length` seconds in the mode: fills half, late and end, with forces, and
// the internal torques at the end (a left limit). `end_fraction` is where the end lies in the whole step.
void advance(Work& work, const Mode& mode, double end_fraction) SHIFTRIG_REALTIME;

// Coordinates half way through the part just computed: the step's own solution, which is exact for forces on the parabola
// through its three.
inline void coordinates_half_way(Work& w, const Mode& mode, double* coordinates) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    const ScratchData& s = w.scratch;
    double* const change = s.vector_b;
    m.kernel.loops.subtract(s.half.f, s.begin().f, m.forces, change);
    m.kernel.loops.subtract(s.late.f, s.begin().f, m.forces, change + m.forces);
    m.kernel.multiply(s.used.middle, padded(mode.order), 2 * m.forces, change, s.half.f - mode.order,
                      coordinates);
}

}  // namespace shiftrig::plant::detail
