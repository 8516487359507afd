#include "plant/rest_problem.h"

#include <algorithm>
#include <cmath>

#include "plant/complementarity.h"
#include "plant/dense.h"
#include "plant/devices.h"

namespace shiftrig::plant::detail {
namespace {

constexpr double most_give = 1e-5;  // of the mobility, where loads are shared out

int most_devices(const ModelData& m) {
    return std::min(most_joints, m.pairs + static_cast<int>(m.lossy_meshes.size()));
}

template <typename Links>
void set_column(const ModelData& m, const Links& links, double* column, double sign = 1) {
    std::fill(column, column + m.masses, 0.);
    for (const Link& link : links) {
        if (link.mass >= 0)
            column[link.mass] += sign * link.factor / m.root_inertia[static_cast<std::size_t>(link.mass)];
    }
}

// Hands out `memory`, if there is any; returns how much of it that takes.
int place(const ModelData& m, RestProblem& rest, double* memory) {
    const int n = most_devices(m), bends = std::min(n, static_cast<int>(m.lossy_meshes.size()));
    const int size = 2 * n + 2 * bends;
    int used = 0;
    const auto take = [&](double*& part, int doubles) {
        part = memory ? memory + used : nullptr;
        used += doubles;
    };
    if (m.tree) {
        TrainWork& trains = rest.trains;
        for (double** part : {&rest.free, &trains.ratio, &trains.force_ratio, &trains.mass, &trains.load,
                              &trains.sum, &trains.moment})
            take(*part, m.masses);
        take(rest.mesh, bends * (1 + n));
    } else {
        take(rest.free, m.masses * (1 + n));
        take(rest.motion, m.masses * n);
        take(rest.mesh, m.meshes * (1 + n));
        take(rest.columns, m.masses * m.meshes);
        take(rest.forces, m.masses * m.meshes);
        take(rest.g, m.meshes * m.meshes);
    }
    for (double** part : {&rest.w, &rest.response, &rest.turn, &rest.left}) take(*part, n * n);
    take(rest.inverse, n * (n + 1));
    for (double** part : {&rest.b, &rest.y, &rest.torque}) take(*part, n);
    take(rest.tableau, size * lemke_columns(size));
    return used;
}

// Does the device rest at the sample, as one that could hold something?
bool is_joint(const Work& w, const Mode& mode, int k, const Sample& s) {
    const bool pair = k < w.model.pairs;
    const unsigned char state = w.contact[k];
    if (pair ? state == free_running : !mesh_of(w, k - w.model.pairs).lossy()) return false;
    return (pair ? state == locked : state == stuck) || is_still(w, mode, k, s);
}

// Everything at rest in the piece; false: too much.
bool list_joints(const Work& w, const Mode& mode, const Sample& s, const Piece& piece, RestProblem& rest) {
    const ModelData& m = w.model;
    rest.mesh_rows = mode.tree ? 0 : m.meshes;
    for (int k = 0; k < m.first_flank; ++k) {
        if (!is_joint(w, mode, k, s) || !piece.holds(k)) continue;
        if (rest.count == most_devices(m)) return false;
        RestJoint& joint = rest.joints[rest.count++];
        joint = {.device = k};
        if (k < m.pairs) continue;
        const Mesh& mesh = mesh_of(w, k - m.pairs);
        joint.mesh = k - m.pairs;
        joint.bend = rest.bends++;
        joint.row = mode.tree ? rest.mesh_rows++ : joint.mesh;
        joint.upper = mesh.forward_bearing;
        joint.lower = -mesh.forward_bearing;
        joint.slope = 1 - mesh.forward_efficiency;
        joint.difference = loss_difference(mesh);
        joint.kink = loss_kink(w, joint.mesh, 1);
    }
    return true;
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
bool set_up(const Work& w, RestProblem& rest) {
    const ModelData& m = w.model;
    const int n = m.masses, count = rest.count, meshes = m.meshes;
    for (int i = 0; i < count; ++i) {
        const int k = rest.joints[i].device;
        double* const pull = rest.free + (1 + i) * n;
        if (k < m.pairs) {
            set_column(m, pair_links(w, k), rest.motion + i * n);
            set_column(m, pair_links(w, k), pull, -1);
        } else {
            set_column(m, mesh_of(w, k - m.pairs).motion(), rest.motion + i * n);
            set_column(m, mesh_of(w, k - m.pairs).loss(), pull, -1);
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
    return true;
}

// How much each joint gives where loads are shared out: the less the larger its weight. Pairs weigh what they nominally hold.
void set_gives(const Work& w, RestProblem& rest, double mesh_weight, double RestJoint::*give) {
    const ModelData& m = w.model;
    double most = 0;
    for (int i = 0; i < rest.count; ++i) {
        RestJoint& joint = rest.joints[i];
        const double weight = joint.mesh < 0
                                  ? m.structure.pairs[static_cast<std::size_t>(joint.device)].nominal_capacity
                                  : mesh_weight * mesh_of(w, joint.mesh).first_link_weight();
        joint.*give = 1 / (weight * joint.scale * joint.scale);
        most = std::max(most, joint.*give);
    }
    for (int i = 0; i < rest.count; ++i) rest.joints[i].*give *= most_give / most;
}

}  // namespace

bool is_still(const Work& w, const Mode& mode, int device, const Sample& s) SHIFTRIG_REALTIME {
    return mode.bound[device] != 0 ||
           std::fabs(device_slip(w, device, s.z)) <= 1e-13 * slip_scale(w, device, s.z);
}

bool is_too_much(const Work& w, const Mode& mode, const Piece& piece, const Sample& s) SHIFTRIG_REALTIME {
    int count = 0;
    for (int k = 0; k < w.model.first_flank; ++k) count += is_joint(w, mode, k, s) && piece.holds(k);
    return count > most_joints;
}

bool pose_rest_problem(Work& w, const Mode& mode, int around, Sample& s,
                       RestProblem& rest) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    place(m, rest, w.scratch.standstill.data());
    const Piece piece = rest.piece = piece_around(w, mode, around, s);
    if (!list_joints(w, mode, s, piece, rest) || rest.count == 0) return false;
    if (mode.tree && rest.count == 1) return false;  // it goes, or it does not: no need to solve for that
    unsigned char* const closed = w.scratch.trial.data();
    std::copy(w.contact, w.contact + m.contact_bytes, closed);
    for (int i = 0; i < rest.count; ++i) closed[rest.joints[i].device] = 0;  // locked, stuck
    contact_forces(w, closed, s);
    free_torques(w, mode, s, rest.free);
    const bool posed = mode.tree ? set_up_trains(w, piece, rest) : set_up(w, rest);
    if (posed) {
        set_gives(w, rest, m.structure.loss_weight(), &RestJoint::give);
        set_gives(w, rest, m.structure.mesh_weight(), &RestJoint::give_on_losses);
    }
    contact_forces(w, w.contact, s);
    return posed;
}

bool solve_rest_problem(Split split, RestProblem& rest) SHIFTRIG_REALTIME {
    const int count = rest.count, meshes = rest.mesh_rows, size = rest.size(), columns = lemke_columns(size);
    const auto row_of = [&](const double* matrix, int i) { return matrix + i * count; };
    // Of the mirror image loads change their sign, and limits their sides.
    const double sense = rest.mirrored ? -1 : 1;
    const auto upper = [&](const RestJoint& joint) { return rest.mirrored ? -joint.lower : joint.upper; };
    const auto lower = [&](const RestJoint& joint) { return rest.mirrored ? -joint.upper : joint.lower; };
    // (I − H C) y = H M_0 + o + δ v − p, where M = M_0 + C y and H holds the slopes.
    for (int i = 0; i < count; ++i) {
        const RestJoint& joint = rest.joints[i];
        for (int j = 0; j < count; ++j) {
            const double follows = joint.mesh < 0 ? 0 : rest.mesh[(1 + j) * meshes + joint.row];
            rest.left[j * count + i] = (i == j ? 1 : 0) - joint.slope * follows;
            rest.inverse[j * count + i] = i == j ? 1 : 0;
        }
        rest.inverse[count * count + i] =
            upper(joint) + (joint.mesh < 0 ? 0 : joint.slope * sense * rest.mesh[joint.row]);
    }
    solve(rest.left, count, rest.inverse, count + 1);
    std::copy(rest.inverse + count * count, rest.inverse + count * (count + 1), rest.y);
    for (int i = 0; i < count; ++i) {
        for (int j = 0; j < count; ++j) rest.response[i * count + j] = rest.inverse[j * count + i];
    }
    const auto mobility = [&](int i, int j) {
        const double w = rest.w[i * count + j];
        if (split == Split::any || i != j) return w;
        const RestJoint& joint = rest.joints[i];
        return w * (1 + (split == Split::as_modes ? joint.give : joint.give_on_losses));
    };
    const auto turns = [&](int mesh_row, int j) {
        double sum = 0;
        for (int l = 0; l < count; ++l)
            sum += rest.mesh[(1 + l) * meshes + mesh_row] * rest.response[l * count + j];
        return sum;
    };
    double largest = 0;  // rows are counted in it: numbers of one size
    for (int i = 0; i < count; ++i) {
        const RestJoint& joint = rest.joints[i];
        rest.torque[i] = 0;
        largest = std::max({largest, std::fabs(rest.b[i]) / joint.scale, std::fabs(rest.y[i]) * joint.scale});
        if (joint.mesh < 0) continue;
        rest.torque[i] = sense * rest.mesh[joint.row];
        for (int j = 0; j < count; ++j) {
            rest.torque[i] += rest.mesh[(1 + j) * meshes + joint.row] * rest.y[j];
            rest.turn[i * count + j] = turns(joint.row, j);
        }
        largest = std::max(largest, std::fabs(rest.torque[i]) * joint.scale);
    }
    if (!(largest > 0)) return false;
    std::fill(rest.tableau, rest.tableau + size * columns, 0.);
    const int bends = rest.bends;
    for (int i = 0; i < count; ++i) {
        const RestJoint& joint = rest.joints[i];
        const int bend = joint.bend;
        // Of w_r = N z + q the entries of −N at p_j, and at v_j, which acts like −δ_j p_j.
        const auto set_row = [&](int r, const auto& entry, double constant, double unit) {
            double* const row = rest.tableau + r * columns;
            row[r] = 1;
            for (int j = 0; j < count; ++j) {
                const RestJoint& other = rest.joints[j];
                const double value = entry(j) * unit / other.scale;  // of −p_j
                row[size + j] = value;
                if (other.bend >= 0) row[size + 2 * count + other.bend] = -other.difference * value;
            }
            row[columns - 1] = constant * unit / largest;
            return row;
        };
        double acceleration = sense * rest.b[i];
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
        double low = lower(joint);
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
            const RestJoint& other = rest.joints[j];
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
    for (int i = 0; i < count; ++i) {
        rest.y[i] *= sense;
        rest.torque[i] *= sense;
    }
    return true;
}

int side_of(const RestProblem& rest, int i, double& going) SHIFTRIG_REALTIME {
    const int count = rest.count, size = rest.size(), columns = lemke_columns(size);
    double forward = -1, backward = -1;  // not in the basis
    for (int r = 0; r < size; ++r) {
        const double value = std::max(rest.tableau[r * columns + columns - 1], 0.);
        if (rest.basis[r] == i) forward = value;
        if (rest.basis[r] == size + count + i) backward = value;
    }
    going = std::max({forward, backward, 0.});
    if (forward < 0 && backward < 0) return 0;
    return (forward >= backward) != rest.mirrored ? 1 : -1;
}

unsigned char state_of(const RestProblem& rest, int i, int side) SHIFTRIG_REALTIME {
    const RestJoint& joint = rest.joints[i];
    if (joint.mesh < 0) return side == 0 ? static_cast<unsigned char>(locked) : slipping(side);
    if (side == 0) return stuck;
    return moving(side, (rest.torque[i] - side * joint.kink) * side < 0 ? -1 : 1);
}

int rest_workspace(const ModelData& m) noexcept {
    RestProblem rest;
    return place(m, rest, nullptr);
}

}  // namespace shiftrig::plant::detail
