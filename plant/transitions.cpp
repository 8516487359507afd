#include "plant/transitions.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "plant/dense.h"
#include "plant/ledger.h"

namespace shiftrig::plant::detail {
namespace {

constexpr double at_rest = 1e-9;      // a pair that engages at less slip than this closes at once [rad/s]
// Power that turns round by less is corrected, not located: loss that changes, of the largest torque.
constexpr double small_loss = 1e-4, small_loss_of_parts = 1e-7;
constexpr double overload = 1 + 1e-9; // torque over capacity that opens a closed pair

const std::array<Link, 2>& pair_links(const Work& w, int pair) {
    return w.model.structure.pairs[static_cast<std::size_t>(pair)].links;
}
const Mesh& mesh_of(const Work& w, int mesh) { return w.model.structure.meshes[static_cast<std::size_t>(mesh)]; }

// The slip that a contact byte is about.
double device_slip(const Work& w, int device, const double* speeds) {
    const ModelData& m = w.model;
    return device < m.pairs ? slip_fast(m.pair_slip[static_cast<std::size_t>(device)], speeds)
                            : slip_fast(m.mesh_motion[static_cast<std::size_t>(device - m.pairs)], speeds);
}

// Sum of magnitudes behind a slip: what its rounding errors are relative to.
double slip_scale(const Work& w, int device, const double* speeds) {
    const std::array<Link, 2> links =
        device < w.model.pairs ? pair_links(w, device) : mesh_of(w, device - w.model.pairs).motion();
    double scale = 1;
    for (const Link& link : links) {
        if (link.mass >= 0) scale += std::fabs(link.factor * speeds[link.mass]);
    }
    return scale;
}

double torque_scale(const Work& w, const Sample& s) {
    double scale = 0;
    for (int k = 0; k < w.model.torques; ++k) scale = std::max(scale, std::fabs(s.torque[k]));
    for (int k = 0; k < w.model.forces; ++k) scale = std::max(scale, std::fabs(s.f[k]));
    return scale;
}

// What changes in the loss when power turns round, per torque.
double loss_difference(const Mesh& mesh) { return 1 / mesh.backward_efficiency - mesh.forward_efficiency; }

// Torque at which the two loss lines of a mesh cross: below it the second link drives.
double loss_kink(const Work& w, int mesh, double sign) { return sign * w.model.loss_kink[static_cast<std::size_t>(mesh)]; }

// On the engine for long chains, lossy meshes that others hold at rest carry torque without loss. On the other one they
// may lean on their loss, see lean_on_losses().
bool rest_bound_meshes(const Work& w, const Mode& mode, unsigned char* contact) {
    if (!mode.tree) return false;
    bool changed = false;
    for (int k = w.model.pairs; k < w.model.contact_bytes; ++k) {
        if (contact[k] == stuck || !mode.bound[k] || !mesh_of(w, k - w.model.pairs).lossy()) continue;
        contact[k] = stuck;
        changed = true;
    }
    return changed;
}

// Loss directions that agree with the torques they lead to ([Algin] eq. (16)–(25), but decided by the lossy
// torques): start from the present ones and flip the worst offender until there is none.
// `complete`: the torques of the present states are in the sample.
Mode& find_directions(Work& w, unsigned char* contact, Sample& s, bool complete = false) {
    const ModelData& m = w.model;
    const int most = 2 * m.meshes + 2;
    for (int flips = 0;; ++flips) {
        Mode& mode = find_mode(m, w.operators, contact, w.scratch);
        ++w.outputs.certificate.mode_lookups;
        if (rest_bound_meshes(w, mode, contact)) {
            contact_forces(w, contact, s);
            complete = false;
            continue;
        }
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
            w.outputs.certificate.flags |= 2;
            return mode;
        }
        contact[m.pairs + worst] ^= driven;
        contact_forces(w, contact, s);
    }
}

// Pairs by their capacity: none is free, some engages. [Algin]: a change of λ by pressure.
bool engage_and_release(Work& w, Sample& s) {
    const ModelData& m = w.model;
    bool changed = false;
    for (int k = 0; k < m.pairs; ++k) {
        const bool capable = s.sliding[k] > 0 || s.holding[k] > 0 || is_pressed(w, k, s.at);
        if (capable != (w.contact[k] == free_running)) continue;
        const double slip = slip_of(pair_links(w, k), s.z);
        if (!capable && w.contact[k] != free_running) {
            log_event(w, EventKind::release, k, s.at.time, s.torque[k], 0, slip);
            w.contact[k] = free_running;
            changed = true;
        } else if (capable && w.contact[k] == free_running) {
            if (std::fabs(slip) > at_rest) {
                log_event(w, EventKind::engage, k, s.at.time, 0, s.sliding[k], slip);
                w.contact[k] = slipping(slip);
            } else {
                change_state(w, k, s);
            }
            changed = true;
        }
    }
    if (changed) contact_forces(w, w.contact, s);
    return changed;
}

// Of a locked pair ([Algin] eq. (12)). Capacities may be as small as the rounding of torques.
bool is_overloaded(const Work& w, int pair, const Sample& s) {
    if (pair < 0) return false;
    const double torque = std::fabs(s.torque[pair]);
    return torque > overload * s.holding[pair] && torque > 1e-11 * torque_scale(w, s);
}

// The locked pair that uses most of its static capacity.
struct Use {
    int pair = -1;
    double share = 0;  // torque over capacity
};
Use most_used(const Work& w, const unsigned char* contact, const Sample& s) {
    Use worst;
    for (int k = 0; k < w.model.pairs; ++k) {
        if (contact[k] != locked) continue;
        const double use = std::fabs(s.torque[k]) / s.holding[k];
        if (use > worst.share && (use <= overload || is_overloaded(w, k, s))) worst = {k, use};
    }
    return worst;
}

// Meshes that leaned on their losses begin anew: which way they go now, release_drive() finds out.
void open(Work& w, const Mode& mode, int pair, Sample& s) {
    for (int k = w.model.pairs; k < w.model.contact_bytes; ++k) {
        if (mode.bound[k] && mesh_of(w, k - w.model.pairs).lossy()) w.contact[k] = stuck;
    }
    log_event(w, EventKind::break_away, pair, s.at.time, s.torque[pair], s.holding[pair], 0);
    w.contact[pair] = slipping(s.torque[pair]);
    w.scratch.overcome[static_cast<std::size_t>(pair)] = !mode.tree;
    contact_forces(w, w.contact, s);
}

// A lossy mesh that others hold at rest takes any loss torque up to the limit of either direction: the machine stands as
// long as some split of the torques is within everybody's limits. So before a pair opens, the mesh that relieves
// the most used pair most is set to its limit. Says whether one was.
bool lean_on_losses(Work& w, const Mode& mode, double use, Sample& s) {
    const ModelData& m = w.model;
    if (mode.tree) return false;
    unsigned char* trial = w.scratch.trial.data();
    bool found = false, tried = false;
    for (int k = m.pairs; k < m.contact_bytes; ++k) {
        if (!mesh_of(w, k - m.pairs).lossy() || (w.contact[k] != stuck && !mode.bound[k])) continue;
        if (!tried) std::copy(s.torque, s.torque + m.torques, w.scratch.torque_copy.data());
        tried = true;
        for (const double direction : {1., -1.}) {
            if (w.contact[k] != stuck && motion_sign(w.contact[k]) == direction) continue;
            std::copy(w.contact, w.contact + m.contact_bytes, trial);
            trial[k] = moving(direction, w.scratch.torque_copy[static_cast<std::size_t>(k)] * direction < 0 ? -1 : 1);
            contact_forces(w, trial, s);
            const Mode& leaning = find_directions(w, trial, s);
            const double relieved = most_used(w, w.contact, s).share;
            if (!leaning.bound[k] || relieved >= use * (1 - 1e-6)) continue;
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

// ---- stuck meshes -----------------------------------------------------------------------------------

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
    double* lead = w.scratch.vector_a.data();
    double* member = w.scratch.vector_b.data();
    const double mobility = mode.family_mobility[leader] = reduced_motion(w, mode, mesh_of(w, leader).motion(), lead);
    const auto related = [&](const std::array<Link, 2>& links) -> signed char {
        const double size = mobility > 0 ? reduced_motion(w, mode, links, member) : 0;
        if (size == 0) return 0;
        const double cosine = dot(lead, member, m.masses) / (mobility * size);
        return static_cast<signed char>(std::fabs(cosine) < 1 - 1e-9 ? 0 : cosine < 0 ? -1 : 1);
    };
    for (int k = 0; k < m.pairs; ++k) relation[k] = mode.bound[k] ? related(pair_links(w, k)) : static_cast<signed char>(0);
    for (int k = 0; k < m.meshes; ++k) {
        relation[m.pairs + k] = mesh_of(w, k).lossy() ? related(mesh_of(w, k).motion()) : static_cast<signed char>(0);
    }
}

// Everything at rest that moves if mesh `leader` moves is one family: part = ±1 turning with or against the
// leader, 0 others. Returns 1/√(reduced inertia) of its motion, 0 if others hold it.
double find_family(Work& w, const Mode& mode, int leader, signed char* part) {
    if (mode.tree) return tree_family(w, mode, leader, part);
    const ModelData& m = w.model;
    signed char* relation = mode.relations + leader * m.contact_bytes;
    if (mode.family_mobility[leader] < 0) relate(w, mode, leader, relation);
    for (int k = 0; k < m.contact_bytes; ++k) {
        const bool still = k < m.pairs ? slips(w.contact[k]) : w.contact[k] == stuck || mode.bound[k];
        part[k] = still ? relation[k] : static_cast<signed char>(0);
    }
    return mode.family_mobility[leader];
}

// Acceleration of a mesh, at rest until now, in the sense in which the sample's contact states take it to move.
double departure(const Work& w, const unsigned char* contact, int mesh, const Sample& s) {
    return motion_sign(contact[w.model.pairs + mesh]) * slip_of(mesh_of(w, mesh).motion(), s.rate);
}

// A family is let go together, each member with the sign that the motion gives it. It goes if, one way and with
// its own consistent losses, it accelerates that way. Where other stuck meshes hold it only together, one of those goes
// with it. Returns the acceleration towards the better of all ways beyond rounding, positive if it goes, with the
// states it then has in scratch.release; the sample is as before.
double release_drive(Work& w, const Mode& mode, int leader, Sample& s) {
    const ModelData& m = w.model;
    ScratchData& scratch = w.scratch;
    signed char* part = scratch.family.data();
    const double mobility = find_family(w, mode, leader, part);
    if (mobility == 0) return -1;

    const double threshold = 1e-10 * torque_scale(w, s) * mobility * mobility;
    unsigned char* trial = scratch.trial.data();
    std::copy(s.torque, s.torque + m.torques, scratch.torque_copy.data());
    // To set it moving, the load must overcome what its pairs can hold, not what they pass on sliding; but a pair that
    // breaks away in this very instant has been overcome.
    double* sliding = scratch.vector_a.data();
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
        for (int k = 0; k < m.contact_bytes; ++k) {
            if (part[k] != 0) set(k, direction * part[k]);
        }
    };
    double best = -std::numeric_limits<double>::infinity();
    bool held_together = false;
    const auto attempt = [&](int partner) {
        contact_forces(w, trial, s);
        const Mode& moving_mode = find_directions(w, trial, s);
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
            if (w.contact[m.pairs + partner] != stuck || part[m.pairs + partner] != 0 || !mesh_of(w, partner).lossy()) continue;
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
    return std::max(best, -1e10 * threshold);  // held whatever is tried: finite, for the search of an instant
}

// What a stuck mesh takes to stay at rest, and the loss it has at its torque if it moves that way.
struct LossAtRest {
    double needed, allowed;
};
LossAtRest loss_at_rest(const Work& w, int k, const Sample& s) {
    const ModelData& m = w.model;
    const Mesh& mesh = mesh_of(w, k);
    const double needed = s.torque[m.pairs + m.meshes + k], sign = needed < 0 ? -1 : 1;
    const double torque = sign * s.torque[m.pairs + k];
    const bool drives = torque >= sign * loss_kink(w, k, sign);
    const double allowed = drives ? (1 - mesh.forward_efficiency) * torque + mesh.forward_bearing
                                  : (1 - 1 / mesh.backward_efficiency) * torque + mesh.backward_bearing;
    return {needed, allowed};
}

// What is left of the loss that a stuck mesh can take.
double loss_left(const Work& w, int mesh, const Sample& s) {
    const LossAtRest loss = loss_at_rest(w, mesh, s);
    return loss.allowed - std::fabs(loss.needed);
}

// A stuck mesh that nothing sets in motion, but whose loss would have to be more than it can be, stays at its limit, and a
// pair at rest that had been at its own takes the rest: it locks. The counterpart of lean_on_losses().
bool leave_to_pairs(Work& w, const Mode& mode, Sample& s) {
    const ModelData& m = w.model;
    if (mode.tree) return false;
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
        for (int k = 0; k < m.pairs; ++k) {
            if (!slips(w.contact[k]) || !mode.bound[k] || w.scratch.overcome[static_cast<std::size_t>(k)])
                continue;
            if (std::fabs(device_slip(w, k, s.z)) > at_rest) continue;
            std::copy(w.contact, w.contact + m.contact_bytes, trial);
            trial[device] = moving(direction, x);
            trial[k] = locked;
            contact_forces(w, trial, s);
            const Mode& shared = find_directions(w, trial, s);
            const double use = most_used(w, trial, s).share;
            if (!shared.bound[device] || use >= least) continue;
            least = use;
            taker = k;
            std::copy(trial, trial + m.contact_bytes, w.scratch.release.data());
        }
        if (taker >= 0) {
            std::copy(w.scratch.release.begin(), w.scratch.release.end(), w.contact);
            log_event(w, EventKind::lock, taker, s.at.time, 0, s.holding[taker], 0);
        }
        contact_forces(w, w.contact, s);
        if (taker >= 0) return true;
        internal_torques(w, mode, s);
    }
    return false;
}

// Closings are told with the torques that they lead to.
void tell_closings(Work& w, const Sample& s) {
    const int count = std::min(w.outputs.event_count, Outputs::event_capacity);
    for (int& i = w.scratch.told_events; i < count; ++i) {
        Event& event = w.outputs.events[static_cast<std::size_t>(i)];
        if (event.kind == EventKind::lock) {
            event.torque = s.torque[event.device];
        } else if (event.kind == EventKind::mesh_sticks) {
            const LossAtRest loss = loss_at_rest(w, event.device - w.model.pairs, s);
            event.torque = loss.needed;
            event.capacity = loss.allowed;
        }
    }
}

bool try_release(Work& w, const Mode& mode, int leader, Sample& s) {
    if (release_drive(w, mode, leader, s) <= 0) return false;
    const ModelData& m = w.model;
    for (int k = m.pairs; k < m.contact_bytes; ++k) {
        if (w.contact[k] != stuck || w.scratch.release[static_cast<std::size_t>(k)] == stuck) continue;
        const LossAtRest loss = loss_at_rest(w, k - m.pairs, s);
        log_event(w, EventKind::mesh_releases, k, s.at.time, loss.needed, loss.allowed, 0);
    }
    std::copy(w.scratch.release.begin(), w.scratch.release.end(), w.contact);
    contact_forces(w, w.contact, s);
    return true;
}

bool release_stuck_meshes(Work& w, const Mode& mode, Sample& s) {
    const ModelData& m = w.model;
    for (int r = 0; r < mode.row_count; ++r) {
        const int leader = mode.rows[r] - m.pairs - m.meshes;
        if (leader >= 0 && try_release(w, mode, leader, s)) return true;
    }
    return false;
}

// ---- crossings --------------------------------------------------------------------------------------

// Root in [0, 1] of the parabola through g(0), its slope there (per unit length) and g(1) < 0.
double parabola_root(double g0, double slope, double g1) {
    if (g0 <= 0) {
        if (slope <= 0) return 0;
        g0 = 0;
    }
    const double a = g1 - g0 - slope;
    const double root = std::sqrt(std::max(0., slope * slope - 4 * a * g0));
    const double q = -0.5 * (slope + (slope < 0 ? -root : root));
    double theta = g0 == 0 ? (a != 0 ? -slope / a : 1) : q > 0 ? g0 / q : a != 0 ? q / a : 1;
    if (!(theta >= 0 && theta <= 1)) theta = a != 0 ? q / a : 1;
    return std::clamp(theta, 0., 1.);
}

// Does the state of this device fail to hold at the end sample? Bound slips are zero by others' doing.
bool violated(const Work& w, const Mode& mode, int device, const Sample& end) {
    const ModelData& m = w.model;
    const unsigned char state = w.contact[device];
    if (device < m.pairs) {
        if (state == locked) return is_overloaded(w, device, end);
        if (state == free_running || mode.bound[device]) return false;
    } else if (state == stuck || mode.bound[device] || !mesh_of(w, device - m.pairs).lossy()) {
        return false;
    }
    const double sign = device < m.pairs ? slip_sign(state) : motion_sign(state);
    const double slip = sign * device_slip(w, device, end.z);
    return slip < 0 && slip < -1e-13 * slip_scale(w, device, end.z);
}

void close(Work& w, int device, Sample& s) {
    const ModelData& m = w.model;
    Mode& before = find_mode(m, w.operators, w.contact, w.scratch);
    unsigned char* was_bound = w.scratch.changed.data();
    std::copy(before.bound, before.bound + m.contact_bytes, was_bound);
    const auto capacity = [&](int k) { return k < m.pairs ? s.holding[k] : 0.; };
    const auto set = [&](int k) {
        w.contact[k] = k < m.pairs ? static_cast<unsigned char>(locked) : static_cast<unsigned char>(stuck);
        log_event(w, k < m.pairs ? EventKind::lock : EventKind::mesh_sticks, k, s.at.time, s.torque[k], capacity(k),
                  device_slip(w, k, s.z));
    };
    set(device);
    const Mode& mode = find_mode(m, w.operators, w.contact, w.scratch);
    const double lost = join(w, mode, s.z);
    w.scratch.dissipated += lost;
    if (device < m.pairs) w.scratch.heat[static_cast<std::size_t>(device)] += lost;
    // What came to rest with it: the same motion, hence the same instant.
    for (int k = 0; k < m.pairs; ++k) {
        if (slips(w.contact[k]) && mode.bound[k] && !was_bound[k]) set(k);
    }
    for (int k = m.pairs; k < m.contact_bytes; ++k) {
        if (w.contact[k] != stuck && mode.bound[k] && !was_bound[k] && mesh_of(w, k - m.pairs).lossy()) set(k);
    }
}

}  // namespace

void log_event(Work& w, EventKind kind, int device, double time, double torque, double capacity,
               double slip) SHIFTRIG_REALTIME {
    const int index = w.outputs.event_count++;
    if (index >= Outputs::event_capacity) return;
    w.outputs.events[static_cast<std::size_t>(index)] = {time, kind, static_cast<std::int16_t>(device), torque,
                                                         capacity, slip};
}

void sample_rate(const Work& w, const Mode& mode, Sample& s) SHIFTRIG_REALTIME {
    if (mode.tree) return tree_sample_rate(w, mode, s);
    const ModelData& m = w.model;
    m.kernel.multiply(mode.rates, m.states_padded, mode.order + m.forces, read_coordinates(mode, s), nullptr, s.rate);
}

double join(Work& w, const Mode& mode, double* speeds) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    const auto kinetic_energy = [&] {
        double energy = 0;
        for (int j = 0; j < m.masses; ++j) {
            energy += 0.5 * m.structure.inertia[static_cast<std::size_t>(j)] * speeds[j] * speeds[j];
        }
        return energy;
    };
    const double before = kinetic_energy();
    double* momentum = w.scratch.vector_a.data();
    double* joined = w.scratch.vector_b.data();
    for (int j = 0; j < m.masses; ++j) momentum[j] = m.structure.inertia[static_cast<std::size_t>(j)] * speeds[j];
    if (mode.tree) {
        tree_mobility(w, mode, momentum, joined);
    } else {
        m.kernel.multiply(mode.mobility, padded(m.masses), m.masses, momentum, nullptr, joined);
    }
    std::copy(joined, joined + m.masses, speeds);
    return before - kinetic_energy();
}

