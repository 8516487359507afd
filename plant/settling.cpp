// Contact states and loss directions in agreement with an instant.
#include "plant/settling.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "plant/rest_problem.h"
#include "plant/standstill.h"
#include "plant/stuck_meshes.h"
#include "plant/telling.h"

namespace shiftrig::plant::detail {
namespace {

// Pairs by their capacity: none is free, some engages. [Algin]: a change of λ by pressure.
bool engage_and_release(Work& w, Sample& s) {
    const ModelData& m = w.model;
    bool changed = false;
    for (int k = 0; k < m.pairs; ++k) {
        const bool capable = s.sliding[k] > 0 || s.holding[k] > 0 || is_pressed(w, k, s.at);
        if (capable != (w.contact[k] == free_running)) continue;
        changed = true;
        note_pressing(w, k);
        if (!capable) {
            w.contact[k] = free_running;
            continue;
        }
        const double slip = slip_of(pair_links(w, k), s.z);
        if (std::fabs(slip) > at_rest) {
            w.contact[k] = slipping(slip);
        } else {
            change_state(w, k, s);
        }
    }
    if (changed) contact_forces(w, w.contact, s);
    return changed;
}

// A pair that passes nothing yet moves nobody: it goes the way that the others take it.
void follow_others(Work& w, const Mode& mode, Sample& s) {
    bool rates_known = false;
    for (int k = 0; k < w.model.pairs; ++k) {
        if (!slips(w.contact[k]) || mode.bound[k] || s.sliding[k] > 0) continue;
        if (std::fabs(device_slip(w, k, s.z)) > at_rest) continue;
        if (!rates_known) sample_rate(w, mode, s);
        rates_known = true;
        const double rate = device_slip(w, k, s.rate);
        if (std::fabs(rate) > 1e-9 * slip_scale(w, k, s.rate)) w.contact[k] = slipping(rate);
    }
}

}  // namespace

Mode& find_directions(Work& w, unsigned char* contact, Sample& s, bool complete) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    const int most = 2 * m.meshes + 2;
    for (int flips = 0;; ++flips) {
        Mode& mode = find_mode(m, w.operators, contact, w.scratch);
        ++w.outputs.certificate.mode_lookups;
        if (!complete) internal_torques(w, mode, s);
        complete = false;
        int worst = -1;
        double largest = -1;  // 1e-9 of the torque scale, once somebody asks
        for (int k = 0; k < m.meshes; ++k) {
            const unsigned char state = contact[m.pairs + k];
            if (state == stuck || !m.lossy[static_cast<std::size_t>(k)]) continue;
            const double sign = motion_sign(state);
            const double torque = s.torque[m.pairs + k] - loss_kink(w, k, sign);
            const int x = torque * sign < 0 ? -1 : 1;
            if (x == loss_exponent(state)) continue;
            if (largest < 0) largest = 1e-9 * torque_scale(w, s);
            if (std::fabs(torque) > largest) {
                largest = std::fabs(torque);
                worst = k;
            }
        }
        if (worst < 0) return mode;
        if (flips >= most) {
            w.outputs.certificate.flags |= Certificate::no_agreement;
            return mode;
        }
        contact[m.pairs + worst] ^= driven;
        contact_forces(w, contact, s);
    }
}

Tried try_directions(Work& w, unsigned char* contact, Sample& s) SHIFTRIG_REALTIME {
    int& flags = w.outputs.certificate.flags;
    const int kept = std::exchange(flags, 0);
    Mode& mode = find_directions(w, contact, s);
    const bool agrees = (flags & Certificate::no_agreement) == 0;
    flags = kept;
    return {mode, agrees};
}

Use most_used(const Work& w, const unsigned char* contact, const Sample& s,
              const Piece& piece) SHIFTRIG_REALTIME {
    Use worst;
    for (int k = 0; k < w.model.pairs; ++k) {
        if (contact[k] != locked || !piece.holds(k)) continue;
        const double use = std::fabs(s.torque[k]) / static_limit(w, k, s);
        if (use > worst.share && (use <= overload || is_overloaded(w, k, s))) worst = {k, use};
    }
    return worst;
}

