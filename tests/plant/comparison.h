// One random system on plant::step and on the reference solver, and what each signal says about it.
#pragma once

#include <string>
#include <vector>

#include "tests/plant/random_systems.h"
#include "tests/plant/reference/solver.h"

namespace shiftrig {

struct ComparisonOptions {
    double seconds = 0.2;
    int steps_per_sample = 1;    // plant steps per millisecond
    double tolerance = 1e-4;     // of a signal's range
    double range_floor = 1e-3;   // a range counts as at least this share of the largest of its unit
    double rounding = 1e-9;      // of the largest value of a unit: no solution of a linear system is better
    double perturbation = 1e-9;  // relative, on speeds, twists in play, capacities and torques
    int refinement = 4;          // of the reference's step, where the runs differ
    unsigned perturbations = 4;  // choices of its signs, where the runs differ
    bool quick = false;          // perturb only where the runs differ
    double event_clearance =
        2e-5;  // torques jump with contact states: samples nearer to a change are left out [s]
};

enum class Outcome {
    agrees,
    sensitive,         // the reference itself moves more than the tolerance under the perturbation
    ambiguous,         // the reference itself depends on how devices at rest are assumed to share their load
    reference_failed,  // no consistent mode, or chatter without end: nothing to compare with
    disagrees,
    broken,  // an invariant of the plant does not hold: not finite, constraint, momentum, ledger, determinism
};
const char* name(Outcome outcome);

struct Comparison {
    Outcome outcome = Outcome::agrees;
    double worst = 0;        // largest difference in units of the tolerance
    double worst_speed = 0;  // the same over speeds and twists only
    std::string worst_signal;
    double worst_time = 0;                    // [s]
    double worst_truth = 0, worst_value = 0;  // of the reference, of the plant
    std::vector<std::string> broken;          // invariants that do not hold, with numbers
    int fall_backs = 0, events = 0;
    int coarse = 0, lost = 0;      // steps with bit 3, bit 4 of certificate.flags
    double energy_defect = 0;      // worst |defect| over the energy moved
    double seconds_reference = 0;  // compute time
};

// Largest |a − b| in units of the tolerance, over speeds and twists (and torques where both are unique).
struct Deviation {
    double worst = 0, worst_speed = 0;
    std::string signal;
    double time = 0, truth = 0, value = 0;
};
Deviation deviation(const plant::Description& description, const reference::Result& truth,
                    const reference::Result& other, const ComparisonOptions& options);

using Inputs = std::vector<reference::InputChange>;
reference::Result run_reference(const plant::Description& description, const ComparisonOptions& options,
                                reference::Sharing sharing = reference::Sharing::free, int refinement = 1,
                                const Inputs& inputs = {});
plant::Description perturbed(plant::Description description, double relative, std::uint64_t seed);

Comparison compare(const RandomSystem& system, std::uint64_t seed, const ComparisonOptions& options);

// The description as text, for a finding.
std::string describe(const plant::Description& description);

// The changes of state of both runs up to `until` [s], one after the other, in words.
std::string timelines(const RandomSystem& system, const ComparisonOptions& options, double until);

}  // namespace shiftrig