// With x wrong, the acceleration is off by B_r (Ĉ_w − Ĉ_r) M_1, and M_1 grows linearly from the instant of
// reversal: half of M_1 at the end, over the rest of the part.
Mode& correct_directions(Work& w, Mode& mode) SHIFTRIG_REALTIME {
    if (!w.scratch.turned) return mode;
    const ModelData& m = w.model;
    const Sample& begin = w.scratch.begin;
    Sample& end = w.scratch.end;
    const double h = end.at.time - begin.at.time;
    double* change = w.scratch.vector_c.data();  // of the speeds: first as if every mass were free
    double longest = 0;
    for (int k = 0; k < m.meshes; ++k) {
        unsigned char& state = w.contact[m.pairs + k];
        const Mesh& mesh = mesh_of(w, k);
        if (state == stuck || !mesh.lossy() || mode.bound[m.pairs + k]) continue;
        const double sign = motion_sign(state), kink = loss_kink(w, k, sign);
        const double from = (begin.torque[m.pairs + k] - kink) * sign * loss_exponent(state);
        const double to = (end.torque[m.pairs + k] - kink) * sign * loss_exponent(state);
        // From no torque at all (a clutch that begins to press) it is the wrong loss all along; rounding is not that.
        if (to >= 0 || (from <= 0 && -to <= 1e-6 * m.noteworthy_torque)) continue;
        if (longest == 0) std::fill(change, change + m.masses, 0.);
        const double rest = to / (to - std::max(from, 0.)) * h;  // of the part, after the reversal [s]
        const unsigned char turned = state ^ driven;
        const double given = 0.5 * rest * (end.torque[m.pairs + k] - kink) *
                             (mesh.force_ratio(loss_exponent(turned)) - mesh.force_ratio(loss_exponent(state)));
        change[mesh.second] += given / m.structure.inertia[static_cast<std::size_t>(mesh.second)];
        if (mesh.carrier >= 0) change[mesh.carrier] -= given / m.structure.inertia[static_cast<std::size_t>(mesh.carrier)];
        longest = std::max(longest, rest);
        state = turned;
    }
    if (longest == 0) return mode;
    Mode& turned = find_mode(m, w.operators, w.contact, w.scratch);
    join(w, turned, change);
    const double before = stored_energy(m, end.z);
    for (int j = 0; j < m.masses; ++j) end.z[j] += change[j];
    for (int e = 0; e < m.twists; ++e) {
        end.z[m.masses + e] += longest / 3 * slip_of(m.structure.shafts[static_cast<std::size_t>(e)].links, change);
    }
    w.scratch.dissipated += before - stored_energy(m, end.z);
    look(m, turned, end);
    evaluate_forces(w, w.contact, end);
    internal_torques(w, turned, end);
    return turned;
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
            if (release_stuck_meshes(w, mode, s) || leave_to_pairs(w, mode, s)) continue;
            const Use worst = most_used(w, w.contact, s);
            if (is_overloaded(w, worst.pair, s)) {
                if (!lean_on_losses(w, mode, worst.share, s)) open(w, mode, worst.pair, s);
                continue;
            }
        }
        if (w.scratch.told_events < w.outputs.event_count) tell_closings(w, s);
        std::fill(w.scratch.overcome.begin(), w.scratch.overcome.end(), static_cast<unsigned char>(0));
        return mode;
    }
}

