#include "plant/stuck_meshes.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "plant/dense.h"
#include "plant/rest_problem.h"
#include "plant/settling.h"
#include "plant/standstill.h"
#include "plant/telling.h"

namespace shiftrig::plant::detail {
namespace {

// Direction in which a device takes part in a motion, after everything that locked pairs and meshes
// exclude: column of length √(1/reduced inertia), in J^(−1/2) scaling.
template <typename Links>
double reduced_motion(const Work& w, const Mode& mode, const Links& links, double* column) {
    const ModelData& m = w.model;
    std::fill(column, column + m.masses, 0.);
    double length = 0;
    for (const Link& link : links) {
        if (link.mass < 0) continue;
        column[link.mass] += link.factor / m.root_inertia[static_cast<std::size_t>(link.mass)];
    }
    length = std::sqrt(dot(column, column, m.masses));
    for (int pass = 0; pass < 2; ++pass) {
        for (int k = 0; k < mode.base_rank; ++k) {
            const double* q = mode.basis + k * m.masses;
            add_scaled(column, -dot(q, column, m.masses), q, m.masses);
        }
    }
    const double rest = std::sqrt(dot(column, column, m.masses));
    return rest < 1e-9 * length ? 0 : rest;
}

// How every device would turn with mesh `leader`: ±1, or 0. Geometry of the mode alone, so it is found once.
void relate(Work& w, const Mode& mode, int leader, signed char* relation) {
    const ModelData& m = w.model;
    double* lead = w.scratch.vector_a;
    double* member = w.scratch.vector_b;
    const double mobility = mode.family_mobility[leader] =
        reduced_motion(w, mode, mesh_of(w, leader).motion(), lead);
    const auto related = [&](const std::array<Link, 2>& links) -> signed char {
        const double size = mobility > 0 ? reduced_motion(w, mode, links, member) : 0;
        if (size == 0) return 0;
        const double cosine = dot(lead, member, m.masses) / (mobility * size);
        return static_cast<signed char>(std::fabs(cosine) < 1 - 1e-9 ? 0 : cosine < 0 ? -1 : 1);
    };
    for (int k = 0; k < m.pairs; ++k)
        relation[k] = mode.bound[k] ? related(pair_links(w, k)) : static_cast<signed char>(0);
    for (int k = 0; k < m.meshes; ++k) {
        relation[m.pairs + k] =
            mesh_of(w, k).lossy() ? related(mesh_of(w, k).motion()) : static_cast<signed char>(0);
    }
}

// Everything at rest that moves if mesh `leader` moves is one family: part = ±1 turning with or against the
// leader, 0 others. Returns 1/√(reduced inertia) of its motion, 0 if others hold it.
double find_family(Work& w, const Mode& mode, int leader, signed char* part) {
    if (mode.tree) return tree_family(w, mode, leader, part);
    const ModelData& m = w.model;
    signed char* relation = mode.relations + leader * m.contact_bytes;
    if (mode.family_mobility[leader] < 0) relate(w, mode, leader, relation);
    for (int k = 0; k < m.first_flank; ++k) {
        const bool still = k < m.pairs ? slips(w.contact[k]) : w.contact[k] == stuck || mode.bound[k];
        part[k] = still ? relation[k] : static_cast<signed char>(0);
    }
    return mode.family_mobility[leader];
}

// Acceleration of a mesh, at rest until now, in the sense in which the sample's contact states take it to move.
double departure(const Work& w, const unsigned char* contact, int mesh, const Sample& s) {
    return motion_sign(contact[w.model.pairs + mesh]) * slip_of(mesh_of(w, mesh).motion(), s.rate);
}

}  // namespace

namespace {

// Accelerations that are no more than rounding.
double rounding_of_drive(const Work& w, double mobility, const Sample& s) {
    return 1e-10 * torque_scale(w, s) * mobility * mobility;
}

// release_drive(), and −∞ where nothing could be tried.
double try_departure(Work& w, const Mode& mode, int leader, Sample& s) {
    const ModelData& m = w.model;
    ScratchData& scratch = w.scratch;
    signed char* part = scratch.family.data();
    const double mobility = find_family(w, mode, leader, part);
    if (mobility == 0) return -1;

    const double threshold = rounding_of_drive(w, mobility, s);
    unsigned char* trial = scratch.trial.data();
    std::copy(s.torque, s.torque + m.torques, scratch.torque_copy.data());
    // To set it moving, the load must overcome what its pairs can hold, not what they pass on sliding; but a pair that
    // breaks away in this very instant has been overcome.
    double* sliding = scratch.vector_a;
    std::copy(s.sliding, s.sliding + m.pairs, sliding);
    for (int k = 0; k < m.pairs; ++k) {
        if (part[k] != 0 && !scratch.overcome[static_cast<std::size_t>(k)])
            s.sliding[k] = std::max(s.sliding[k], s.holding[k]);
    }
    const auto set = [&](int k, double sign) {
        const int x = scratch.torque_copy[static_cast<std::size_t>(k)] * sign < 0 ? -1 : 1;
        trial[k] = k < m.pairs ? slipping(sign) : moving(sign, x);
    };
    const auto begin_trial = [&](double direction) {
        std::copy(w.contact, w.contact + m.contact_bytes, trial);
        for (int k = 0; k < m.first_flank; ++k) {
            if (part[k] != 0) set(k, direction * part[k]);
        }
    };
    double best = -std::numeric_limits<double>::infinity();
    bool held_together = false;
    const auto attempt = [&](int partner) {
        contact_forces(w, trial, s);
        const Mode& moving_mode = try_directions(w, trial, s).mode;
        held_together = moving_mode.bound[m.pairs + leader] != 0;
        if (held_together || trial[m.pairs + leader] == stuck) return;
        sample_rate(w, moving_mode, s);
        const double drive = departure(w, trial, leader, s) - threshold;
        if (drive <= best || (partner >= 0 && departure(w, trial, partner, s) <= threshold)) return;
        best = drive;
        std::copy(trial, trial + m.contact_bytes, scratch.release.data());
    };
    for (const double direction : {1., -1.}) {
        begin_trial(direction);
        attempt(-1);
        if (!held_together || mode.tree) continue;
        for (int partner = 0; partner < m.meshes; ++partner) {
            if (w.contact[m.pairs + partner] != stuck || part[m.pairs + partner] != 0 ||
                !mesh_of(w, partner).lossy())
                continue;
            for (const double sign : {1., -1.}) {
                begin_trial(direction);
                set(m.pairs + partner, sign);
                attempt(partner);
            }
        }
    }
    std::copy(sliding, sliding + m.pairs, s.sliding);
    contact_forces(w, w.contact, s);
    internal_torques(w, mode, s);
    return best;
}

}  // namespace

double release_drive(Work& w, const Mode& mode, int leader, Sample& s) SHIFTRIG_REALTIME {
    const double best = try_departure(w, mode, leader, s);
    const double mobility = find_family(w, mode, leader, w.scratch.family.data());
    // Held whatever is tried: finite, for the search of an instant.
    return mobility == 0 ? best : std::max(best, -1e10 * rounding_of_drive(w, mobility, s));
}

LossAtRest loss_at_rest(const Work& w, int k, const Sample& s) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    const Mesh& mesh = mesh_of(w, k);
    const double needed = s.torque[m.pairs + m.meshes + k], sign = needed < 0 ? -1 : 1;
    const double torque = sign * s.torque[m.pairs + k];
    const bool drives = torque >= sign * loss_kink(w, k, sign);
    const double allowed = drives ? (1 - mesh.forward_efficiency) * torque + mesh.forward_bearing
                                  : (1 - 1 / mesh.backward_efficiency) * torque + mesh.backward_bearing;
    return {needed, allowed};
}

