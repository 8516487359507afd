#include <algorithm>
#include <cmath>

#include "plant/ark3.h"
#include "plant/contact.h"
#include "plant/forces.h"
#include "plant/modes.h"
#include "plant/tree.h"

namespace shiftrig::plant::detail {

TreeSizes::TreeSizes(const ModelData& m) {
    const auto n = static_cast<std::size_t>(m.masses);
    const std::size_t grounds = m.tree->grounds.size() + static_cast<std::size_t>(m.meshes);
    doubles = 12 * n + grounds;
    integers = 4 * n + 2 * grounds;
    bytes = (n + 7) / 8 * 8;
}

void place_tree(const ModelData& m, TreeMode& t, double* doubles, int* integers,
                unsigned char* bytes) noexcept {
    const auto n = static_cast<std::size_t>(m.masses);
    const std::size_t grounds = m.tree->grounds.size() + static_cast<std::size_t>(m.meshes);
    for (double** array : {&t.ratio, &t.force_ratio, &t.mass, &t.drag, &t.stiffness, &t.damping, &t.inverse,
                           &t.lower, &t.edge_own, &t.edge_up, &t.network_inverse, &t.network_lower}) {
        *array = doubles;
        doubles += n;
    }
    t.ground_factor = doubles;
    for (int** array : {&t.group, &t.first, &t.parent, &t.edge}) {
        *array = integers;
        integers += n;
    }
    t.ground_position = integers;
    t.ground_unknown = integers + grounds;
    t.grounded = bytes;
}

namespace {

// Is the rigid device of this edge closed in the mode? Gears always are.
bool is_active(const ModelData& m, const Mode& mode, const TreeTopology::Edge& edge) {
    return edge.rigid >= m.pairs || (edge.rigid >= 0 && mode.key[edge.rigid] != 0);
}

// Groups in order of their first positions, kinematic ratios along them.
void find_groups(const ModelData& m, const Mode& mode, TreeMode& t) {
    t.groups = 0;
    t.edge_count = 0;
    for (int p = 0; p < m.masses; ++p) {
        const TreeTopology::Edge& edge = m.tree->edges[static_cast<std::size_t>(p)];
        if (is_active(m, mode, edge)) {
            t.group[p] = t.group[edge.parent];
            t.ratio[p] = -t.ratio[edge.parent] * edge.up / edge.own;
            ++t.edge_count;
            continue;
        }
        const int g = t.groups++;
        const bool hangs = edge.parent >= 0 && edge.rigid < 0;
        t.group[p] = g;
        t.first[g] = p;
        t.parent[g] = hangs ? t.group[edge.parent] : -1;
        t.ratio[p] = hangs ? t.ratio[edge.parent] : 1;
        t.grounded[g] = 0;
    }
}

// What holds a group: closed pairs to the housing; failing that, a stuck mesh.
void find_grounds(const ModelData& m, Mode& mode, TreeMode& t) {
    const TreeTopology& topology = *m.tree;
    t.ground_count = 0;
    mode.redundant = false;
    const auto hold = [&](int position, int unknown, double factor) {
        t.ground_position[t.ground_count] = position;
        t.ground_unknown[t.ground_count] = unknown;
        t.ground_factor[t.ground_count++] = factor;
    };
    for (const TreeTopology::Ground& ground : topology.grounds) {
        if (!mode.key[ground.pair]) continue;
        unsigned char& grounded = t.grounded[t.group[ground.position]];
        mode.redundant = mode.redundant || grounded != 0;
        grounded = 1;
        hold(ground.position, ground.pair, ground.factor);
    }
    for (int k = 0; k < m.meshes; ++k) {
        const Mesh& mesh = m.structure.meshes[static_cast<std::size_t>(k)];
        const int g = t.group[topology.position[static_cast<std::size_t>(mesh.first)]];
        mode.bound[m.pairs + k] = t.grounded[g] == 1;
        if (!mesh.lossy() || mode.key[m.pairs + k] != 0 || t.grounded[g] != 0) continue;
        t.grounded[g] = 2;
        mode.rows[mode.row_count++] = m.pairs + m.meshes + k;
        hold(topology.position[static_cast<std::size_t>(mesh.second)], m.pairs + m.meshes + k, mesh.ratio);
    }
    t.any_grounded = t.ground_count > 0;
    for (int k = 0; k < m.meshes; ++k) {
        const Mesh& mesh = m.structure.meshes[static_cast<std::size_t>(k)];
        if (t.grounded[t.group[topology.position[static_cast<std::size_t>(mesh.first)]]])
            mode.bound[m.pairs + k] |= 2;
    }
    for (int k = 0; k < m.pairs; ++k) {
        bool held = true;
        for (const Link& link : m.structure.pairs[static_cast<std::size_t>(k)].links) {
            if (link.mass >= 0)
                held = held && t.grounded[t.group[topology.position[static_cast<std::size_t>(link.mass)]]];
        }
        mode.bound[k] = held || mode.key[k];
    }
}

// Force ratios, group masses, links to the parents.
void weigh_groups(const ModelData& m, const Mode& mode, TreeMode& t) {
    const TreeTopology& topology = *m.tree;
    std::fill(t.mass, t.mass + t.groups, 0.);
    std::fill(t.drag, t.drag + t.groups, 0.);
    int next = t.edge_count;
    for (int p = 0; p < m.masses; ++p) {
        const auto i = static_cast<std::size_t>(p);
        const TreeTopology::Edge& edge = topology.edges[i];
        const int g = t.group[p];
        if (t.first[g] == p) {
            const bool hangs = t.parent[g] >= 0;
            t.force_ratio[p] = hangs ? t.force_ratio[edge.parent] : 1;
            const double square = t.force_ratio[p] * t.ratio[p];
            t.stiffness[g] = hangs ? square * edge.stiffness : 0;
            t.damping[g] = hangs ? square * edge.damping : 0;
        } else {
            double own = edge.own, up = edge.up;
            if (edge.rigid >= m.pairs) {
                const int k = edge.rigid - m.pairs;
                const Mesh& mesh = m.structure.meshes[static_cast<std::size_t>(k)];
                const unsigned char key = mode.key[edge.rigid];
                const double u = mesh.force_ratio(mode.bound[edge.rigid] || key == 0 ? 0 : key == 2 ? -1 : 1);
                const bool first = topology.mass[i] == mesh.first;
                own = first ? 1 : -u;
                up = first ? -u : 1;
            }
            t.force_ratio[p] = -t.force_ratio[edge.parent] * up / own;
            --next;
            t.edge[next] = p;
            t.edge_own[next] = own;
            t.edge_up[next] = up;
        }
        const double square = t.force_ratio[p] * t.ratio[p];
        t.mass[g] += square * m.structure.inertia[static_cast<std::size_t>(topology.mass[i])];
        t.drag[g] += square * topology.ground_damping[i];
    }
}

// S = Ĉ W Ĉᵀ of the grounded groups.
void factor_network(const ModelData& m, TreeMode& t) {
    const TreeTopology& topology = *m.tree;
    double* diagonal = t.network_inverse;
    std::fill(diagonal, diagonal + m.masses, 0.);
    for (int i = 0; i < t.ground_count; ++i) {
        diagonal[t.ground_position[i]] += topology.weight[static_cast<std::size_t>(t.ground_unknown[i])] *
                                          t.ground_factor[i] * t.ground_factor[i];
    }
    const auto weight = [&](int e) {
        return topology
            .weight[static_cast<std::size_t>(topology.edges[static_cast<std::size_t>(t.edge[e])].rigid)];
    };
    for (int e = 0; e < t.edge_count; ++e) {
        const int p = t.edge[e];
        if (!t.grounded[t.group[p]]) continue;
        diagonal[p] += weight(e) * t.edge_own[e] * t.edge_own[e];
        diagonal[topology.edges[static_cast<std::size_t>(p)].parent] +=
            weight(e) * t.edge_up[e] * t.edge_up[e];
    }
    for (int e = 0; e < t.edge_count; ++e) {  // children first
        const int p = t.edge[e];
        if (!t.grounded[t.group[p]]) continue;
        const double coupling = weight(e) * t.edge_own[e] * t.edge_up[e];
        t.network_lower[p] = coupling / diagonal[p];
        diagonal[topology.edges[static_cast<std::size_t>(p)].parent] -= coupling * t.network_lower[p];
    }
    for (int p = 0; p < m.masses; ++p) {
        if (t.grounded[t.group[p]]) t.network_inverse[p] = 1 / diagonal[p];
    }
}

}  // namespace

void build_tree_mode(const ModelData& m, Mode& mode) SHIFTRIG_REALTIME {
    TreeMode& t = *mode.tree;
    mode.row_count = 0;
    for (int k = 0; k < m.pairs; ++k) {
        if (mode.key[k]) mode.rows[mode.row_count++] = k;
    }
    for (int k = 0; k < m.meshes; ++k) mode.rows[mode.row_count++] = m.pairs + k;
    find_groups(m, mode, t);
    find_grounds(m, mode, t);
    weigh_groups(m, mode, t);
    if (t.any_grounded) factor_network(m, t);
    factor_stage(t, ark3_gamma * m.options.step_size, t.inverse, t.lower);
}

void factor_stage(const TreeMode& t, double weight, double* inverse, double* lower) SHIFTRIG_REALTIME {
    for (int g = 0; g < t.groups; ++g) inverse[g] = t.mass[g] + weight * t.drag[g];
    for (int g = t.groups - 1; g >= 0; --g) {
        lower[g] = 0;
        if (t.parent[g] >= 0) {
            const double coupling = weight * (t.damping[g] + weight * t.stiffness[g]);
            const double own = inverse[g] + coupling;
            double& above = inverse[t.parent[g]];
            above += coupling;
            if (!t.grounded[g] && !t.grounded[t.parent[g]]) {
                lower[g] = coupling / own;
                above -= coupling * lower[g];
            }
            inverse[g] = own;
        }
        inverse[g] = t.grounded[g] ? 0 : 1 / inverse[g];
    }
}

namespace {

// Torques on the masses, by position, from everything but the rigid devices: M̃.
void mass_loads(const Work& w, const Sample& s, double* load) {
    const ModelData& m = w.model;
    const TreeTopology& topology = *m.tree;
    for (int p = 0; p < m.masses; ++p) {
        const auto i = static_cast<std::size_t>(p);
        load[p] = -topology.ground_damping[i] * s.z[topology.mass[i]];
    }
    for (int p = 0; p < m.masses; ++p) {
        const auto i = static_cast<std::size_t>(p);
        const TreeTopology::Edge& edge = topology.edges[i];
        if (edge.parent < 0 || edge.rigid >= 0) continue;
        double torque = edge.damping *
                        (s.z[topology.mass[i]] - s.z[topology.mass[static_cast<std::size_t>(edge.parent)]]);
        if (edge.shaft >= 0) torque += edge.stiffness * edge.sign * s.z[m.masses + edge.shaft];
        load[p] -= torque;
        load[edge.parent] += torque;
    }
    for (int k = 0; k < m.forces; ++k) {
        if (s.f[k] == 0) continue;
        for (const Link& link : m.force_columns[static_cast<std::size_t>(k)]) {
            if (link.mass >= 0)
                load[topology.position[static_cast<std::size_t>(link.mass)]] -= link.factor * s.f[k];
        }
    }
}

// q̇ of every group from the loads of its masses.
void group_rates(const ModelData& m, const TreeMode& t, const double* load, double* rate) {
    std::fill(rate, rate + t.groups, 0.);
    for (int p = 0; p < m.masses; ++p) rate[t.group[p]] += t.force_ratio[p] * load[p];
    for (int g = 0; g < t.groups; ++g) rate[g] = t.grounded[g] ? 0 : rate[g] / t.mass[g];
}

// Equilibrium inside the grounded groups: adds to the torques what the load leaves, takes it off the load.
void solve_network(const ModelData& m, const TreeMode& t, double* load, double* potential, double* torque) {
    const TreeTopology& topology = *m.tree;
    std::copy(load, load + m.masses, potential);
    const auto parent = [&](int p) { return topology.edges[static_cast<std::size_t>(p)].parent; };
    for (int e = 0; e < t.edge_count; ++e) {
        const int p = t.edge[e];
        if (t.grounded[t.group[p]]) potential[parent(p)] -= t.network_lower[p] * potential[p];
    }
    for (int p = 0; p < m.masses; ++p) {
        if (!t.grounded[t.group[p]]) continue;
        potential[p] *= t.network_inverse[p];
        if (t.first[t.group[p]] != p) potential[p] -= t.network_lower[p] * potential[parent(p)];
    }
    const auto pass = [&](int p, double factor, double moment) { load[p] -= factor * moment; };
    for (int e = 0; e < t.edge_count; ++e) {
        const int p = t.edge[e];
        if (!t.grounded[t.group[p]]) continue;
        const int unknown = topology.edges[static_cast<std::size_t>(p)].rigid;
        const double moment = topology.weight[static_cast<std::size_t>(unknown)] *
                              (t.edge_own[e] * potential[p] + t.edge_up[e] * potential[parent(p)]);
        torque[unknown] += moment;
        pass(p, t.edge_own[e], moment);
        pass(parent(p), t.edge_up[e], moment);
    }
    for (int i = 0; i < t.ground_count; ++i) {
        const int p = t.ground_position[i], unknown = t.ground_unknown[i];
        const double moment =
            topology.weight[static_cast<std::size_t>(unknown)] * t.ground_factor[i] * potential[p];
        torque[unknown] += moment;
        pass(p, t.ground_factor[i], moment);
    }
}

}  // namespace

void tree_internal_torques(const Work& w, const Mode& mode, Sample& s) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    const TreeTopology& topology = *m.tree;
    const TreeMode& t = *mode.tree;
    std::fill(s.torque, s.torque + m.torques, 0.);
    if (t.edge_count == 0 && !t.any_grounded) return;
    double* load = w.scratch.workspace.data();
    double* rate = load + m.masses;
    mass_loads(w, s, load);
    group_rates(m, t, load, rate);
    if (t.any_grounded) {
        // Twice: the second pass takes what rounding left of the first.
        solve_network(m, t, load, rate + m.masses, s.torque);
        solve_network(m, t, load, rate + m.masses, s.torque);
    }
    for (int p = 0; p < m.masses; ++p) {
        load[p] -= m.structure.inertia[static_cast<std::size_t>(topology.mass[static_cast<std::size_t>(p)])] *
                   t.ratio[p] * rate[t.group[p]];
    }
    for (int e = 0; e < t.edge_count;
         ++e) {  // children first: what a subtree does not need passes through its edge
        const int p = t.edge[e];
        if (t.grounded[t.group[p]]) continue;
        const TreeTopology::Edge& edge = topology.edges[static_cast<std::size_t>(p)];
        const double moment = load[p] / t.edge_own[e];
        s.torque[edge.rigid] = moment;
        load[edge.parent] -= t.edge_up[e] * moment;
    }
}

