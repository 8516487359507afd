#include "plant/standstill.h"

#include <algorithm>
#include <cmath>

#include "plant/devices.h"
#include "plant/rest_problem.h"
#include "plant/settling.h"
#include "plant/stuck_meshes.h"
#include "plant/telling.h"
#include "plant/transitions.h"

namespace shiftrig::plant::detail {
namespace {

constexpr unsigned char closed = locked;  // and stuck
constexpr double resting = 1e-10;         // share of the accelerations there could be: none, but for rounding

// Has it broken away, in this instant or before, where others held it at no slip?
bool is_overcome(const Work& w, int pair) {
    return w.scratch.overcome[static_cast<std::size_t>(pair)] != 0 || slips(w.contact[pair]);
}

// Torque limits of a pair: what it can hold, or, once it broke away, what it passes on sliding.
void set_limits(const Work& w, const Sample& s, RestJoint& joint) {
    const int k = joint.device;
    const bool overcome = is_overcome(w, k);
    const auto limit = [&](double sense) {
        const double sliding = sliding_limit(w.model, k, sense, s);
        return overcome ? sliding : std::max(static_limit(w.model, k, sense, s), sliding);
    };
    joint.upper = limit(1);
    joint.lower = -limit(-1);
}

// Are these contact states a solution for the piece as well, with torques as their mode shares them out? Where nothing goes,
// no pair may open that the others do not hold. Turns loss directions on the way.
bool is_consistent(Work& w, const Piece& piece, unsigned char* contact, bool goes, Sample& s) {
    const ModelData& m = w.model;
    contact_forces(w, contact, s);
    const auto [mode, agrees] = try_directions(w, contact, s);
    if (mode.tree && !agrees) return false;  // see lean_on_losses()
    if (is_overloaded(w, most_used(w, contact, s, piece).pair, s) || loses_too_much(w, mode, s, piece))
        return false;
    sample_rate(w, mode, s);
    for (int k = 0; k < m.first_flank; ++k) {
        const unsigned char state = contact[k];
        const bool open = k < m.pairs ? slips(state) : state != stuck && mesh_of(w, k - m.pairs).lossy();
        if (!open || mode.bound[k] || !piece.holds(k) || !is_still(w, mode, k, s)) continue;
        if (!goes && k < m.pairs && w.contact[k] == locked) return false;
        const double sign = k < m.pairs ? slip_sign(state) : motion_sign(state);
        if (sign * device_slip(w, k, s.rate) < -1e-9 * slip_scale(w, k, s.rate)) return false;
    }
    return true;
}

// The search for contact states; those it tries are in scratch.trial.
struct Search {
    Work& w;
    const Mode& mode;
    Sample& s;
    int gives_way;
    double given;  // its torque
    RestProblem rest;
    bool goes = false;                       // does anything?
    bool leans = false;                      // nothing does, by what meshes can lose
    unsigned char vertex[most_joints] = {};  // the joints' states in the exact solution,
    bool going[most_joints] = {};            // does it go?
    bool given_way[most_joints] = {};        // taken to have broken away
    double carried[most_joints] = {};        // torques before anything gives way,
    double use[most_joints] = {};            // as shares of the static limits

    unsigned char& overcome(int device) const { return w.scratch.overcome[static_cast<std::size_t>(device)]; }
    unsigned char& eased(int device) const { return w.scratch.eased[static_cast<std::size_t>(device)]; }
    // Would the pair hold more than it passes once it slips in this sense?
    bool has_reserve(int device, double sense) const {
        if (device >= w.model.pairs || is_overcome(w, device)) return false;
        return sliding_limit(w.model, device, sense, s) < static_limit(w.model, device, sense, s);
    }
    void break_away(int i) {
        given_way[i] = true;
        overcome(rest.joints[i].device) = 1;
    }
    void forget() {
        for (int i = 0; i < rest.count; ++i) {
            const int device = rest.joints[i].device;
            if (given_way[i]) overcome(device) = 0;
            if (device < w.model.pairs) eased(device) = 0;
        }
    }

    bool solve(Split split) {
        for (int i = 0; i < rest.count; ++i) {
            RestJoint& joint = rest.joints[i];
            if (joint.mesh < 0) set_limits(w, s, joint);
            if (joint.device != gives_way) continue;
            const double limit = given * (1 - at_its_limit);
            if (limit > 0) joint.upper = std::min(joint.upper, limit);
            if (limit < 0) joint.lower = std::max(joint.lower, limit);
        }
        return solve_rest_problem(split, rest);
    }

    // A pair that can pass nothing yet is at both its limits: the sense is that in which it was torn loose.
    unsigned char state_at(int i, int side) const {
        const RestJoint& joint = rest.joints[i];
        if (joint.mesh >= 0 || side == 0 || joint.upper != joint.lower) return state_of(rest, i, side);
        const unsigned char was = w.contact[joint.device];
        return slips(was) ? was : slipping(opening_sense(w, joint.device, carried[i], s));
    }

