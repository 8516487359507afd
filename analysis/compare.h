// Two result sets side by side: which shift of which run got worse or better, in what, and by how much.
//
// Shifts are matched by run, label and order (the second F2->F3 of a run with the second); where both sets hold a single run, the
// runs are matched whatever their names. Where one of the two has null in place of a run, nothing is said of it (result_set.h).
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "analysis/limits.h"

namespace shiftrig::analysis {

struct Tolerance {
    double relative = 0.02;  // of the value before, or of a tenth of the limit for `good` if that is more
};

struct Difference {
    enum class Kind { worse, better, missing, added };
    Kind kind{};
    std::string run, shift;  // "plough_upshift", "F2->F3"
    std::string metric;      // full name; "completed" where completion changed; empty: the shift as a whole
    double before = 0, after = 0;  // NaN: no value
    std::string text() const;      // `plough_upshift F2->F3: duration_s 0.412 → 0.471 (+14.3 %), worse`
};

// What differs by more than the tolerance, in completion and in every metric that has a limit and that one of the
// shifts has (for all of them less is better). A clutch that one of them does not tell took no heat and did not slip
// there; a value that is lost is worse. Worse first.
std::vector<Difference> compare(const nlohmann::json& before, const nlohmann::json& after,
                                const Limits& limits, const Tolerance& tolerance = {});

}  // namespace shiftrig::analysis
