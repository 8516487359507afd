// The rest problem on a tree. With every device at rest opened, only gears hold masses together: trains, each with one
// speed q, ω_j = r_j q, and force ratios r̂_j as in tree.h. So W and b need no matrices:
//
//   q̇ = Σ r̂_j M̃_j / Σ r̂_j r_j J_j,   a_i = c_iᵀ r q̇
//
// and the torques of the meshes follow from the leaves of each train to its root. One pass over the tree per joint.
#include <algorithm>
#include <cmath>

#include "plant/devices.h"
#include "plant/rest_problem.h"

namespace shiftrig::plant::detail {
namespace {

const TreeTopology::Edge& edge_of(const ModelData& m, int position) {
    return m.tree->edges[static_cast<std::size_t>(position)];
}
int position_of(const ModelData& m, int mass) {
    return m.tree->position[static_cast<std::size_t>(mass)];
}
double inertia_at(const ModelData& m, int position) {
    return m.structure.inertia[static_cast<std::size_t>(m.tree->mass[static_cast<std::size_t>(position)])];
}

// Factors of the mesh to the parent in its force column, at the position and at its parent.
struct Factors {
    double own, up;
};
Factors force_factors(const Work& w, int position, const RestProblem& rest) {
    const ModelData& m = w.model;
    const int device = edge_of(m, position).rigid;
    const Mesh& mesh = mesh_of(w, device - m.pairs);
    bool rests = false;
    for (int i = 0; i < rest.count; ++i) rests = rests || rest.joints[i].device == device;
    const double u = mesh.force_ratio(rests || !mesh.lossy() ? 0 : loss_exponent(w.contact[device]));
    const bool first = m.tree->mass[static_cast<std::size_t>(position)] == mesh.first;
    return {first ? 1 : -u, first ? -u : 1};
}

}  // namespace

bool set_up_trains(const Work& w, const Piece& piece, RestProblem& rest) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    const TrainWork& t = rest.trains;
    const int count = rest.count, wanted = piece.first;
    const auto in_train = [&](int p) { return edge_of(m, p).rigid >= m.pairs; };  // goes with its parent
    for (int p = wanted; p < m.masses; ++p) {
        if (piece.joined[p] != wanted) continue;
        const TreeTopology::Edge& edge = edge_of(m, p);
        t.ratio[p] = t.force_ratio[p] = 1;
        if (in_train(p)) {
            const Factors force = force_factors(w, p, rest);
            t.ratio[p] = -t.ratio[edge.parent] * edge.up / edge.own;
            t.force_ratio[p] = -t.force_ratio[edge.parent] * force.up / force.own;
        }
        t.mass[p] = t.force_ratio[p] * t.ratio[p] * inertia_at(m, p);
    }
    for (int p = m.masses; p-- > wanted;) {
        if (piece.joined[p] == wanted && in_train(p)) t.mass[edge_of(m, p).parent] += t.mass[p];
    }
    const auto slip_links = [&](int device) {
        return device < m.pairs ? pair_links(w, device) : mesh_of(w, device - m.pairs).motion();
    };
    for (int c = 0; c <= count; ++c) {
        for (int p = wanted; p < m.masses; ++p) {
            if (piece.joined[p] != wanted) continue;
            const auto mass = static_cast<std::size_t>(m.tree->mass[static_cast<std::size_t>(p)]);
            t.load[p] = c == 0 ? rest.free[mass] * m.root_inertia[mass] : 0;
        }
        if (c > 0) {
            const RestJoint& joint = rest.joints[c - 1];
            for (const Link& link :
                 joint.mesh < 0 ? pair_links(w, joint.device) : mesh_of(w, joint.mesh).loss()) {
                if (link.mass >= 0) t.load[position_of(m, link.mass)] -= link.factor;
            }
        }
        for (int p = wanted; p < m.masses; ++p) {
            if (piece.joined[p] == wanted) t.sum[p] = t.force_ratio[p] * t.load[p];
        }
        for (int p = m.masses; p-- > wanted;) {
            if (piece.joined[p] == wanted && in_train(p)) t.sum[edge_of(m, p).parent] += t.sum[p];
        }
        for (int p = wanted; p < m.masses; ++p) {  // q̇
            if (piece.joined[p] == wanted)
                t.sum[p] = in_train(p) ? t.sum[edge_of(m, p).parent] : t.sum[p] / t.mass[p];
        }
        for (int p = wanted; p < m.masses; ++p) {  // r q̇, and what it leaves
            if (piece.joined[p] != wanted) continue;
            t.sum[p] *= t.ratio[p];
            t.load[p] -= inertia_at(m, p) * t.sum[p];
        }
        for (int p = m.masses; p-- > wanted;) {
            if (piece.joined[p] != wanted || !in_train(p)) continue;
            const Factors force = force_factors(w, p, rest);
            t.moment[p] = t.load[p] / force.own;
            t.load[edge_of(m, p).parent] -= force.up * t.moment[p];
        }
        for (int i = 0; i < count; ++i) {
            const RestJoint& joint = rest.joints[i];
            double slip = 0;
            for (const Link& link : slip_links(joint.device)) {
                if (link.mass >= 0) slip += link.factor * t.sum[position_of(m, link.mass)];
            }
            if (c == 0) {
                rest.b[i] = slip;
            } else {
                rest.w[i * count + c - 1] = -slip;
            }
            if (joint.mesh < 0) continue;
            const Mesh& mesh = mesh_of(w, joint.mesh);
            const int first = position_of(m, mesh.first);
            const int child = edge_of(m, first).rigid == joint.device ? first : position_of(m, mesh.second);
            rest.mesh[c * rest.mesh_rows + joint.row] = t.moment[child];
        }
    }
    for (int i = 0; i < count; ++i) {
        double alone = 0;  // mobility if nothing but its own masses moved
        for (const Link& link : slip_links(rest.joints[i].device)) {
            if (link.mass >= 0) alone += link.factor * link.factor / inertia_at(m, position_of(m, link.mass));
        }
        const double mobility = rest.w[i * count + i];
        if (!(mobility > 1e-12 * alone)) return false;
        rest.joints[i].scale = std::sqrt(mobility);
    }
    return true;
}

}  // namespace shiftrig::plant::detail
