// One step of the plant. [Algin] Fig. 10, with the state changes of eq. (12), (13) found inside the step.
#include <algorithm>
#include <cmath>
#include <limits>

#include "plant/ark3.h"
#include "plant/contact_table.h"
#include "plant/etd3.h"
#include "plant/few.h"
#include "plant/finish.h"
#include "plant/flanks.h"
#include "plant/forces.h"
#include "plant/interpolant.h"
#include "plant/ledger.h"
#include "plant/refinement.h"
#include "plant/telling.h"
#include "plant/transitions.h"

namespace shiftrig::plant {
namespace {

using namespace detail;

constexpr double instant = 1e-10;  // parts of a step shorter than this are none

// Where the part beginning at `from` must end at the latest: laws jump there.
double next_split(const Work& w, double from) SHIFTRIG_REALTIME {
    double split = 1;
    const auto consider = [&](double fraction, double tolerance = 1e-9) {
        if (fraction > from + tolerance && fraction < split - tolerance) split = fraction;
    };
    const ScratchData& scratch = w.scratch;
    for (int i = 0; i < scratch.moving_count; ++i) {
        const int pair = scratch.moving[static_cast<std::size_t>(i)];
        consider(scratch.loads[static_cast<std::size_t>(pair)].hydraulic.filled_from);
    }
    const std::vector<double>& times = w.model.breakpoints;
    const auto first = std::upper_bound(times.begin(), times.end(), w.start + from * w.h);
    for (auto time = first; time != times.end() && *time < w.start + w.h; ++time)
        consider((*time - w.start) / w.h, time_rounding(*time) / w.h);
    for (int i = 0; i < scratch.moving_count; ++i) {
        consider(load_edge(w, scratch.moving[static_cast<std::size_t>(i)], from, split));
    }
    return split;
}

// On a grid of parts of the step, so that parts that events do not cut are all of the same length.
double part_end(double from, double split, double length) {
    return std::min(split, (std::floor(from / length + 1e-6) + 1) * length);
}

// Brings the beginning of the step to rest in itself. The end of a step that changed nothing is so already, or else it is not
// carried over (finish_step).
Mode& begin_mode(Work& w) SHIFTRIG_REALTIME {
    ScratchData& s = w.scratch;
    const bool begun = is_begun(w);
    const bool settled = begun && s.moving_count == 0;
    Mode& mode = settled ? find_mode(w.model, w.operators, w.contact, s) : settle(w, s.begin(), begun);
    // What it takes to find nothing to do is not counted: it depends on whether the last step is remembered.
    if (same_states(w.contact, s.before.data(), w.model.contact_bytes))
        w.outputs.certificate.mode_lookups = 1;
    return mode;
}

// The engine for long chains, or the one for everything else.
void integrate(Work& w, const Mode& mode, double end_fraction) SHIFTRIG_REALTIME {
    if (mode.tree) {
        advance_tree(w, mode, end_fraction);
    } else {
        advance(w, mode, end_fraction);
    }
}

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
// change much about that place, shafts that swing within the step). Returns the fraction reached; `end` is there.
double approach(Work& w, const Mode& mode, const Crossing& crossing, double done,
                double until) SHIFTRIG_REALTIME {
    constexpr int most_steps = 4;
    const auto left = [&](Sample& sample) { return crossing_margin(w, mode, crossing, sample); };
    RootSearch search{done, until, left(w.scratch.begin()), left(w.scratch.end()),
                      done + crossing.theta * (until - done)};
    // Of the margins at both ends. A mesh that turns or goes acts by itself once that lies behind: go a little
    // beyond. So too with a pair that lets go at next to no torque: this side of it, it would only lock again.
    const bool by_itself = acts_by_itself(crossing.change), overrun = crossing.change == Change::overrun;
    const double close_enough = (by_itself ? 1e-2 : overrun ? 1e-3 : 1e-6) * search.size();
    const double beyond = (by_itself ? 3e-3 : overrun ? 3e-4 : 0) * (until - done);
    if (!mode.tree) look_ahead(w, mode, search, 1e-7 * search.size(), left);
    search.place = std::min(search.place + beyond, until);
    for (int steps = 1;; ++steps) {
        const double reached = search.place;
        integrate(w, mode, reached);
        const double rest = left(w.scratch.end());
        if (std::fabs(rest) <= close_enough || steps == most_steps) return reached;
        search.tell(rest, beyond);
    }
}

// The same for a flank, whose new state only holds behind the crossing: as near behind it as rounding lets nobody mind. A
// damped flank begins with a jump of its torque, and contacts follow one another by hundreds: an instant that is late by
// δ costs 2ζωδ of the speed of each. Newton's method, kept in the bracket, aims at the middle of what is near enough.
double approach_flank(Work& w, const Mode& mode, const Crossing& crossing, double done,
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
        if (rest <= 0 && rest >= -close_enough) return reached;
        (rest > 0 ? low : high) = reached;
        sample_rate(w, mode, end);
        const double newton = reached - (rest + 0.5 * close_enough) / (margin_rate(w, flank, end) * w.h);
        reached = newton > low && newton < high ? newton : 0.5 * (low + high);
    }
    integrate(w, mode, high);
    return high;
}

// Does the device change where the part begins? What a mesh does by itself it does only beyond its limit: there is always a
// little way to go. So it is to a flank that was let go just now and comes back within the part, which the parabola
// through its margins takes for the beginning.
bool changes_at_once(const Work& w, const Crossing& crossing, double length) SHIFTRIG_REALTIME {
    if (acts_by_itself(crossing.change) || crossing.theta * length >= instant) return false;
    return crossing.change != Change::flank || length <= 2 * instant ||
           flank_margin(w, backlash_of(w, crossing.device), w.scratch.begin()) <= 0;
}

double approach_any(Work& w, const Mode& mode, const Crossing& crossing, double done,
                    double until) SHIFTRIG_REALTIME {
    return crossing.change == Change::flank ? approach_flank(w, mode, crossing, done, until)
                                            : approach(w, mode, crossing, done, until);
}

}  // namespace