namespace {

double margin(const Work& w, int device, const Sample& s) {
    const unsigned char state = w.contact[device];
    if (device >= w.model.pairs) return motion_sign(state) * device_slip(w, device, s.z);
    if (state == locked) return s.holding[device] - std::fabs(s.torque[device]);
    return slip_sign(state) * device_slip(w, device, s.z);
}

double turning_margin(const Work& w, int device, const Sample& s) {
    const unsigned char state = w.contact[device];
    const double sign = motion_sign(state);
    return (s.torque[device] - loss_kink(w, device - w.model.pairs, sign)) * sign * loss_exponent(state);
}

}  // namespace

double crossing_margin(Work& w, const Mode& mode, const Crossing& crossing, Sample& s) SHIFTRIG_REALTIME {
    switch (crossing.change) {
        case Change::state: return margin(w, crossing.device, s);
        case Change::turn: return turning_margin(w, crossing.device, s);
        case Change::release: return -release_drive(w, mode, crossing.device - w.model.pairs, s);
        case Change::limit:
            return loss_left(w, crossing.device - w.model.pairs, s);
    }
    return 0;
}

namespace {

// Is every state good until the end of the part? The usual answer, quickly; a no only sends us to look closely.
bool all_hold(const Work& w, const Mode& mode, const Sample& end) {
    const ModelData& m = w.model;
    for (int k = 0; k < m.pairs; ++k) {
        const unsigned char state = w.contact[k];
        if (state == locked ? std::fabs(end.torque[k]) > end.holding[k] : slip_sign(state) * end.slip[k] < 0) return false;
    }
    for (int k = 0; k < m.meshes; ++k) {
        const unsigned char state = w.contact[m.pairs + k];
        if (!m.lossy[static_cast<std::size_t>(k)]) continue;
        if (state == stuck || mode.bound[m.pairs + k]) return false;
        if (motion_sign(state) * slip_fast(m.mesh_motion[static_cast<std::size_t>(k)], end.z) < 0) return false;
        if (turning_margin(w, m.pairs + k, end) < 0) return false;
    }
    return true;
}

}  // namespace

