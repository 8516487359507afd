// The reference tractor under the plough, shifted from F2 to F3, as a description for the plant and,
// written a second time from the equations of its laws, as a system for the reference solver.
// Valves without piston fill; pressure commands change on whole milliseconds only, as a controller's do.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "plant/description.h"
#include "tests/plant/reference/solver.h"

namespace shiftrig::cases {

enum class Shift {
    good,        // off-going and oncoming clutch hand over
    bad,         // both full for 0.2 s: tie-up
    bad_coulomb  // the same with a Coulomb wheel contact that slips, and a weaker Fc
};

struct TractorShift {
    plant::Description description;
    double warm_up = 5;   // [s] in F2, the shift's clock starts then
    double throttle = 0;  // no-load speed 1840 rpm
    std::vector<std::pair<std::string, double>> start_speeds;
    std::vector<std::string> start_locked;
    double duration = 1.5;  // [s]

    // Pressure command of F2, F3 [Pa] from the given whole millisecond of the shift on.
    std::array<double, 2> command(long millisecond) const;
    Shift shift = Shift::good;
};

// Factors on the estimates of the machine, for the sensitivity study; 1 each.
struct Estimates {
    double shaft_stiffness = 1, shaft_damping = 1, wheel_inertia = 1, other_inertias = 1, engine_inertia = 1;
    double engine_lag = 1, turbo_instant = 1, turbo_lag = 1, gear_losses = 1, main_capacity = 1;
    double friction = 1, friction_rise = 1,
           friction_speed = 1;  // μ static and sliding; its rise; over this speed
    double dead_time = 1, valve_frequency = 1, valve_damping = 1, slew = 1;
    double fill_volume = 1, fill_flow = 1, preload = 1, return_spring = 1;
    double tyre_relaxation = 1;
};

TractorShift tractor_shift(Shift shift, const Estimates& estimates = {});

// Gives the powershift clutches the pistons that the machine above does without.
void add_pistons(plant::Description& description, const Estimates& estimates = {});

// The same machine for the reference solver. Extra states: tyre slip κ (if it has a tyre), engine torque,
// boost. Its time 0 is the start of the warm-up; start speeds are those of the plant's own start.
reference::System tractor_system(const TractorShift& shift, const reference::Vector& start_speeds);

}  // namespace shiftrig::cases
