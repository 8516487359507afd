// The scenario file: what happens to a machine (its start, the driver, the road, faults) and what is
// expected of it. Read into plain structs; the rig executes them, the scenario tests judge them.
//
//     model: ../tractor.yaml
//     duration_s: 6
//     start:
//       options: {range: M}
//       locked: [Fc, F2]
//       speeds: {engine_rpm: 1800}
//       inputs: {driver.throttle: 0.728, driver.lever: 2, clutch.F2.pressure_command_bar: 18}
//       settle_s: 10
//     timeline:
//       - {at_s: 2.0, driver.lever: 3}
//       - {at_s: 4.0, over_s: 0.5, driver.throttle: 0.5}
//     bus_faults: …
//     expect: …
//
// A signal is written with its unit as a suffix: `_rad_s` or `_rpm`, `_pa` or `_bar`, `_m_s` or `_kmh`, …;
// here every value is already in the signal's own (SI) unit.
#pragma once

#include <yaml-cpp/yaml.h>

#include <limits>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "io/input_error.h"
#include "io/signals.h"
#include "plant/plant.h"

namespace shiftrig::io {

// A signal as the user names it: `mass.vehicle.speed_kmh` is signal `mass.vehicle.speed` in km/h.
struct NamedQuantity {
    std::string written;                  // "mass.vehicle.speed_kmh"
    std::string signal;                   // "mass.vehicle.speed"
    plant::Unit unit = plant::Unit::one;  // that its suffix belongs to
    double factor = 1;                    // SI = factor · written value
    int line = 0, column = 0;
};

struct Setting {
    NamedQuantity quantity;
    double value = 0;  // SI
};

// From `at` on the signal goes to `value`, at once or linearly over `over`.
struct TimedSetting {
    double at = 0;    // [s] since the scenario's start
    double over = 0;  // [s]
    Setting setting;
};

// Where a key stands in the file, for what is found wrong with it later; line 0: it is not there.
struct KeyPlace {
    int line = 0, column = 0;
};

struct ScenarioStart {
    std::vector<std::pair<std::string, std::string>> options;  // gear → option in use: {range, M}
    std::vector<std::string> locked;                           // devices locked at the start
    std::vector<Setting> speeds;  // quantity.signal is the mass's name; [rad/s] or [m/s]
    std::vector<Setting> inputs;  // held from the start on (plant's and driver's signals)
    KeyPlace options_place, locked_place;
    double settle = 0;  // [s] the plant runs under `inputs` before time 0, without the controller
};

struct Window {
    double from = 0;                                         // [s]
    double until = std::numeric_limits<double>::infinity();  // [s]
};

// A limit on a metric of the scorecard, for the shifts named or for all.
struct MetricLimit {
    std::string shift;   // "F2->F3"; empty: every shift in the run
    std::string metric;  // "duration_s", "clutch_energy_j.F3"
    double minimum = -std::numeric_limits<double>::infinity();
    double maximum = std::numeric_limits<double>::infinity();
    int line = 0, column = 0;
};

// The shifts that have to be found, in this order: "F1->F2" completed.
struct ExpectedShift {
    std::string shift;
    bool completed = true;
    int line = 0, column = 0;
};

// An event of the plant (plant::EventKind by name: lock, break_away, …) or of the rig (safe_command).
struct ExpectedEvent {
    std::string kind;
    std::string device;  // empty: any
    Window window;
    bool must = true;  // false: must not happen
    int line = 0, column = 0;
};

struct SignalBound {
    NamedQuantity quantity;
    Window window;                                              // final state: from = until = infinity
    double minimum = -std::numeric_limits<double>::infinity();  // SI
    double maximum = std::numeric_limits<double>::infinity();   // SI
    bool at_end() const { return window.from == std::numeric_limits<double>::infinity(); }
};

struct Expectations {
    std::vector<ExpectedShift> shifts;
    bool shifts_given = false;  // true: exactly these, an empty list means no shift at all
    int no_shifts_line = 0;
    std::vector<MetricLimit> metrics;
    std::vector<ExpectedEvent> events;
    std::vector<SignalBound> signals;
};

struct ScenarioFile {
    std::string path, text;
    std::string name;         // the file's name without folder and extension
    std::string description;  // one line
    std::string model_path;   // resolved against the scenario's folder
    KeyPlace model_place;
    double duration = 0;  // [s]
    ScenarioStart start;
    std::vector<TimedSetting> timeline;  // sorted by `at`, file order where equal
    int seed = 1;                        // of sensor noise, and of bus faults that name no other
    // Parts that others understand; undefined where absent.
    YAML::Node bus_faults{YAML::NodeType::Undefined};  // io/can
    YAML::Node controller{
        YAML::NodeType::Undefined};  // the rig: calibration of the built-in controller, its faults
    Expectations expect;
};

// Throws InputError.
ScenarioFile read_scenario(const std::string& path);
ScenarioFile parse_scenario(const std::string& text, const std::string& path);

// Every signal the scenario names exists, is written in its own unit and set within its range; throws InputError naming
// the place, and the nearest signal or the rule. Masses in start.speeds are checked against `mass.<name>.speed`.
void check_signals(const ScenarioFile& scenario, const SignalTable& signals);

// Every event that the scenario expects of a device is one that this device ever tells (plant::tells()); throws InputError
// naming the place, and the nearest device or what it tells.
void check_events(const ScenarioFile& scenario, const plant::Model& model);

nlohmann::ordered_json scenario_schema();

}  // namespace shiftrig::io