    // Of the slips, if nothing held them, the one that would grow most, in proportion: backward?
    bool leans_backward() const {
        double most = 0;
        for (int i = 0; i < rest.count; ++i) {
            const double share = rest.b[i] / rest.joints[i].scale;
            if (std::fabs(share) > std::fabs(most)) most = share;
        }
        return most < 0;
    }
    // In a corner that many splits share the exact problem may lead nowhere; that little give does not matter then.
    bool solve_exactly(bool mirrored) {
        rest.mirrored = mirrored;
        if (!solve(Split::any) && !solve(Split::as_modes)) return false;
        goes = false;
        for (int i = 0; i < rest.count; ++i) {
            double share;
            const int side = side_of(rest, i, share);
            vertex[i] = state_at(i, side);
            going[i] = share > resting;
            goes = goes || going[i];
        }
        return true;
    }
    // Where large losses make rest and motion both a solution, which one is found hangs on signs and order. What may rest rests.
    bool solve_exactly() {
        const bool backward = leans_backward();
        leans = false;
        if (rest.bends > 0 && solve_exactly(!backward) && !goes) return true;
        const bool solved = solve_exactly(backward);
        if ((solved && !goes) || !find_rest(rest)) return solved;
        leans = true;
        goes = false;
        for (int i = 0; i < rest.count; ++i) {
            vertex[i] = state_at(i, side_at_rest(rest, i));
            going[i] = false;
        }
        return true;
    }

    template <typename StateOf>
    bool attempt(const StateOf& state) {
        unsigned char* const trial = w.scratch.trial.data();
        std::copy(w.contact, w.contact + w.model.contact_bytes, trial);
        for (int i = 0; i < rest.count; ++i) {
            const int device = rest.joints[i].device;
            trial[device] = state(i);
            if (device < w.model.pairs) eased(device) = slips(w.contact[device]) && trial[device] == closed;
        }
        if (!is_consistent(w, rest.piece, trial, goes, s)) return false;
        // States that leave the one at its limit there, closed, are no answer.
        return gives_way < 0 || trial[gives_way] != closed ||
               opening_sense(w, gives_way, given, s) * (s.torque[gives_way] - given) <
                   -0.5 * at_its_limit * std::fabs(given);
    }
    // As few changes as do, so that torques that are not unique stay nearly what they were.
    bool attempt_least() {
        return attempt([&](int i) {
            const int device = rest.joints[i].device;
            if (going[i] || (goes && device == gives_way)) return vertex[i];
            if (device != gives_way) return w.contact[device];
            return slipping(opening_sense(w, device, given, s));
        });
    }
    // Meshes lose what keeps everything at rest.
    bool attempt_leaning() {
        if (!leans) return false;
        for (const bool holds : {true, false}) {
            if (attempt([&](int i) {
                    const int device = rest.joints[i].device;
                    if (rest.joints[i].mesh >= 0) return vertex[i];
                    if (device != gives_way) return w.contact[device];
                    return holds ? closed : slipping(opening_sense(w, device, given, s));
                }))
                return true;
        }
        return false;
    }
    // The one at its limit leaves the rest to one that pushed without holding anything so far, and could not hold its share.
    bool attempt_held() {
        if (goes || gives_way < 0) return false;
        for (int held = 0; held < rest.count; ++held) {
            const int pushes = rest.joints[held].device;
            if (rest.joints[held].mesh >= 0 || pushes == gives_way || !slips(w.contact[pushes])) continue;
            if (attempt([&](int i) {
                    const int device = rest.joints[i].device;
                    if (device == gives_way) return slipping(opening_sense(w, device, given, s));
                    return device == pushes ? closed : w.contact[device];
                }))
                return true;
        }
        return false;
    }
    // What does not go shares out its load; `gently`: and tears no other pair loose.
    bool attempt_shared(Split split, bool gently) {
        if (!solve(split)) return false;
        const auto state = [&](int i) {
            double share;
            return going[i] ? vertex[i] : state_at(i, side_of(rest, i, share));
        };
        for (int i = 0; gently && i < rest.count; ++i) {
            const RestJoint& joint = rest.joints[i];
            if (joint.mesh < 0 && joint.device != gives_way && w.contact[joint.device] == locked &&
                state(i) != closed)
                return false;
        }
        return attempt(state);
    }
    bool attempt_shared() {
        for (const bool gently : {true, false}) {
            if (gently && goes) continue;
            if (attempt_shared(Split::as_modes, gently) || attempt_shared(Split::on_losses, gently))
                return true;
        }
        return false;
    }
    int most_used_of_going() const {
        int most = -1;
        for (int i = 0; i < rest.count; ++i) {
            const RestJoint& joint = rest.joints[i];
            if (joint.mesh >= 0 || !going[i] || !has_reserve(joint.device, slip_sign(vertex[i]))) continue;
            if (most < 0 || use[i] > use[most]) most = i;
        }
        return most;
    }
    // Pairs at their limit as modes share the load break away if they pass less on sliding: the others have to do with
    // that. Did any?
    bool break_more_away() {
        bool breaks = false;
        if (!solve(Split::as_modes)) return false;
        for (int i = 0; i < rest.count; ++i) {
            const RestJoint& joint = rest.joints[i];
            double share;
            const int side = side_of(rest, i, share);
            if (going[i] || joint.mesh >= 0 || side == 0 || !has_reserve(joint.device, side)) continue;
            break_away(i);
            breaks = true;
        }
        return breaks;
    }