void tree_sample_rate(const Work& w, const Mode& mode, Sample& s) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    const TreeTopology& topology = *m.tree;
    const TreeMode& t = *mode.tree;
    double* load = w.scratch.workspace.data();
    double* rate = load + m.masses;
    mass_loads(w, s, load);
    group_rates(m, t, load, rate);
    for (int p = 0; p < m.masses; ++p) {
        const auto i = static_cast<std::size_t>(p);
        s.rate[topology.mass[i]] = t.ratio[p] * rate[t.group[p]];
        const TreeTopology::Edge& edge = topology.edges[i];
        if (edge.shaft >= 0) {
            s.rate[m.masses + edge.shaft] =
                edge.sign *
                (s.z[topology.mass[i]] - s.z[topology.mass[static_cast<std::size_t>(edge.parent)]]);
        }
    }
    std::fill(s.rate + m.states, s.rate + m.states_padded, 0.);
}

void tree_join(const Work& w, const Mode& mode, double* speeds) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    const TreeTopology& topology = *m.tree;
    const TreeMode& t = *mode.tree;
    double* momentum = w.scratch.workspace.data();
    std::fill(momentum, momentum + t.groups, 0.);
    for (int p = 0; p < m.masses; ++p) {
        const auto mass = static_cast<std::size_t>(topology.mass[static_cast<std::size_t>(p)]);
        momentum[t.group[p]] += t.force_ratio[p] * m.structure.inertia[mass] * speeds[mass];
    }
    for (int p = 0; p < m.masses; ++p) {
        const int g = t.group[p];
        speeds[topology.mass[static_cast<std::size_t>(p)]] =
            t.grounded[g] ? 0 : t.ratio[p] * (momentum[g] / t.mass[g]);
    }
}

