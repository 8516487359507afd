// In J^(−1/2)-scaled speeds, with A and Â the columns of all meshes (those at rest without loss), c_i and ĉ_i those of the
// devices at rest i, y_i their torques (of a mesh: its loss torque):
//
//   M = G⁻¹ Aᵀ (M̃ − Σ ĉ_i y_i),  G = Aᵀ Â                torques of the meshes, [Algin] eq. (15)
//   a_i = c_iᵀ (M̃ − Â M − Σ ĉ_j y_j) = b_i − Σ W_ij y_j   accelerations of the slips
//   y_i = upper − p_i = lower + r_i                        p, r ≥ 0: what is left of the limits on both sides
//   a_i = α_i − β_i,  α_i p_i = 0,  β_i r_i = 0            forward only at the upper limit, backward only at the lower
//
// The limits of a pair are ± its capacity, those of a mesh f(M) and −f(−M), where M is its torque and f the larger of two lines: on
// its first link the loss is (1 − η) M + o if that drives, (1 − 1/η') M + o' if it is driven. With κ where they cross,
// δ = 1/η' − η and
//
//   M − κ = u − v,  u v = 0,   f(M) = (1 − η) M + o + δ v,   likewise u', v' for −M
//
// everything is linear but for the products. Eliminating y leaves w − N z = q for w = (α, r, u, u'), z = (p, β, v, v').
#include "plant/standstill.h"

#include <algorithm>
#include <cmath>

#include "plant/complementarity.h"
#include "plant/dense.h"
#include "plant/devices.h"
#include "plant/settling.h"
#include "plant/stuck_meshes.h"
#include "plant/transitions.h"

namespace shiftrig::plant::detail {
namespace {

constexpr int most_joints = 16;
constexpr double at_its_limit = 1e-6;  // a pair that gives way holds so much less: well above rounding
constexpr double most_give = 1e-5;
constexpr double resting = 1e-12;  // share of the accelerations there could be: none

// A pair or a mesh at rest.
struct Joint {
    int device = -1;
    int mesh = -1;                // its number among all meshes, −1: a pair
    int bend = -1;                // its number among the meshes at rest
    double upper = 0, lower = 0;  // limits of a pair; of a mesh o and −o
    double slope = 0;             // 1 − η
    double difference = 0;        // δ
    double kink = 0;              // κ
    double scale = 1;             // √W_ii: torques are counted in 1/scale, accelerations in scale
    double give = 0;              // of W_ii, where loads are shared out
};

struct Rest {
    Joint joints[most_joints];
    int count = 0, bends = 0;
    int basis[4 * most_joints];
    double* free = nullptr;    // J^(−1/2) M̃, then per joint −J^(−1/2) ĉ; masses × (1 + joints)
    double* motion = nullptr;  // J^(−1/2) c, masses × joints
    double* mesh = nullptr;    // M: meshes × (1 + joints)
    double *columns = nullptr, *forces = nullptr;  // J^(−1/2) A, Â: masses × meshes
    double* g = nullptr;                           // G
    double* w = nullptr;                           // W, joints × joints, by rows like the next two
    double* response = nullptr;                    // of y to what a limit gives, joints × joints
    double* turn = nullptr;                        // of M to it, of meshes at rest
    double *left = nullptr, *inverse = nullptr;
    double *b = nullptr, *y = nullptr, *torque = nullptr;  // M of meshes at rest, at y
    double* tableau = nullptr;

