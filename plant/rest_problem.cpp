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

int rest_workspace(const ModelData& m) noexcept {
    RestProblem rest;
    return place(m, rest, nullptr);
}

}  // namespace shiftrig::plant::detail
