// Everything the controller believes about its machine and everything a calibrator may turn, in SI units.
// config/calibration/tractor.yaml holds the values, each with its unit in its name; nothing has a default.
#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "plant/realtime.h"

namespace YAML {
class Node;
}

namespace shiftrig::tcu {

inline constexpr int clutch_count = 5;  // F1, F2, F3, F4, FR
inline constexpr int reverse_clutch = 4;
inline constexpr int highest_gear = 4;

enum class LaunchElement { gear_clutch, main_clutch };

struct Calibration {
    double period = 0;  // of the control cycle [s]

    struct Machine {
        std::array<double, clutch_count> ratio{};  // powershift input over output speed; reverse negative [1]
        double input_inertia = 0;                  // engine to powershift drums [kg m²]
        std::vector<std::pair<double, double>> full_load;  // engine ([rad/s], [Nm]), rising in speed
    } machine;

    struct Clutch {
        double kiss_pressure = 0;        // torque begins here [Pa]
        double torque_per_pressure = 0;  // sliding [Nm/Pa]
        double touch_pressure = 0;       // a little above: holds the piston against the plates [Pa]
        double full_pressure = 0;        // in gear [Pa]
        double fill_pressure = 0;        // command while filling [Pa]
        double filled_margin = 0;        // measured pressure below kiss that counts as filled [Pa]
        double fill_timeout = 0;         // then the shift goes on regardless [s]
        double locked_slip = 0;          // [rad/s]
        double locked_time = 0;          // slip must stay below for [s]
        double closing_rate = 0;         // ramp to full pressure once locked [Pa/s]
    } clutch;

    struct Shift {
        double torque_time = 0;     // torque handed over in [s]
        double inertia_time = 0;    // input brought to its new speed in [s]
        double shortest_to_go = 0;  // lower bound of the time to go in the guidance of the slip [s]
        double hold_margin = 0;     // capacity of the offgoing clutch over its torque [1]
        double timeout = 0;         // of the inertia phase; then the old gear is taken back [s]
        double pause = 0;           // between two shifts [s]
        double engine_lead = 0;     // asked of the engine above its new speed, where it leads [rad/s]
        double engine_return = 0;   // and how fast it is given back afterwards [rad/s²]
    } shift;

    struct Launch {
        LaunchElement element = LaunchElement::gear_clutch;
        double torque = 0;                  // greatest [Nm]
        double torque_rate = 0;             // [Nm/s]
        double engine_droop = 0;            // the torque fades to 0 as the engine falls by this fraction [1]
        double timeout = 0;                 // [s]
        double main_clutch_torque = 0;      // capacity of the main clutch when closed [Nm]
        double main_release_time = 0;       // wait after opening the main clutch [s]
        int highest_gear = 0;               // to start off in from rest
        double highest_reversal_speed = 0;  // of the powershift output against the wanted direction [rad/s]
    } launch;

    struct Choice {
        double upshift_torque_margin = 0;  // share of full load an upshift may need in the new gear [1]
        double auto_upshift_speed = 0;     // least engine speed in the new gear, automatic only [rad/s]
        double highest_engine_speed = 0;   // a downshift may not exceed [rad/s]
        double lug_speed = 0;              // below it at full load the engine lugs [rad/s]
        double lug_load = 0;               // share of the full load that counts as full [1]
        double lug_time = 0;               // for so long [s]
        double refusal_time = 0;           // no upshift after lugging or a failed shift [s]
        double torque_filter = 0;          // time constant of the torque estimate [s]
    } choice;

    struct Stop {
        double stall_guard_speed = 0;  // below it the driveline is opened [rad/s]
        double brake_speed = 0;        // the same while the brake is applied [rad/s]
        double look_ahead = 0;         // the engine's speed so far ahead is what counts [s]
        double relaunch_speed = 0;     // the engine must be above it to start again [rad/s]
        double brake_applied = 0;      // pedal that counts as applied [1]
    } stop;

    struct Limp {
        double recovery_time = 0;  // signals must be alive for so long [s]
        double slip = 0;           // apparent slip in gear at full pressure that is a fault [rad/s]
        double slip_time = 0;      // for so long [s]
        double sensor_zero = 0;    // a speed below this reads as lost [rad/s]
    } limp;

    struct Bus {
        std::string mapping;  // what the frames of a CAN bus mean; read relative to this file
    } bus;

    double pressure_for(double torque) const SHIFTRIG_REALTIME;     // touch pressure … full pressure [Pa]
    double full_load(double engine_speed) const SHIFTRIG_REALTIME;  // [Nm]
};

// Throws io::InputError naming file, line, key and rule.
Calibration read_calibration(const std::string& path);
Calibration parse_calibration(const YAML::Node& root,
                              const std::string& path);  // `path` for messages and relative names

}  // namespace shiftrig::tcu