double first_dip(Work& w, const Mode& mode) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    const Sample &begin = w.scratch.begin, &half = w.scratch.half, &end = w.scratch.end;
    double first = 1;
    if (mode.tree) return first;
    // The least of the parabola through three margins; that they are about to vanish is enough to look closer.
    const auto consider = [&](double g0, double gm, double g1) {
        const double slope = 4 * gm - 3 * g0 - g1, bend = 2 * (g0 - 2 * gm + g1);
        if (!(g0 >= 0 && g1 > 0 && slope < 0)) return;
        const double theta = -0.5 * slope / bend;
        if (theta > 0.02 && theta < 0.98 && g0 + 0.5 * slope * theta < 0.1 * std::min(g0, g1))
            first = std::min(first, theta);
    };
    // What has just been let go begins at zero: it may be driven back at first.
    const auto begun = [](double slip) { return std::fabs(slip) < at_rest ? 0 : slip; };
    bool torques_known = false;
    for (int k = 0; k < m.pairs; ++k) {
        const unsigned char state = w.contact[k];
        if (slips(state)) {
            const double sign = slip_sign(state);
            consider(begun(sign * begin.slip[k]), sign * half.slip[k], sign * end.slip[k]);
        } else if (state == locked && std::fabs(end.torque[k]) > 0.8 * end.holding[k]) {
            if (!torques_known) internal_torques(w, mode, w.scratch.half);
            torques_known = true;
            consider(margin(w, k, begin), margin(w, k, half), margin(w, k, end));
        }
    }
    for (int k = 0; k < m.meshes; ++k) {
        const unsigned char state = w.contact[m.pairs + k];
        if (!m.lossy[static_cast<std::size_t>(k)] || state == stuck || mode.bound[m.pairs + k]) continue;
        const double sign = motion_sign(state);
        const std::array<Link, 2>& motion = m.mesh_motion[static_cast<std::size_t>(k)];
        consider(begun(sign * slip_fast(motion, begin.z)), sign * slip_fast(motion, half.z),
                 sign * slip_fast(motion, end.z));
    }
    return first;
}