double tree_family(const Work& w, const Mode& mode, int leader, signed char* part) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    const TreeTopology& topology = *m.tree;
    const TreeMode& t = *mode.tree;
    const auto position = [&](int mass) { return topology.position[static_cast<std::size_t>(mass)]; };
    const Mesh& lead = m.structure.meshes[static_cast<std::size_t>(leader)];
    const int family = t.group[position(lead.first)];
    const double direction = t.ratio[position(lead.first)];
    if (t.grounded[family] == 1) return 0;
    double inertia = 0;
    for (int p = 0; p < m.masses; ++p) {
        if (t.group[p] != family) continue;
        inertia += m.structure.inertia[static_cast<std::size_t>(topology.mass[static_cast<std::size_t>(p)])] *
                   t.ratio[p] * t.ratio[p];
    }
    const auto relation = [&](const std::array<Link, 2>& links) -> signed char {
        double motion = 0;
        for (const Link& link : links) {
            if (link.mass < 0) continue;
            const int p = position(link.mass);
            if (t.group[p] == family) {
                motion += link.factor * t.ratio[p];
            } else if (t.grounded[t.group[p]] != 1) {
                return 0;  // another motion as well
            }
        }
        return static_cast<signed char>(motion == 0 ? 0 : motion * direction < 0 ? -1 : 1);
    };
    for (int k = 0; k < m.pairs; ++k) {
        const bool candidate = slips(w.contact[k]) && mode.bound[k];
        part[k] = candidate ? relation(m.structure.pairs[static_cast<std::size_t>(k)].links)
                            : static_cast<signed char>(0);
    }
    for (int k = 0; k < m.meshes; ++k) {
        const Mesh& mesh = m.structure.meshes[static_cast<std::size_t>(k)];
        const bool candidate = mesh.lossy() && w.contact[m.pairs + k] == stuck;
        part[m.pairs + k] = candidate ? relation(mesh.motion()) : static_cast<signed char>(0);
    }
    return std::fabs(direction) / std::sqrt(inertia);
}

}  // namespace shiftrig::plant::detail
