// What passes between the controller and the machine: one picture of the sensors, one set of commands; and the two
// small state machines that every engagement of a clutch needs.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "apps/tcu/calibration.h"

namespace shiftrig::tcu {

// SI units; speeds signed, positive as the machine drives forward.
struct Sensors {
    double engine_speed = 0;                      // [rad/s]
    double disc_speed = 0;                        // behind the main clutch [rad/s]
    double input_speed = 0;                       // powershift input [rad/s]
    double output_speed = 0;                      // powershift output [rad/s]
    double engine_torque = 0;                     // net on the crankshaft [Nm]
    std::array<double, clutch_count> pressure{};  // measured [Pa]
    int lever = 0;                                // −1 reverse, 0 neutral, 1… forward
    bool automatic = false;                       // the lever is an upper bound
    double brake = 0;                             // pedal 0…1
    double clutch_pedal = 0;                      // 0…1
    bool parking_brake = false;
    // What was heard lately; false when the message is missing or its content is not valid.
    bool speeds_alive = false, engine_alive = false, lever_alive = false, pressures_alive = false;
};

enum class Mode { listening, neutral, launch, driving, shift, limp };

struct Commands {
    std::array<double, clutch_count> pressure{};  // [Pa]
    double main_release = 0;                      // 0 closed … 1 open
    double engine_speed_request = 0;              // asked of the engine by TSC1 [rad/s]; 0: nothing
    int current_gear = 0;                         // engaged
    int selected_gear = 0;                        // being engaged, or engaged
    bool shifting = false;
    bool engaged = false;  // the driveline passes torque
    Mode mode = Mode::listening;
};

inline int clutch_of(int gear) {
    return gear < 0 ? reverse_clutch : gear - 1;
}

// Slip of a gear's clutch, referred to the input [rad/s].
inline double slip_of(const Calibration& cal, const Sensors& s, int gear) {
    return s.input_speed - cal.machine.ratio[static_cast<std::size_t>(clutch_of(gear))] * s.output_speed;
}

// Fills a clutch until its measured pressure stands at the kiss point.
struct Fill {
    double time = 0;
    // The command for this cycle; `done` once the piston stands against the plates.
    double step(const Calibration& cal, double measured, bool measured_alive) noexcept {
        time += cal.period;
        const bool filled = measured_alive && measured >= cal.clutch.kiss_pressure - cal.clutch.filled_margin;
        done = done || filled || time >= cal.clutch.fill_timeout;
        return done ? cal.clutch.touch_pressure : cal.clutch.fill_pressure;
    }
    bool done = false;
};

// Tells when a clutch has locked: its slip stays small, or changes its sign, for long enough.
struct SlipWatch {
    double time = 0, last = 0;
    bool locked(const Calibration& cal, double slip) noexcept {
        const bool small = std::abs(slip) < cal.clutch.locked_slip || slip * last < 0;
        time = small ? time + cal.period : 0;
        last = slip;
        return time >= cal.clutch.locked_time;
    }
};

}  // namespace shiftrig::tcu