    int size() const { return 2 * count + 2 * bends; }
};

int most_devices(const ModelData& m) {
    return std::min(most_joints, m.pairs + static_cast<int>(m.lossy_meshes.size()));
}

bool is_still(const Work& w, const Mode& mode, int device, const Sample& s) {
    return mode.bound[device] != 0 ||
           std::fabs(device_slip(w, device, s.z)) <= 1e-13 * slip_scale(w, device, s.z);
}

template <typename Links>
void set_column(const ModelData& m, const Links& links, double* column, double sign = 1) {
    std::fill(column, column + m.masses, 0.);
    for (const Link& link : links) {
        if (link.mass >= 0)
            column[link.mass] += sign * link.factor / m.root_inertia[static_cast<std::size_t>(link.mass)];
    }
}

std::array<Link, 2> loss_links(const Mesh& mesh) {
    return {Link{mesh.second, mesh.ratio}, Link{mesh.carrier, -mesh.ratio}};
}

// Hands out `memory`; returns how much of it that takes.
int place(const ModelData& m, Rest& rest, double* memory) {
    const int n = most_devices(m), bends = std::min(n, static_cast<int>(m.lossy_meshes.size()));
    const int size = 2 * n + 2 * bends;
    double* at = memory;
    const auto take = [&](double*& part, int doubles) {
        part = at;
        at += doubles;
    };
    take(rest.free, m.masses * (1 + n));
    take(rest.motion, m.masses * n);
    take(rest.mesh, m.meshes * (1 + n));
    take(rest.columns, m.masses * m.meshes);
    take(rest.forces, m.masses * m.meshes);
    take(rest.g, m.meshes * m.meshes);
    for (double** part : {&rest.w, &rest.response, &rest.turn, &rest.left}) take(*part, n * n);
    take(rest.inverse, n * (n + 1));
    for (double** part : {&rest.b, &rest.y, &rest.torque}) take(*part, n);
    take(rest.tableau, size * lemke_columns(size));
    return static_cast<int>(at - memory);
}

// Everything at rest; false: too much.
bool list_joints(const Work& w, const Mode& mode, const Sample& s, Rest& rest) {
    const ModelData& m = w.model;
    for (int k = 0; k < m.first_flank; ++k) {
        const unsigned char state = w.contact[k];
        const bool closed = k < m.pairs ? state == locked : state == stuck;
        if (k < m.pairs ? state == free_running : !mesh_of(w, k - m.pairs).lossy()) continue;
        if (!closed && !is_still(w, mode, k, s)) continue;
        if (rest.count == most_devices(m)) return false;
        Joint& joint = rest.joints[rest.count++];
        joint = {.device = k};
        if (k < m.pairs) continue;
        const Mesh& mesh = mesh_of(w, k - m.pairs);
        joint.mesh = k - m.pairs;
        joint.bend = rest.bends++;
        joint.upper = mesh.forward_bearing;
        joint.lower = -mesh.forward_bearing;
        joint.slope = 1 - mesh.forward_efficiency;
        joint.difference = loss_difference(mesh);
        joint.kink = loss_kink(w, joint.mesh, 1);
    }
    return true;
}

// Torque limits of a pair: what it can hold, or, once it broke away in this instant, what it passes on sliding.
void set_limits(const Work& w, const Sample& s, Joint& joint) {
    const int k = joint.device;
    const bool overcome = w.scratch.overcome[static_cast<std::size_t>(k)] != 0;
    const double capacity = overcome ? s.sliding[k] : std::max(s.holding[k], s.sliding[k]);
    const FreewheelLaw* law = freewheel_of(w, k);
    joint.upper = law && law->sense < 0 ? law->drag : capacity;
    joint.lower = law && law->sense > 0 ? -law->drag : -capacity;
}

// M̃ without the devices at rest: the sample's forces are those with all of them closed.
void free_torques(const Work& w, const Mode& mode, const Sample& s, double* torque) {
    const ModelData& m = w.model;
    std::fill(torque, torque + m.masses, 0.);
    const auto act = [&](const std::array<Link, 2>& links, double effort) {
        for (const Link& link : links) {
            if (link.mass >= 0)
                torque[link.mass] -=
                    link.factor * effort / m.root_inertia[static_cast<std::size_t>(link.mass)];
        }
    };
    for (int k = 0; k < m.forces; ++k) act(m.force_columns[static_cast<std::size_t>(k)], s.f[k]);
    for (int e = 0; e < m.twists; ++e) {
        const Elastic& shaft = m.structure.shafts[static_cast<std::size_t>(e)];
        if (!is_shaft_closed(m, mode, e)) continue;
        act(shaft.links, shaft.stiffness * s.z[m.masses + e] + shaft.damping * slip_of(shaft.links, s.z));
    }
    for (const Elastic& damper : m.structure.dampers)
        act(damper.links, damper.damping * slip_of(damper.links, s.z));
}

// b, W and the meshes' torques; false where the meshes alone leave their torques open, or hold a pair.
bool set_up(const Work& w, const Mode& mode, const Sample& s, Rest& rest) {
    const ModelData& m = w.model;
    const int n = m.masses, count = rest.count, meshes = m.meshes;
    free_torques(w, mode, s, rest.free);
    for (int i = 0; i < count; ++i) {
        const int k = rest.joints[i].device;
        double* const pull = rest.free + (1 + i) * n;
        if (k < m.pairs) {
            set_column(m, pair_links(w, k), rest.motion + i * n);
            set_column(m, pair_links(w, k), pull, -1);
        } else {
            set_column(m, mesh_of(w, k - m.pairs).motion(), rest.motion + i * n);
            set_column(m, loss_links(mesh_of(w, k - m.pairs)), pull, -1);
        }
    }
    for (int k = 0; k < meshes; ++k) {
        const Mesh& mesh = mesh_of(w, k);
        bool rests = false;
        for (int i = 0; i < count; ++i) rests = rests || rest.joints[i].device == m.pairs + k;
        double* const column = rest.columns + k * n;  // of length 1
        set_column(m, mesh.column(mesh.ratio), column);
        const double length = std::sqrt(dot(column, column, n));
        for (int j = 0; j < n; ++j) column[j] /= length;
        const int x = rests || !mesh.lossy() ? 0 : loss_exponent(w.contact[m.pairs + k]);
        set_column(m, mesh.column(mesh.force_ratio(x)), rest.forces + k * n);
    }
    for (int c = 0; c <= count; ++c) {
        for (int k = 0; k < meshes; ++k)
            rest.mesh[c * meshes + k] = dot(rest.columns + k * n, rest.free + c * n, n);
    }
    double largest = 0;
    for (int k = 0; k < meshes; ++k) {
        for (int l = 0; l < meshes; ++l) {
            double& g = rest.g[l * meshes + k];
            g = dot(rest.columns + k * n, rest.forces + l * n, n);
            largest = std::max(largest, std::fabs(g));
        }
    }
    solve(rest.g, meshes, rest.mesh, 1 + count);
    for (int k = 0; k < meshes; ++k) {  // the pivots
        if (!(std::fabs(rest.g[k * meshes + k]) > 1e-10 * largest)) return false;
    }
    for (int c = 0; c <= count; ++c) {
        for (int k = 0; k < meshes; ++k)
            add_scaled(rest.free + c * n, -rest.mesh[c * meshes + k], rest.forces + k * n, n);
    }
    for (int i = 0; i < count; ++i) {
        const double* const motion = rest.motion + i * n;
        rest.b[i] = dot(motion, rest.free, n);
        for (int j = 0; j < count; ++j) rest.w[i * count + j] = -dot(motion, rest.free + (1 + j) * n, n);
        const double mobility = rest.w[i * count + i];
        if (!(mobility > 1e-12 * dot(motion, motion, n))) return false;
        rest.joints[i].scale = std::sqrt(mobility);
    }
    // The weights of build_mode().
    double heaviest = 0, most = 0;
    for (const FrictionPair& pair : m.structure.pairs) heaviest = std::max(heaviest, pair.nominal_capacity);
    for (int pass = 0; pass < 2; ++pass) {
        for (int i = 0; i < count; ++i) {
            Joint& joint = rest.joints[i];
            const double weight =
                joint.mesh < 0 ? m.structure.pairs[static_cast<std::size_t>(joint.device)].nominal_capacity
                               : 1e-3 * (heaviest > 0 ? heaviest : 1);
            const double give = 1 / (weight * joint.scale * joint.scale);
            most = std::max(most, give);
            joint.give = most_give * give / most;
        }
    }
    return true;
}

// One complementarity problem, with the limits as they stand; leaves the torques of its solution in y and `torque`.
// `shared_out`: every joint gives a little under its torque, the less the larger its nominal capacity. Of all splits of a load
// that is not unique, that is the one which the mode with the same states has.
bool solve_once(const ModelData& m, bool shared_out, Rest& rest) {
    const int count = rest.count, meshes = m.meshes, size = rest.size(), columns = lemke_columns(size);
    const auto row_of = [&](const double* matrix, int i) { return matrix + i * count; };
    // (I − H C) y = H M_0 + o + δ v − p, where M = M_0 + C y and H holds the slopes.
    for (int i = 0; i < count; ++i) {
        const Joint& joint = rest.joints[i];
        for (int j = 0; j < count; ++j) {
            const double follows = joint.mesh < 0 ? 0 : rest.mesh[(1 + j) * meshes + joint.mesh];
            rest.left[j * count + i] = (i == j ? 1 : 0) - joint.slope * follows;
            rest.inverse[j * count + i] = i == j ? 1 : 0;
        }
        rest.inverse[count * count + i] =
            joint.upper + (joint.mesh < 0 ? 0 : joint.slope * rest.mesh[joint.mesh]);
    }
    solve(rest.left, count, rest.inverse, count + 1);
    std::copy(rest.inverse + count * count, rest.inverse + count * (count + 1), rest.y);
    for (int i = 0; i < count; ++i) {
        for (int j = 0; j < count; ++j) rest.response[i * count + j] = rest.inverse[j * count + i];
    }
    const auto mobility = [&](int i, int j) {
        const double w = rest.w[i * count + j];
        return shared_out && i == j ? w * (1 + rest.joints[i].give) : w;
    };
    const auto turns = [&](int mesh, int j) {
        double sum = 0;
        for (int l = 0; l < count; ++l)
            sum += rest.mesh[(1 + l) * meshes + mesh] * rest.response[l * count + j];
        return sum;
    };
    double largest = 0;  // rows are counted in it: numbers of one size
    for (int i = 0; i < count; ++i) {
        const Joint& joint = rest.joints[i];
        rest.torque[i] = 0;
        largest = std::max({largest, std::fabs(rest.b[i]) / joint.scale, std::fabs(rest.y[i]) * joint.scale});
        if (joint.mesh < 0) continue;
        rest.torque[i] = rest.mesh[joint.mesh];
        for (int j = 0; j < count; ++j) {
            rest.torque[i] += rest.mesh[(1 + j) * meshes + joint.mesh] * rest.y[j];
            rest.turn[i * count + j] = turns(joint.mesh, j);
        }
        largest = std::max(largest, std::fabs(rest.torque[i]) * joint.scale);
    }
    if (!(largest > 0)) return false;
    std::fill(rest.tableau, rest.tableau + size * columns, 0.);
    const int bends = rest.bends;
    for (int i = 0; i < count; ++i) {
        const Joint& joint = rest.joints[i];
        const int bend = joint.bend;
        // Of w_r = N z + q the entries of −N at p_j, and at v_j, which acts like −δ_j p_j.
        const auto set_row = [&](int r, const auto& entry, double constant, double unit) {
            double* const row = rest.tableau + r * columns;
            row[r] = 1;
            for (int j = 0; j < count; ++j) {
                const Joint& other = rest.joints[j];
                const double value = entry(j) * unit / other.scale;  // of −p_j
                row[size + j] = value;
                if (other.bend >= 0) row[size + 2 * count + other.bend] = -other.difference * value;
            }
            row[columns - 1] = constant * unit / largest;
            return row;
        };
        double acceleration = rest.b[i];
        for (int j = 0; j < count; ++j) acceleration -= mobility(i, j) * rest.y[j];
        double* const slip = set_row(
            i,
            [&](int j) {
                double gain = 0;
                for (int l = 0; l < count; ++l) gain += mobility(i, l) * rest.response[l * count + j];
                return -gain;
            },
            acceleration, 1 / joint.scale);
        slip[size + count + i] = -1;  // β
        const double *const response = row_of(rest.response, i), *const turn = row_of(rest.turn, i);
        double low = joint.lower;
        if (bend >= 0) low += joint.slope * rest.torque[i];
        double* const room = set_row(
            count + i, [&](int j) { return response[j] - (bend < 0 ? 0 : joint.slope * turn[j]); },
            rest.y[i] - low, joint.scale);
        if (bend < 0) continue;
        room[size + 2 * count + bends + bend] = -joint.difference;  // v'
        double* const ahead = set_row(
            2 * count + bend, [&](int j) { return turn[j]; }, rest.torque[i] - joint.kink, joint.scale);
        double* const behind = set_row(
            2 * count + bends + bend, [&](int j) { return -turn[j]; }, -rest.torque[i] - joint.kink,
            joint.scale);
        ahead[size + 2 * count + bend] -= 1;
        behind[size + 2 * count + bends + bend] -= 1;
    }
    if (!solve_complementarity(rest.tableau, rest.basis, size)) return false;
    for (int r = 0; r < size; ++r) {
        const int z = rest.basis[r] - size;  // p_j or v_j
        const double value = rest.tableau[r * columns + columns - 1] * largest;
        for (int j = 0; j < count; ++j) {
            const Joint& other = rest.joints[j];
            double gives = 0;
            if (z == j) gives = -value / other.scale;
            if (other.bend >= 0 && z == 2 * count + other.bend)
                gives = other.difference * value / other.scale;
            if (gives == 0) continue;
            for (int i = 0; i < count; ++i) {
                rest.y[i] += rest.response[i * count + j] * gives;
                if (rest.joints[i].bend >= 0) rest.torque[i] += rest.turn[i * count + j] * gives;
            }
        }
    }
    return true;
}

// Where joint i is: 0 within its limits, +1 at the upper one, −1 at the lower one. `going`: its share of acceleration.
int side_of(const Rest& rest, int i, double& going) {
    const int count = rest.count, size = rest.size(), columns = lemke_columns(size);
    double forward = -1, backward = -1;  // not in the basis
    for (int r = 0; r < size; ++r) {
        const double value = std::max(rest.tableau[r * columns + columns - 1], 0.);
        if (rest.basis[r] == i) forward = value;
        if (rest.basis[r] == size + count + i) backward = value;
    }
    going = std::max({forward, backward, 0.});
    if (forward < 0 && backward < 0) return 0;
    return forward >= backward ? 1 : -1;
}

unsigned char state_of(const Rest& rest, int i, int side) {
    const Joint& joint = rest.joints[i];
    if (joint.mesh < 0) return side == 0 ? static_cast<unsigned char>(locked) : slipping(side);
    if (side == 0) return stuck;
    return moving(side, (rest.torque[i] - side * joint.kink) * side < 0 ? -1 : 1);
}

// Are these contact states a solution as well, with torques as their mode shares them out? Turns loss directions on the way.
bool is_consistent(Work& w, unsigned char* contact, Sample& s) {
    const ModelData& m = w.model;
    contact_forces(w, contact, s);
    const Mode& mode = find_directions(w, contact, s);
    const double size = torque_scale(w, s);
    if (is_overloaded(w, most_used(w, contact, s).pair, s)) return false;
    for (int r = mode.row_count - 1; r >= 0 && mode.rows[r] >= m.pairs + m.meshes; --r) {
        if (loss_left(w, mode.rows[r] - m.pairs - m.meshes, s) < -1e-9 * size) return false;
    }
    sample_rate(w, mode, s);
    for (int k = 0; k < m.first_flank; ++k) {
        const unsigned char state = contact[k];
        const bool open = k < m.pairs ? slips(state) : state != stuck && mesh_of(w, k - m.pairs).lossy();
        if (!open || mode.bound[k] || !is_still(w, mode, k, s)) continue;
        const double sign = k < m.pairs ? slip_sign(state) : motion_sign(state);
        if (sign * device_slip(w, k, s.rate) < -1e-9 * slip_scale(w, k, s.rate)) return false;
    }
    return true;
}

}  // namespace

int standstill_workspace(const ModelData& m) noexcept {
    Rest rest;
    double none = 0;
    return place(m, rest, &none);
}

Rearrangement rearrange(Work& w, int gives_way, Sample& s) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    const Mode& mode = find_mode(m, w.operators, w.contact, w.scratch);
    Rest rest;
    if (mode.tree) return Rearrangement::none;
    place(m, rest, w.scratch.standstill.data());
    if (!list_joints(w, mode, s, rest) || rest.count == 0) return Rearrangement::none;
    unsigned char* const trial = w.scratch.trial.data();
    std::copy(w.contact, w.contact + m.contact_bytes, trial);
    for (int i = 0; i < rest.count; ++i) trial[rest.joints[i].device] = 0;  // locked, stuck
    contact_forces(w, trial, s);
    const bool known = set_up(w, mode, s, rest);
    contact_forces(w, w.contact, s);
    if (!known) return Rearrangement::none;

