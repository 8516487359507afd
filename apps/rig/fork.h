// Many runs from one snapshot, each with something varied, judged by the scorecard and ranked. In memory and on all
// processors; a branch depends on the snapshot, its values and nothing else, so the ranking is the same every time.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "analysis/scorecard.h"
#include "apps/rig/rig.h"
#include "apps/rig/variation.h"
#include "io/recording/manifest.h"

namespace shiftrig::rig {

struct Branch {
    std::int64_t number = 0;
    std::vector<double> values;  // by variation, as written (factors where relative)
    bool shifted = false;        // a shift was found
    bool completed = false;
    analysis::Verdict verdict = analysis::Verdict::reject;
    double burden = 0;  // mean of metric / its reject limit over the judged metrics: less is better
    std::vector<analysis::Metric> metrics;
    bool refused = false;  // could not begin: the model or the calibration does not take a varied value
    std::string error;     // why it was refused, or that its state was not finite; empty: it ran
};

struct ForkOptions {
    double duration = 1.5;  // [s]
    int threads = 0;        // 0: as many as there are processors
};

// Best first: those that ran, completed, then verdict, then burden, then number. `done` counts finished branches. Throws InputError
// if a name cannot be varied, or a signal not to these values.
std::vector<Branch> fork(const io::Manifest& snapshot, const Plan& plan, const ForkOptions& options,
                         std::atomic<std::int64_t>& done);

}  // namespace shiftrig::rig
