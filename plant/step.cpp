// One step of the plant. [Algin] Fig. 10, with the state changes of eq. (12), (13) found inside the step.
#include <algorithm>
#include <cmath>

#include "plant/approach.h"
#include "plant/contact_table.h"
#include "plant/few.h"
#include "plant/finish.h"
#include "plant/forces.h"
#include "plant/integrate.h"
#include "plant/ledger.h"
#include "plant/refinement.h"
#include "plant/telling.h"
#include "plant/transitions.h"

namespace shiftrig::plant {
namespace {

using namespace detail;

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

    if (read_integer(w.state) == 0) tell_instant(w, *mode, s.begin());  // what rests

    double length = 1;             // of a part, at most
    int leans = m.maximum_events;  // loads that pass from pair to mesh at rest: not events, but bounded too
    int dips = m.maximum_events;   // margins looked at where they are least
    int knots = m.maximum_events;  // of laws, met
    const bool divides = localise && m.maximum_parts > 1;
    const double halvable = (2 - 1e-9) / m.maximum_parts;  // a part at least so long may still be halved
    for (double done = 0; done < 1;) {
        // Advance over what is left, up to the next jump of a law; in halves where that is too much at once.
        const double split = next_split(w, done);
        double until = part_end(done, split, length);
        if (!is_ready(*mode)) make_ready(m, *mode, s);
        integrate(w, *mode, until);
        while (divides && (is_coarse(w, *mode) || hides_contact(w))) {
            if (length < halvable) {
                if (is_coarse(w, *mode, true) || hides_contact(w))
                    outputs.certificate.flags |= Certificate::coarse;
                break;
            }
            length *= 0.5;
            until = part_end(done, split, length);
            integrate(w, *mode, until);
        }
        if (localise) {
            const double dip = dips > 0 ? first_dip(w, *mode) : 1, knot = knots > 0 ? first_knot(w) : 1;
            const double theta = std::min(dip, knot);
            if (theta < 1) {
                --(dip < knot ? dips : knots);
                until = done + theta * (until - done);
                integrate(w, *mode, until);
            }
        }

        // Contact-state changes: the first device whose state does not hold until the end (eq. (12), (13)).
        // K changes in a step taken whole, in one of parts of `length` K/length.
        const bool locates = localise && outputs.certificate.events * length < m.maximum_events;
        Crossing first = first_crossing(w, *mode, s.begin(), s.end(), locates);
        const bool inside = locates && first.device >= 0;
        double reached = until;
        if (inside && changes_at_once(w, first, until - done)) {
            reached = done;
            look_onward(w, first.device);
        } else if (inside && first.theta < 1 - instant) {
            Approached place = approach(w, *mode, first, done, until);
            // An estimate that came too late passed over another change, which goes first; of flanks also what approach()
            // goes beyond the crossing, since the power of a mesh often turns in the instant that lets one go.
            for (int passed = 0; passed < 2; ++passed) {
                Crossing earlier = first_crossing(w, *mode, s.begin(), s.end());
                if (earlier.device == first.device || earlier.theta > 0.999)
                    earlier = first_flank(w, s.begin(), s.end());
                if (earlier.device < 0 || earlier.device == first.device) break;
                first = earlier;
                place = approach(w, *mode, first, done, place.fraction);
            }
            // Where the instant is not found, or forces change too much on the way there, a shorter part knows better.
            if (divides && length >= halvable && (!place.found || is_coarse(w, *mode))) {
                length *= 0.5;
                continue;
            }
            if (!place.found) outputs.certificate.flags |= Certificate::instant_lost;
            reached = place.fraction;
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
        } else if (first.device >= 0 && is_event(first.change)) {
            change_all(w, *mode, s.begin());
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