    unsigned char* const overcome = w.scratch.overcome.data();
    unsigned char given_way[most_joints] = {};
    const double given = gives_way < 0 ? 0 : s.torque[gives_way];
    const auto forget = [&] {
        for (int i = 0; i < rest.count; ++i) {
            if (given_way[i]) overcome[rest.joints[i].device] = 0;
        }
        return Rearrangement::none;
    };
    const auto solve_with = [&](bool shared_out) {
        for (int i = 0; i < rest.count; ++i) {
            Joint& joint = rest.joints[i];
            if (joint.mesh < 0) set_limits(w, s, joint);
            if (joint.device != gives_way) continue;
            const double limit = given * (1 - at_its_limit);
            if (limit > 0) joint.upper = std::min(joint.upper, limit);
            if (limit < 0) joint.lower = std::max(joint.lower, limit);
        }
        return solve_once(m, shared_out, rest);
    };
    const auto has_reserve = [&](int device) {
        return device < m.pairs && !overcome[device] && s.sliding[device] < s.holding[device];
    };
    const auto break_away = [&](int i) { overcome[rest.joints[i].device] = given_way[i] = 1; };
    int giving = 0;
    while (giving < rest.count && rest.joints[giving].device != gives_way) ++giving;
    const bool breaks_away = giving < rest.count && has_reserve(gives_way);
    // The one that is beyond its limit breaks away first, and passes less from then on; others may only take its load where
    // mechanics does not say how they share it.
    if (breaks_away && !(mode.bound[gives_way] & shares_load)) break_away(giving);
    bool goes = false;
    unsigned char vertex[most_joints], going[most_joints];  // states that follow; does it go?
    bool found = false;
    while (!found) {
        if (!solve_with(false)) return forget();
        goes = false;
        for (int i = 0; i < rest.count; ++i) {
            double share;
            const int side = side_of(rest, i, share);
            vertex[i] = state_of(rest, i, side);
            going[i] = share > resting;
            goes = goes || going[i];
        }
        if (goes && breaks_away && !overcome[gives_way]) {
            break_away(giving);
            continue;
        }
        // As few changes as do, so that torques that are not unique stay nearly what they were; else as the load is shared
        // out; else whatever solves it.
        const auto take = [&](const auto& state) {
            std::copy(w.contact, w.contact + m.contact_bytes, trial);
            for (int i = 0; i < rest.count; ++i) trial[rest.joints[i].device] = state(i);
            return is_consistent(w, trial, s);
        };
        found = take([&](int i) {
            const int device = rest.joints[i].device;
            if (going[i]) return vertex[i];
            if (goes || device != gives_way) return w.contact[device];
            return slipping(opening_sense(w, device, given));
        });
        if (!found && solve_with(true)) {
            found = take([&](int i) {
                double share;
                return going[i] ? vertex[i] : state_of(rest, i, side_of(rest, i, share));
            });
        }
        if (found) break;
        // A pair at its limit that passes less on sliding breaks away: the others have to do with that.
        bool breaks = false;
        for (int i = 0; i < rest.count; ++i) {
            if (vertex[i] == locked || !has_reserve(rest.joints[i].device)) continue;
            break_away(i);
            breaks = true;
        }
        if (breaks) continue;
        found = take([&](int i) { return vertex[i]; });
        if (!found) break;
    }
    contact_forces(w, w.contact, s);
    internal_torques(w, find_mode(m, w.operators, w.contact, w.scratch), s);
    if (!found) return forget();
    // Meshes of one motion that share their losses in another way are no change; when they go, release_drive() says.
    const int relevant = goes ? m.contact_bytes : m.pairs;
    if (std::equal(trial, trial + relevant, w.contact)) return forget();
    for (int k = 0; k < m.first_flank; ++k) {
        const bool was = k < m.pairs ? w.contact[k] == locked : w.contact[k] == stuck;
        const bool is = k < m.pairs ? trial[k] == locked : trial[k] == stuck;
        if (was == is) continue;
        if (k < m.pairs) {
            const double limit = was ? static_limit(w, k, s) : s.holding[k];
            log_event(w, was ? EventKind::break_away : EventKind::lock, k, s.at.time, s.torque[k], limit, 0);
            if (was) overcome[k] = 1;
        } else if (was) {
            const LossAtRest loss = loss_at_rest(w, k - m.pairs, s);
            log_event(w, EventKind::mesh_releases, k, s.at.time, loss.needed, loss.allowed, 0);
        } else {
            log_event(w, EventKind::mesh_sticks, k, s.at.time, 0, 0, 0);
        }
    }
    std::copy(trial, trial + m.contact_bytes, w.contact);
    contact_forces(w, w.contact, s);
    return goes ? Rearrangement::moves : Rearrangement::stands;
}

}  // namespace shiftrig::plant::detail