namespace {

// What it takes by itself.
LossAtRest alone(const Work& w, int mesh, const Sample& s) {
    const LossAtRest loss = loss_at_rest(w, mesh, s);
    return {std::fabs(loss.needed), loss.allowed};
}

}  // namespace

void family_losses(Work& w, const Mode& mode, int leader, Sample& s, LossAtRest* losses) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    const signed char* const part = w.scratch.family.data();
    const double mobility = find_family(w, mode, leader, w.scratch.family.data());
    int members = 0;
    for (int k = 0; k < m.first_flank; ++k) members += part[k] != 0;
    if (mobility == 0 || members <= 1) {
        losses[leader] = alone(w, leader, s);
        return;
    }
    const Certificate kept = w.outputs.certificate;  // what is only told does not count
    std::fill(s.rate, s.rate + m.states, 0.);        // where nothing can be tried
    const double drive = try_departure(w, mode, leader, s);
    const auto misses = w.outputs.certificate.mode_misses;
    w.outputs.certificate = kept;
    w.outputs.certificate.mode_misses = misses;
    const double of_leader = slip_of(mesh_of(w, leader).motion(), s.rate);
    const double needed = std::fabs(s.torque[m.pairs + m.meshes + leader]);
    const double allowed = std::max(0., needed - drive / (mobility * mobility));
    for (const int k : m.lossy_meshes) {
        if (k != leader && part[m.pairs + k] == 0) continue;
        const double ratio = std::fabs(of_leader / slip_of(mesh_of(w, k).motion(), s.rate));
        losses[k] = std::isfinite(ratio) && std::isfinite(allowed)
                        ? LossAtRest{needed * ratio, allowed * ratio}
                        : alone(w, k, s);
    }
}