Crossing first_crossing(Work& w, const Mode& mode, Sample& begin, Sample& end) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    w.scratch.turned = false;
    Crossing first;
    if (all_hold(w, mode, end)) return first;
    bool rates_known = false, middle_known = false, begin_known = false;
    for (int k = 0; k < m.contact_bytes; ++k) {
        if (!violated(w, mode, k, end)) continue;
        double theta;
        if (k < m.pairs && w.contact[k] == locked) {
            if (!middle_known) internal_torques(w, mode, w.scratch.half);
            middle_known = true;
            const double g0 = margin(w, k, begin), gm = margin(w, k, w.scratch.half), g1 = margin(w, k, end);
            theta = g0 <= 0 ? 0 : parabola_root(g0, 4 * gm - 3 * g0 - g1, g1);
        } else {
            if (!rates_known) sample_rate(w, mode, begin);
            rates_known = true;
            const double sign = k < m.pairs ? slip_sign(w.contact[k]) : motion_sign(w.contact[k]);
            const double length = end.at.time - begin.at.time;
            theta = parabola_root(margin(w, k, begin), sign * device_slip(w, k, begin.rate) * length,
                                  margin(w, k, end));
        }
        if (first.device < 0 || theta < first.theta) first = {k, theta, Change::state};
    }
    for (int r = mode.row_count - 1; r >= 0 && mode.rows[r] >= m.pairs + m.meshes; --r) {
        const int leader = mode.rows[r] - m.pairs - m.meshes;
        const double drive = release_drive(w, mode, leader, end);
        if (drive <= 0) {
            const double left = loss_left(w, leader, end);
            if (left >= 0) continue;
            if (!begin_known) internal_torques(w, mode, begin);
            begin_known = true;
            const double before = loss_left(w, leader, begin);
            const double theta = before / (before - left);
            if (before > 0 && (first.device < 0 || theta < first.theta))
                first = {m.pairs + leader, theta, Change::limit};
            continue;
        }
        const double before = std::min(release_drive(w, mode, leader, begin), 0.);
        const double theta = before / (before - drive);
        if (first.device < 0 || theta < first.theta) first = {m.pairs + leader, theta, Change::release};
    }
    w.scratch.turned = false;
    double size = 0;
    const double small = m.description.maximum_parts == 1 ? small_loss : small_loss_of_parts;
    for (int k = m.pairs; k < m.contact_bytes; ++k) {
        if (w.contact[k] == stuck || mode.bound[k] || !mesh_of(w, k - m.pairs).lossy()) continue;
        const double g1 = turning_margin(w, k, end);
        if (g1 >= 0) continue;
        w.scratch.turned = true;
        if (mode.tree) continue;
        if (size == 0) size = torque_scale(w, end);
        if (g1 * loss_difference(mesh_of(w, k - m.pairs)) >= -small * size) continue;
        if (!middle_known) internal_torques(w, mode, w.scratch.half);
        middle_known = true;
        const double g0 = turning_margin(w, k, begin), gm = turning_margin(w, k, w.scratch.half);
        if (g0 <= 0) continue;  // just turned: it is within rounding of the point where both losses agree
        const double theta = parabola_root(g0, 4 * gm - 3 * g0 - g1, g1);
        if (first.device < 0 || theta < first.theta) first = {k, theta, Change::turn};
    }
    return first;
}