void open_pair(Work& w, const Mode& mode, int pair, Sample& s) SHIFTRIG_REALTIME {
    for (int k = w.model.pairs; k < w.model.first_flank; ++k) {
        if (mode.bound[k] && mesh_of(w, k - w.model.pairs).lossy()) w.contact[k] = stuck;
    }
    note_opening(w, pair, s);
    w.contact[pair] = slipping(opening_sense(w, pair, s.torque[pair], s));
    w.scratch.overcome[static_cast<std::size_t>(pair)] = 1;
    contact_forces(w, w.contact, s);
}

bool lean_on_losses(Work& w, const Mode& mode, const Use& most, Sample& s) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    if (!mode.rests) return false;
    const Piece piece = piece_around(w, mode, most.pair, s);
    if (mode.tree && is_too_much(w, mode, piece, s)) return false;
    unsigned char* trial = w.scratch.trial.data();
    double use = most.share;
    bool found = false, tried = false;
    for (int k = m.pairs; k < m.first_flank; ++k) {
        if (!mesh_of(w, k - m.pairs).lossy() || (w.contact[k] != stuck && !mode.bound[k]) || !piece.holds(k))
            continue;
        if (!tried) std::copy(s.torque, s.torque + m.torques, w.scratch.torque_copy.data());
        tried = true;
        for (const double direction : {1., -1.}) {
            if (w.contact[k] != stuck && motion_sign(w.contact[k]) == direction) continue;
            std::copy(w.contact, w.contact + m.contact_bytes, trial);
            trial[k] = moving(direction,
                              w.scratch.torque_copy[static_cast<std::size_t>(k)] * direction < 0 ? -1 : 1);
            contact_forces(w, trial, s);
            const auto [leaning, agrees] = try_directions(w, trial, s);  // else it is no split of the torques
            const double relieved = most_used(w, w.contact, s, piece).share;
            // Not so without a tree: there a loop at rest may be held by torques at the very kink of a mesh's losses, where
            // neither direction agrees and both give nearly the same.
            if ((mode.tree && !agrees) || !leaning.bound[k] || relieved >= use * (1 - 1e-6)) continue;
            if (loses_too_much(w, leaning, s, piece)) continue;  // passed to nobody
            use = relieved;
            found = true;
            std::copy(trial, trial + m.contact_bytes, w.scratch.release.data());
        }
    }
    if (!tried) return false;
    if (found) std::copy(w.scratch.release.begin(), w.scratch.release.end(), w.contact);
    contact_forces(w, w.contact, s);
    if (!found) internal_torques(w, mode, s);
    return found;
}

bool give_way(Work& w, const Mode& mode, const Use& most, int pair, Sample& s) SHIFTRIG_REALTIME {
    if (lean_on_losses(w, mode, most, s)) return false;
    const Rearrangement found = rearrange(w, pair, pair, s);
    if (found == Rearrangement::none) open_pair(w, mode, pair, s);
    return found != Rearrangement::stands;
}

Mode& settle(Work& w, Sample& s, bool complete) SHIFTRIG_REALTIME {
    if (!complete) {
        look(w.model, find_mode(w.model, w.operators, w.contact, w.scratch), s);
        evaluate_forces(w, w.contact, s);
    }
    if (engage_and_release(w, s)) complete = false;
    const int most_passes = 2 * w.model.contact_bytes + 2;
    for (int passes = 0;; ++passes, complete = false) {
        Mode& mode = find_directions(w, w.contact, s, complete);
        if (passes <= most_passes) {
            if (release_stuck_meshes(w, mode, s) || leave_to_others(w, mode, s)) continue;
            const Use worst = most_used(w, w.contact, s);
            if (is_overloaded(w, worst.pair, s)) {
                give_way(w, mode, worst, worst.pair, s);
                continue;
            }
        } else {
            w.outputs.certificate.flags |= Certificate::no_agreement;
        }
        if (w.scratch.noted_count > 0) follow_others(w, mode, s);
        tell_instant(w, mode, s);
        for (auto* list : {&w.scratch.overcome, &w.scratch.eased})
            std::fill(list->begin(), list->end(), static_cast<unsigned char>(0));
        std::fill(w.scratch.onward.begin(), w.scratch.onward.end(), static_cast<signed char>(0));
        return mode;
    }
}

}  // namespace shiftrig::plant::detail
