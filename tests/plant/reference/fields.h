// The nonlinear fields for the reference solver: engines, converters, tyres, ploughs, roads, actuators with a lag, written from
// the equations that stand above their laws (plant/laws) and in the specification of the tractor, and from nothing of the
// code that computes them.
//
// Extra states, in this order: κ of each tyre; of each engine torque, boost and three that change at whole milliseconds only
// (0 running, 1 stalled, 2 cranking; time cranked; start input before); position of each lagged actuator.
#pragma once

#include <string>
#include <vector>

#include "tests/plant/reference/system.h"

namespace shiftrig::reference {

// What somebody outside does: from `time` on (a whole millisecond) an input of the model has this value.
struct InputChange {
    double time = 0;  // [s]
    std::string input;
    double value = 0;
};

// One input over time; before the first change it has its initial value.
struct Told {
    double initial = 0;
    std::vector<std::pair<double, double>> changes;  // (time, value), in order
    double at(double inside) const {
        double value = initial;
        for (const auto& [time, told] : changes)
            if (time <= inside) value = told;
        return value;
    }
};

// A machine without any is the same as System(description). What does not feel the mechanics, the pistons of wet clutches, is
// known until the time `until` [s].
System system_of(const plant::Description& description, const std::vector<InputChange>& inputs, double until);

}  // namespace shiftrig::reference