bool change_state(Work& w, int device, Sample& s) SHIFTRIG_REALTIME {
    if (device < w.model.pairs && w.contact[device] == locked) {
        const Mode& mode = find_mode(w.model, w.operators, w.contact, w.scratch);
        if (lean_on_losses(w, mode, most_used(w, w.contact, s).share, s)) return false;
        open(w, mode, device, s);
    } else {
        close(w, device, s);
    }
    return true;
}

void change_all(Work& w, const Mode& mode, Sample& s) SHIFTRIG_REALTIME {
    unsigned char* list = w.scratch.violations.data();
    for (int k = 0; k < w.model.contact_bytes; ++k) list[k] = violated(w, mode, k, s);
    for (int k = 0; k < w.model.contact_bytes; ++k) {
        const bool closed = k < w.model.pairs ? w.contact[k] == locked : w.contact[k] == stuck;
        if (!list[k]) continue;
        if (k < w.model.pairs && closed) {
            open(w, find_mode(w.model, w.operators, w.contact, w.scratch), k, s);
        } else if (!closed) {
            close(w, k, s);
        }
    }
    // A join with residual slip may have turned others round.
    for (int k = 0; k < w.model.contact_bytes; ++k) {
        const double slip = device_slip(w, k, s.z);
        if (std::fabs(slip) <= at_rest) continue;
        if (k < w.model.pairs) {
            if (slips(w.contact[k])) w.contact[k] = slipping(slip);
        } else if (w.contact[k] != stuck) {
            w.contact[k] = moving(slip, loss_exponent(w.contact[k]));
        }
    }
}

}  // namespace shiftrig::plant::detail
