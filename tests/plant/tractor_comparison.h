// The F2 → F3 shift of the reference tractor on any method, as eleven signals on a 1 ms grid, and the
// error of one run against another.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "plant/plant.h"
#include "tests/plant/reference/tractor.h"

namespace shiftrig {

// engine, input, output, wheels [rad/s], vehicle [m/s]; damper, pinion shaft, axle [Nm]; Fc, F2, F3 [Nm].
inline constexpr std::array<const char*, 11> shift_signals = {
    "engine", "input", "output", "wheels", "vehicle", "damper", "pinion_shaft", "axle", "Fc", "F2", "F3"};
struct ShiftTrace {
    std::vector<std::array<double, 11>> rows;                   // at 0, 1, … ms of the shift
    std::vector<std::string> events;                            // with their times in the shift
    double seconds = 0;                                         // compute time of the shift
    double energy_defect = 0, clutch_heat = 0, dissipated = 0;  // of the shift [J]
    int fall_backs = 0, localised = 0;
};

// RMS(a − b)/RMS(b − mean b) of every signal, and the worst of them.
struct TraceError {
    std::array<double, 11> relative{};
    double worst = 0;
    const char* signal = "";
};
TraceError error(const ShiftTrace& trace, const ShiftTrace& truth);

// The speeds the plant's start() makes of the shift's starting condition: both sides begin with them.
reference::Vector start_speeds(const cases::TractorShift& shift);

ShiftTrace run_plant(const cases::TractorShift& shift, int steps_per_millisecond,
                     const std::function<void(plant::Description&)>& change = {},
                     plant::KernelKind kernel = plant::KernelKind::automatic);
ShiftTrace run_reference(const cases::TractorShift& shift, double step);

// Signals of a state of the reference system.
std::array<double, 11> shift_row(const reference::System& system, const reference::Sample& sample);

}  // namespace shiftrig