int leader_of(Work& w, const Mode& mode, int mesh) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    for (int r = mode.row_count - 1; r >= 0 && mode.rows[r] >= m.pairs + m.meshes; --r) {
        const int leader = mode.rows[r] - m.pairs - m.meshes;
        if (leader == mesh) return leader;
        if (find_family(w, mode, leader, w.scratch.family.data()) != 0 &&
            w.scratch.family[static_cast<std::size_t>(m.pairs + mesh)] != 0)
            return leader;
    }
    return -1;
}

LossAtRest MotionLosses::of(int mesh, Sample& s) SHIFTRIG_REALTIME {
    const int leader = leader_of(w, mode, mesh);
    if (leader < 0) return loss_at_rest(w, mesh, s);
    LossAtRest* const losses = w.scratch.losses.data();
    if (leader != known) family_losses(w, mode, leader, s, losses);
    known = leader;
    return losses[mesh];
}

double loss_left(const Work& w, int mesh, const Sample& s) SHIFTRIG_REALTIME {
    const LossAtRest loss = loss_at_rest(w, mesh, s);
    return loss.allowed - std::fabs(loss.needed);
}

bool loses_too_much(const Work& w, const Mode& mode, const Sample& s, const Piece& piece) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    for (int r = mode.row_count - 1; r >= 0 && mode.rows[r] >= m.pairs + m.meshes; --r) {
        const int mesh = mode.rows[r] - m.pairs - m.meshes;
        if (!piece.holds(m.pairs + mesh)) continue;
        const double left = loss_left(w, mesh, s);
        if (left < 0 && left < -1e-9 * torque_scale(w, s)) return true;
    }
    return false;
}

bool is_held(const Work& w, int leader, const Sample& s) SHIFTRIG_REALTIME {
    const LossAtRest loss = loss_at_rest(w, leader, s);
    return std::fabs(loss.needed) < (1 - 1e-6) * loss.allowed;
}

namespace {

// The losses of a motion at rest are told of its leader alone, and may be more than that one can lose as long as the others can
// lose the rest. To a locked pair between them it matters which do.
bool matters_to_pairs(const Work& w, const Piece& piece) {
    for (int k = 0; k < w.model.pairs; ++k) {
        if (w.contact[k] == locked && piece.holds(k)) return true;
    }
    return false;
}

}  // namespace

