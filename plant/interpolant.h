// The motion within the part of a step just computed by the exponential engine, without another step: that would need
// operators of its own length. Internal to plant/.
#pragma once

#include "plant/forces.h"

namespace shiftrig::plant::detail {

// Coordinates on the quartic through both ends with their rates and the step's own solution half way, auxiliary states on
// the cubic through both ends; h = 1 ms and 50 Hz leave 1e-6 of a swing.
struct Interpolant {
    double from = 0, until = 0;  // fractions of the step
    const double *begin = nullptr, *end = nullptr;
    const double *begin_rate = nullptr, *end_rate = nullptr;  // times the length
    const double* rest = nullptr;  // what the cubic through both ends lacks half way
};

// Of `begin`, `end` and the stages of the last advance() in this mode; valid until the next one.
Interpolant interpolate_part(Work& work, const Mode& mode) SHIFTRIG_REALTIME;

// All of the sample at so much of the part, 0…1, a left limit; forces, capacities and internal torques included.
void sample_within(const Work& work, const Mode& mode, const Interpolant& part, double share,
                   Sample& sample) SHIFTRIG_REALTIME;

}  // namespace shiftrig::plant::detail
