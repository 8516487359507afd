#include "plant/approach.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "plant/devices.h"
#include "plant/flanks.h"
#include "plant/integrate.h"
#include "plant/interpolant.h"

namespace shiftrig::plant::detail {
namespace {

// Looks for the place where a margin vanishes that is positive at `low` and negative at `high`.
struct RootSearch {
    double low, high;
    double at_low, at_high;
    double place;      // looked at next
    double slope = 0;  // between the last two places; 0: not known
    double last = std::numeric_limits<double>::quiet_NaN(), at_last = 0;

    double size() const { return std::fabs(at_low) + std::fabs(at_high); }
    // The margin at that place; goes on to the one that follows from it by the slope, and so much beyond, or else to the
    // middle of the bracket.
    void tell(double margin, double beyond = 0) {
        if (std::fabs(place - last) > 0) {
            slope = (margin - at_last) / (place - last);
        } else if (slope == 0 && at_low > 1e-12 * size()) {
            slope = (margin - at_low) / (place - low);
        }
        last = place;
        at_last = margin;
        (margin > 0 ? low : high) = place;
        (margin > 0 ? at_low : at_high) = margin;
        place = last - at_last / slope + beyond;
        if (!(slope < 0 && place > low + instant && place < high)) place = 0.5 * (low + high);
    }
};

// Goes to where the margin vanishes on the interpolant of the part just computed, which is nearly as good as a step there,
// and takes its slope.
template <typename Margin>
void look_ahead(Work& w, const Mode& mode, RootSearch& search, double close_enough,
                const Margin& margin) SHIFTRIG_REALTIME {
    constexpr int most_looks = 8;
    const double from = search.low, length = search.high - search.low;
    const Interpolant part = interpolate_part(w, mode);
    RootSearch looks = search;
    for (int k = 0; k < most_looks; ++k) {
        search.place = looks.place;
        sample_within(w, mode, part, (looks.place - from) / length, w.scratch.middle);
        const double rest = margin(w.scratch.middle);
        looks.tell(rest);
        if (std::fabs(rest) <= close_enough) break;
    }
    search.slope = looks.slope;
}

// Partial steps to where the device's margin vanishes: one as a rule, more where the interpolant errs (forces that
// change much about that place, shafts that swing within the step). A step that may be divided had better be, then.
Approached approach_margin(Work& w, const Mode& mode, const Crossing& crossing, double done,
                           double until) SHIFTRIG_REALTIME {
    const int most_steps = w.model.maximum_parts > 1 ? 4 : 16;
    // A pair that holds no more than it passes on sliding would slip backwards if it gave way below its limit. It is gone beyond by
    // more than rounding, and less than makes it overloaded (devices.h).
    const bool gives_way = crossing.change == Change::state && crossing.device < w.model.pairs &&
                           w.contact[crossing.device] == locked;
    const double over = gives_way ? 3e-10 * static_limit(w, crossing.device, w.scratch.end()) : 0;
    const auto left = [&](Sample& sample) { return crossing_margin(w, mode, crossing, sample) + over; };
    RootSearch search{done, until, left(w.scratch.begin()), left(w.scratch.end()),
                      done + crossing.theta * (until - done)};
    // A mesh that turns or goes changes by itself once the crossing lies behind: go a little beyond. So too with a pair that lets go
    // in its weak sense, or comes to hold its share: this side of it, it would only lock, or let go, again. `close_enough` is a
    // share of the margins at both ends together.
    const bool by_itself = acts_by_itself(crossing.change),
               safely = crossing.change == Change::overrun || crossing.change == Change::hold;
    const double close_enough = (by_itself ? 1e-2 : safely ? 1e-3 : 1e-6) * search.size();
    const double beyond = (by_itself ? 3e-3 : safely ? 3e-4 : 0) * (until - done);
    if (!mode.tree) look_ahead(w, mode, search, (gives_way ? 1e-10 : 1e-7) * search.size(), left);
    search.place = std::min(search.place + beyond, until);
    for (int steps = 1;; ++steps) {
        const double reached = search.place;
        integrate(w, mode, reached);
        const double rest = left(w.scratch.end());
        const bool near = std::fabs(rest) <= close_enough, last = steps == most_steps,
                   beyond_it = rest <= 0.9 * over || !(gives_way || crossing.change == Change::hold);
        if (near && beyond_it) return {reached};
        if (last && crossing.change != Change::hold) return {reached, near && beyond_it};
        search.tell(rest, beyond);
        if (steps < most_steps) continue;
        // What holds a little later moves nothing: others bear the difference so long.
        integrate(w, mode, search.high);
        return {search.high};
    }
}

// The same for a flank, whose new state only holds behind the crossing: as near behind it as rounding lets nobody mind. A
// damped flank begins with a jump of its torque, and contacts follow one another by hundreds: an instant that is late by
// δ costs 2ζωδ of the speed of each. Newton's method, kept in the bracket, aims at the middle of what is near enough.
Approached approach_flank(Work& w, const Mode& mode, const Crossing& crossing, double done,
                          double until) SHIFTRIG_REALTIME {
    constexpr int most_steps = 12;
    const Sample& begin = w.scratch.begin();
    Sample& end = w.scratch.end();
    const Flank flank = violated_flank(w, backlash_of(w, crossing.device), end);
    const auto left = [&](const Sample& sample) { return margin_of(w, flank, sample); };
    const double size = left(begin) - left(end);
    const double close_enough = std::max(1e-9 * size, flank_rounding(flank.law));
    RootSearch search{done, until, left(begin), left(end),
                      std::min(until, done + std::max(crossing.theta * (until - done), instant))};
    look_ahead(w, mode, search, close_enough, left);
    double low = done, high = until, reached = search.place;
    for (int steps = 1; steps < most_steps; ++steps) {
        integrate(w, mode, reached);
        const double rest = left(end);
        if (rest <= 0 && rest >= -close_enough) return {reached};
        (rest > 0 ? low : high) = reached;
        sample_rate(w, mode, end);
        const double newton = reached - (rest + 0.5 * close_enough) / (margin_rate(w, flank, end) * w.h);
        reached = newton > low && newton < high ? newton : 0.5 * (low + high);
    }
    integrate(w, mode, high);
    return {high};
}

}  // namespace

// What a mesh does by itself it does only beyond its limit: there is always a
// little way to go. So it is to a flank that was let go just now and comes back within the part, which the parabola
// through its margins takes for the beginning.
bool changes_at_once(const Work& w, const Crossing& crossing, double length) SHIFTRIG_REALTIME {
    if (acts_by_itself(crossing.change) || crossing.theta * length >= instant) return false;
    return crossing.change != Change::flank || length <= 2 * instant ||
           flank_margin(w, backlash_of(w, crossing.device), w.scratch.begin()) <= 0;
}

Approached approach(Work& w, const Mode& mode, const Crossing& crossing, double done,
                    double until) SHIFTRIG_REALTIME {
    return crossing.change == Change::flank ? approach_flank(w, mode, crossing, done, until)
                                            : approach_margin(w, mode, crossing, done, until);
}

}  // namespace shiftrig::plant::detail