bool leave_to_others(Work& w, const Mode& mode, Sample& s) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    unsigned char* trial = w.scratch.trial.data();
    double size = 0;
    for (int r = mode.row_count - 1; r >= 0 && mode.rows[r] >= m.pairs + m.meshes; --r) {
        const int mesh = mode.rows[r] - m.pairs - m.meshes, device = m.pairs + mesh;
        const double left = loss_left(w, mesh, s);
        if (left >= 0) continue;
        if (size == 0) size = torque_scale(w, s);
        if (left >= -1e-9 * size) continue;
        const double direction = s.torque[device + m.meshes] < 0 ? -1 : 1;
        const int x = s.torque[device] * direction < 0 ? -1 : 1;
        double least = overload;
        int taker = -1;
        bool asked = false;
        const Piece piece = piece_around(w, mode, device, s);
        for (int k = 0; k < m.pairs; ++k) {
            if (!slips(w.contact[k]) || !mode.bound[k] || w.scratch.overcome[static_cast<std::size_t>(k)])
                continue;
            if (std::fabs(device_slip(w, k, s.z)) > at_rest || !piece.holds(k)) continue;
            asked = true;
            std::copy(w.contact, w.contact + m.contact_bytes, trial);
            trial[device] = moving(direction, x);
            trial[k] = locked;
            contact_forces(w, trial, s);
            const Mode& shared = try_directions(w, trial, s).mode;
            const double use = most_used(w, trial, s).share;
            if (!shared.bound[device] || use >= least) continue;
            least = use;
            taker = k;
            std::copy(trial, trial + m.contact_bytes, w.scratch.release.data());
        }
        if (taker >= 0) {
            std::copy(w.scratch.release.begin(), w.scratch.release.end(), w.contact);
            note_closing(w, taker, 0);
        }
        contact_forces(w, w.contact, s);
        if (taker >= 0) return true;
        internal_torques(w, mode, s);
        if (asked && rearrange(w, -1, device, s) != Rearrangement::none) return true;
        if (matters_to_pairs(w, piece) && rearrange(w, -1, device, s, true) != Rearrangement::none)
            return true;
    }
    return false;
}

namespace {

// Where several motions are at rest, and more meshes than there are motions, which of them go hangs on all of them together, and
// a mesh that would go by itself may have to stay.
bool holds_several(const Work& w, const Mode& mode) {
    const int first = w.model.pairs + w.model.meshes;
    return mode.row_count >= 2 && mode.rows[mode.row_count - 2] >= first;
}

bool try_release(Work& w, const Mode& mode, int leader, Sample& s) {
    if (release_drive(w, mode, leader, s) <= 0) return false;
    const ModelData& m = w.model;
    unsigned char* const release = w.scratch.changed.data();  // to tell of it tries again
    std::copy(w.scratch.release.begin(), w.scratch.release.begin() + m.contact_bytes, release);
    if (holds_several(w, mode) && rearrange(w, -1, m.pairs + leader, s) == Rearrangement::moves) return true;
    LossAtRest* const losses = w.scratch.losses.data();
    for (const int k : m.lossy_meshes) losses[k] = alone(w, k, s);
    family_losses(w, mode, leader, s, losses);
    for (const int k : m.lossy_meshes) {
        if (w.contact[m.pairs + k] != stuck || release[m.pairs + k] == stuck) continue;
        note_release(w, m.pairs + k, losses[k]);
    }
    std::copy(release, release + m.contact_bytes, w.contact);
    contact_forces(w, w.contact, s);
    return true;
}

}  // namespace

bool release_stuck_meshes(Work& w, const Mode& mode, Sample& s) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    for (int r = 0; r < mode.row_count; ++r) {
        const int leader = mode.rows[r] - m.pairs - m.meshes;
        if (leader >= 0 && !is_held(w, leader, s) && try_release(w, mode, leader, s)) return true;
    }
    return false;
}

}  // namespace shiftrig::plant::detail
