// Clutch pedal and brake pedal: a command through a first-order lag, advanced exactly.
//
//     lag · ẏ = u − y,   y(t + h) = u + (y(t) − u) e^(−h/lag)     u held over the step
//     spring-closed (release): engagement = 1 − y                 applied: engagement = y
//
//   u     command, limited to 0…1      1
//   y     position (state)             1
//   lag   time constant                s; 0: y = u at once
//
// Does not model: stroke, friction and hysteresis of the linkage.
#pragma once

#include "plant/laws/step_values.h"
#include "plant/math/elementary.h"

namespace shiftrig::plant {

struct LagOperator {
    double half_decay = 0;  // e^(−h/(2 lag))
};

inline LagOperator lag_operator(double lag, double h) noexcept {
    return {lag > 0 ? exp(-0.5 * h / lag) : 0};
}

// Advances y over the step and returns its values in it.
inline StepValues advance_lag(const LagOperator& op, double& y, double command) noexcept {
    const double u = command < 0 ? 0 : command > 1 ? 1 : command;
    StepValues values;
    values.begin = op.half_decay > 0 ? y : u;
    values.middle = u + (values.begin - u) * op.half_decay;
    values.end = u + (values.middle - u) * op.half_decay;
    y = values.end;
    return values;
}

}  // namespace shiftrig::plant