void step(const Model& model, Operators& operators, State& state, const Inputs& inputs, Outputs& outputs,
          Scratch& scratch) SHIFTRIG_REALTIME {
    const ModelData& m = model.data();
    ScratchData& s = scratch.data();
    Work w = begin_step(m, operators.data(), state, outputs, s);
    const bool localise = m.description.transition == Transition::localised;

    // Commands as they act; valves, pistons and pedals over the whole step.
    latch_inputs(w, inputs);
    advance_actuation(w);

    // Torque capacities, external torques, internal torques, power-flow directions, internal torques with
    // losses ([Algin] eq. (11), (14), (15), (16)–(25)); what cannot hold at t0+ opens (eq. (12)).
    Mode* mode = &begin_mode(w);
    if (read_integer(w.state) == 0) tell_resting(w, *mode, s.begin());

    double length = 1;             // of a part, at most
    int leans = m.maximum_events;  // loads that pass from pair to mesh at rest: not events, but bounded too
    int dips = m.maximum_events;   // margins looked at where they are least
    const bool divides = localise && m.maximum_parts > 1;
    const double halvable = (2 - 1e-9) / m.maximum_parts;  // a part of this length
    for (double done = 0; done < 1;) {
        // Advance over what is left, up to the next jump of a law; in halves where that is too much at once.
        const double split = next_split(w, done);
        double until = part_end(done, split, length);
        integrate(w, *mode, until);
        while (divides && (is_coarse(w, *mode) || hides_contact(w))) {
            if (length < halvable) {
                outputs.certificate.flags |= 8;
                break;
            }
            length *= 0.5;
            until = part_end(done, split, length);
            integrate(w, *mode, until);
        }
        if (localise && dips > 0) {
            const double theta = std::min(first_dip(w, *mode), first_knot(w));
            if (theta < 1) {
                --dips;
                until = done + theta * (until - done);
                integrate(w, *mode, until);
            }
        }

        // Contact-state changes: the first device whose state does not hold until the end (eq. (12), (13)).
        Crossing first = first_crossing(w, *mode, s.begin(), s.end());
        const bool inside =
            first.device >= 0 && localise && outputs.certificate.events * length < m.maximum_events;
        double reached = until;
        if (inside && changes_at_once(w, first, until - done)) {
            reached = done;
        } else if (inside && first.theta < 1 - instant) {
            reached = approach_any(w, *mode, first, done, until);
            // An estimate that came too late passed over another change, which goes first; of flanks also what approach()
            // goes beyond the crossing, since the power of a mesh often turns in the instant that lets one go.
            for (int passed = 0; passed < 2; ++passed) {
                Crossing earlier = first_crossing(w, *mode, s.begin(), s.end());
                if (earlier.device == first.device || earlier.theta > 0.999)
                    earlier = first_flank(w, s.begin(), s.end());
                if (earlier.device < 0 || earlier.device == first.device) break;
                first = earlier;
                reached = approach_any(w, *mode, first, done, reached);
            }
        }

        // Energy ledger of the accepted part.
        if (reached > done) {
            book(w, *mode);
            mode = &correct_directions(w, *mode);
            accept(w);
            done = reached;
            s.carries = !s.turned;
        }

        // The new state acts from here on; where events are used up, or by choice, from the next step on.
        if (inside) {
            const bool moves = acts_by_itself(first.change) ? first.change != Change::limit
                                                            : change_state(w, first.device, s.begin());
            if (moves || --leans < 0) ++outputs.certificate.events;
        } else if (first.device >= 0 && first.change != Change::turn && first.change != Change::limit) {
            if (!acts_by_itself(first.change)) change_all(w, *mode, s.begin());
            if (localise) {
                ++outputs.certificate.fall_backs;
                log_event(w, {.time = s.begin().at.time,
                              .kind = EventKind::fall_back,
                              .device = device_index(first.device)});
            }
        }
        if (done < 1 || first.device >= 0) {
            mode = &settle(w, s.begin());
            s.carries = false;
        }
    }
    finish_step(w, *mode);
}

void observe(const Model& model, Operators& operators, const State& state, const Inputs& inputs,
             Outputs& outputs, Scratch& scratch) SHIFTRIG_REALTIME {
    Work w = begin_look(model.data(), operators.data(), state, outputs, scratch.data());
    latch_inputs(w, inputs);
    hold_actuation(w);
    const Mode& mode = settle(w, w.scratch.begin());
    finish_look(w, mode);
}

}  // namespace shiftrig::plant
