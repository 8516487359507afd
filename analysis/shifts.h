// Finds the changes of gear in a run: from which gear to which, asked for when, completed when, or not.
//
// A gear is *engaged* while the clutches that select it, and no others of the gearbox, are locked. A shift
// *begins* when a clutch that does not belong to the engaged gear is commanded, and is *asked for* when the
// driver's lever moved just before, else when it begins. It is *completed* at the first instant from which
// the ratio of the new gear holds within a tolerance (2 %), every clutch of the new gear included, for a
// holding time. It fails when the command is taken back, when a third gear is commanded, or when the
// time is over. Opening the driveline is no shift. docs/shift-quality.md has the words and the reasons.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "analysis/gears.h"
#include "analysis/run.h"

namespace shiftrig::analysis {

inline constexpr const char* neutral = "N";

enum class ShiftKind {
    power_upshift,
    power_downshift,  // the engine drives
    coast_upshift,
    coast_downshift,  // the vehicle drives
    launch,           // from neutral
    shuttle,          // against the direction of the gear before
};
std::string_view name(ShiftKind kind);  // "power upshift"

enum class ShiftEnd { completed, taken_back, overtaken, timed_out, run_ended };
std::string_view name(ShiftEnd end);  // "taken back"

struct ShiftRules {
    double ratio_tolerance = 0.02;  // of the new ratio [1]
    double hold = 0.1;              // it has to stay there [s]
    double timeout = 2;             // after it was asked for [s]
    double launch_timeout = 5;      // of launches and shuttles, after they began [s]
    double lever_lookback = 0.5;    // a lever moved this long before the beginning asked for the shift [s]
    double settling = 1;            // judged after its end, unless the next shift is asked for before [s]
};

struct Shift {
    std::string from, to;  // gear names, or "N"
    ShiftKind kind = ShiftKind::power_upshift;
    ShiftEnd end = ShiftEnd::completed;
    std::vector<std::string> oncoming, offgoing;  // clutches

    // Rows of the run: asked ≤ begun ≤ ended ≤ settled.
    std::size_t asked = 0, begun = 0, ended = 0, settled = 0;
    double asked_at = 0, ended_at = 0;  // [s]

    bool completed() const { return end == ShiftEnd::completed; }
    double duration() const { return ended_at - asked_at; }  // [s]
    std::string label() const { return from + "->" + to; }   // "F2->F3", as scenarios write it
};

// In the order of time. Empty where the machine has no gear paths or the run lacks clutch states. Throws io::InputError
// where more clutches select gears than can be told apart (256).
std::vector<Shift> find_shifts(const Run& run, const ShiftRules& rules = {});

// The signals that shifts and their metrics are read from, as far as the machine has them: what a run has to
// hold to be judged.
std::vector<std::string> scorecard_signals(const plant::Description& machine);

}  // namespace shiftrig::analysis