    bool find() {
        for (int i = 0; i < rest.count; ++i) {
            const int k = rest.joints[i].device;
            carried[i] = s.torque[k];
            if (rest.joints[i].mesh < 0) use[i] = std::fabs(carried[i]) / static_limit(w, k, s);
        }
        int giving = 0;
        while (giving < rest.count && rest.joints[giving].device != gives_way) ++giving;
        const bool breaks_away =
            giving < rest.count && has_reserve(gives_way, opening_sense(w, gives_way, given, s));
        // The one that is beyond its limit breaks away first, and passes less from then on; others may only take its
        // load where mechanics does not say how they share it.
        if (breaks_away && !(mode.bound[gives_way] & shares_load)) break_away(giving);
        for (;;) {
            if (!solve_exactly()) return false;
            if (goes && breaks_away && !overcome(gives_way)) {
                break_away(giving);
                continue;
            }
            // Of those that go, the one that uses most of what it holds breaks away, and leaves the others less.
            if (const int most = most_used_of_going(); most >= 0) {
                break_away(most);
                continue;
            }
            if (attempt_least() || attempt_leaning() || attempt_shared()) return true;
            if (break_more_away()) continue;
            if (!breaks_away || overcome(gives_way))
                return attempt_held() || attempt([&](int i) { return vertex[i]; });
            break_away(giving);  // it is at its limit whatever the split leaves it
        }
    }

    // Notes what was found: the one that gave way comes first, what follows from that after it.
    void note(const unsigned char* found) {
        // As it is before anything has broken away.
        LossAtRest* const losses = w.scratch.losses.data();
        MotionLosses of_motions(w, mode);
        for (const int k : w.model.lossy_meshes) {
            const int device = w.model.pairs + k;
            if (goes && w.contact[device] == stuck && found[device] != stuck) losses[k] = of_motions.of(k, s);
        }
        const Mode& then = find_mode(w.model, w.operators, found, w.scratch);
        if (gives_way >= 0) note(found, then, gives_way);
        for (int k = 0; k < w.model.first_flank; ++k) {
            if (k != gives_way) note(found, then, k);
        }
    }
    void note(const unsigned char* found, const Mode& then, int k) {
        const bool pair = k < w.model.pairs;
        const bool was = w.contact[k] == closed, is = found[k] == closed;
        if (was == is) return;
        if (!pair && then.bound[k]) return;  // others hold it: its loss has another share in that
        if (is) {
            note_closing(w, k, 0);
        } else if (pair) {
            note_opening(w, k, s);
            overcome(k) = 1;
        } else {
            note_release(w, k, w.scratch.losses[static_cast<std::size_t>(k - w.model.pairs)]);
        }
    }
};

}  // namespace

Rearrangement rearrange(Work& w, int gives_way, int around, Sample& s, bool among_losses) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    Search search{.w = w,
                  .mode = find_mode(m, w.operators, w.contact, w.scratch),
                  .s = s,
                  .gives_way = gives_way,
                  .given = gives_way < 0 ? 0 : s.torque[gives_way],
                  .rest = {}};
    if (!pose_rest_problem(w, search.mode, around, s, search.rest)) return Rearrangement::none;
    const bool found = search.find();
    contact_forces(w, w.contact, s);
    internal_torques(w, find_mode(m, w.operators, w.contact, w.scratch), s);
    // Meshes of one motion that share their losses in another way are no change, unless they relieve a pair; when they go,
    // release_drive() says.
    const unsigned char* const trial = w.scratch.trial.data();
    const int relevant = search.goes || gives_way >= 0 || among_losses ? m.contact_bytes : m.pairs;
    if (!found || std::equal(trial, trial + relevant, w.contact)) {
        search.forget();
        return Rearrangement::none;
    }
    unsigned char* const states = w.scratch.found.data();  // to find what losses there are it tries again
    std::copy(trial, trial + m.contact_bytes, states);
    search.note(states);
    std::copy(states, states + m.contact_bytes, w.contact);
    contact_forces(w, w.contact, s);
    return search.goes ? Rearrangement::moves : Rearrangement::stands;
}

}  // namespace shiftrig::plant::detail
