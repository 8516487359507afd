// One contact mode on the tree: groups, what joins them, what acts on them.
#include <algorithm>
#include <cmath>

#include "plant/ark3.h"
#include "plant/forces.h"
#include "plant/modes.h"
#include "plant/tree.h"

namespace shiftrig::plant::detail {

namespace {

// Groups in order of their first positions, kinematic ratios along them.
void find_groups(const ModelData& m, const Mode& mode, TreeMode& t) {
    int groups = 0;
    t.edge_count = 0;
    for (int p = 0; p < m.tree->positions(); ++p) {
        const TreeTopology::Edge& edge = m.tree->edges[static_cast<std::size_t>(p)];
        if (is_active(m, mode, edge)) {
            t.group[p] = t.group[edge.parent];
            t.ratio[p] = -t.ratio[edge.parent] * edge.up / edge.own;
            ++t.edge_count;
            continue;
        }
        const int g = groups++;
        const bool hangs = edge.parent >= 0 && edge.rigid < 0;
        t.group[p] = g;
        t.first[g] = p;
        t.parent[g] = hangs ? t.group[edge.parent] : -1;
        t.ratio[p] = hangs ? t.ratio[edge.parent] : 1;
        t.grounded[g] = 0;
    }
    t.paths.groups = groups;
}

// Force ratios, group masses, links to the parents.
void weigh_groups(const ModelData& m, const Mode& mode, TreeMode& t) {
    const TreeTopology& topology = *m.tree;
    const int groups = t.paths.groups;
    for (double* sum : {t.mass, t.drag, t.drag_loss}) std::fill(sum, sum + groups, 0.);
    int next = t.edge_count;
    for (int p = 0; p < topology.positions(); ++p) {
        const auto i = static_cast<std::size_t>(p);
        const TreeTopology::Edge& edge = topology.edges[i];
        const int g = t.group[p];
        if (t.first[g] == p) {
            const bool hangs = t.parent[g] >= 0;
            t.force_ratio[p] = hangs ? t.force_ratio[edge.parent] : 1;
            const double square = t.force_ratio[p] * t.ratio[p];
            t.stiffness[g] = hangs ? square * edge.stiffness : 0;
            t.damping[g] = hangs ? square * edge.damping : 0;
            t.loss[g] = hangs ? t.ratio[p] * t.ratio[p] * edge.damping : 0;
        } else {
            double own = edge.own, up = edge.up;
            if (edge.rigid >= m.pairs) {
                const int k = edge.rigid - m.pairs;
                const Mesh& mesh = m.structure.meshes[static_cast<std::size_t>(k)];
                const double u = mesh.force_ratio(key_exponent(mode.key[edge.rigid]));
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
        t.drag_loss[g] += t.ratio[p] * t.ratio[p] * topology.ground_damping[i];
    }
    for (int g = 0; g < groups; ++g) t.inverse_mass[g] = t.grounded[g] ? 0 : 1 / t.mass[g];
    t.paths.drags = std::any_of(t.drag, t.drag + groups, [](double drag) { return drag != 0; });
}

// Paths of groups whose parent is the group before them.
void find_paths(TreeMode& t) {
    TreePaths& paths = t.paths;
    paths.count = paths.run_count = paths.hanging = 0;
    for (int g = 0; g < paths.groups; ++g) {
        t.inside[g] = g > 0 && t.parent[g] == g - 1 ? 1 : 0;
        t.inner_stiffness[g] = t.inside[g] * t.stiffness[g];
        t.inner_damping[g] = t.inside[g] * t.damping[g];
        if (t.inside[g] != 0) continue;
        if (g == 0 || t.parent[g] >= 0) {
            t.run_begin[paths.run_count] = g;
            t.run_parent[paths.run_count++] = t.parent[g];
        }
        if (t.parent[g] >= 0) t.head[paths.hanging++] = g;
        t.path_begin[paths.count] = g;
        t.path_parent[paths.count++] = t.parent[g];
    }
    t.inner_stiffness[paths.groups] = t.inner_damping[paths.groups] = 0;
    t.path_begin[paths.count] = paths.groups;
    t.run_begin[paths.run_count] = paths.groups;
    for (int g = 0; g < paths.groups; ++g) t.up[g] = t.parent[g] < 0 ? 0 : t.parent[g];
    paths.up = t.up;
    paths.run_begin = t.run_begin;
    paths.run_parent = t.run_parent;
    paths.long_runs = paths.groups > 12 * paths.run_count;
    paths.begin = t.path_begin;
    paths.parent = t.path_parent;
    paths.head = t.head;
    paths.inside = t.inside;
    paths.inner_stiffness = t.inner_stiffness;
    paths.inner_damping = t.inner_damping;
    paths.mass = t.mass;
    paths.inverse_mass = t.inverse_mass;
    paths.drag = t.drag;
    paths.stiffness = t.stiffness;
    paths.damping = t.damping;
}

void find_lines(Spreading& s, int count, int block) {
    for (int i = 0; i + block <= count; i += block) {
        bool in_line = true;
        for (int j = 1; j < block; ++j) in_line = in_line && s.group[i + j] == s.group[i] + j;
        s.in_line[i / block] = in_line;
    }
}

// Which masses carry rigid devices, and where q and ψ stand in z.
void find_masses(const ModelData& m, const Mode& mode, TreeMode& t) {
    const TreeTopology& topology = *m.tree;
    unsigned char* rigid = reinterpret_cast<unsigned char*>(t.network_lower);  // not yet in use
    std::fill(rigid, rigid + topology.positions(), static_cast<unsigned char>(0));
    for (int e = 0; e < t.edge_count; ++e)
        rigid[t.edge[e]] = rigid[topology.edges[static_cast<std::size_t>(t.edge[e])].parent] = 1;
    for (int p = 0; p < m.masses; ++p) {
        if (t.grounded[t.group[p]]) rigid[p] = 1;
    }
    t.inner_count = t.end_count = t.spent_count = t.inner_force_count = t.inner_edge_count = 0;
    for (int p = 0; p < m.masses; ++p) {
        const auto i = static_cast<std::size_t>(p);
        t.masses.group[topology.mass[i]] = t.group[p];
        t.masses.ratio[topology.mass[i]] = t.ratio[p];
        if (rigid[p]) {
            t.inner[t.inner_count++] = {
                p, t.group[p], t.ratio[p] * m.structure.inertia[static_cast<std::size_t>(topology.mass[i])],
                t.ratio[p] * topology.ground_damping[i]};
            if (t.grounded[t.group[p]] || t.first[t.group[p]] == p) t.spent[t.spent_count++] = p;
        }
    }
    for (int e = 0; e < t.edge_count; ++e) {
        const int p = t.edge[e];
        if (t.grounded[t.group[p]]) continue;
        const TreeTopology::Edge& edge = topology.edges[static_cast<std::size_t>(p)];
        t.inner_edge[t.inner_edge_count++] = {p, edge.parent, edge.rigid, 1 / t.edge_own[e], t.edge_up[e]};
    }
    for (int k = 0; k < m.forces; ++k) {
        if (k < m.pairs && mode.key[k]) continue;
        for (const Link& link : m.force_columns[static_cast<std::size_t>(k)]) {
            const int p = link.mass < 0 ? -1 : topology.position[static_cast<std::size_t>(link.mass)];
            if (p >= 0 && rigid[p]) t.inner_force[t.inner_force_count++] = {p, k, link.factor};
        }
    }
    t.exact = true;
    for (int g = 0; g < t.paths.groups; ++g) {
        const int p = t.first[g];
        const TreeTopology::Edge& edge = topology.edges[static_cast<std::size_t>(p)];
        t.speed_slot[g] = topology.mass[static_cast<std::size_t>(p)];
        t.speed_factor[g] = t.grounded[g] ? 0 : 1 / t.ratio[p];
        t.twist_slot[g] = edge.shaft < 0 ? 0 : m.masses + edge.shaft;
        t.twist_factor[g] = edge.shaft < 0 ? 0 : edge.sign / t.ratio[p];
        if (edge.shaft >= 0) {
            t.shafts.group[edge.shaft] = g;
            t.shafts.ratio[edge.shaft] = edge.sign * t.ratio[p];
        }
        t.exact = t.exact && std::fabs(t.ratio[p]) == 1;
    }
    find_lines(t.masses, m.masses, topology.kernel.block);
    find_lines(t.shafts, m.twists, topology.kernel.block);
    const auto end = [&](int g, int position, double factor) {
        if (!rigid[position]) return;
        t.end_group[t.end_count] = g;
        t.end_position[t.end_count] = position;
        t.end_factor[t.end_count++] = factor;
    };
    for (int g = 0; g < t.paths.groups; ++g) {
        if (t.parent[g] < 0) continue;
        const int p = t.first[g];
        end(g, p, -1 / t.force_ratio[p]);
        end(g, topology.edges[static_cast<std::size_t>(p)].parent, 1 / t.force_ratio[p]);
    }
}

// Each link's group, with its factor times that of its position.
void set_groups(const ModelData& m, const TreeMode& t, const std::array<Link, 2>& links,
                const double* by_position, int place, GroupPairs& pairs) {
    const auto set = [&](const Link& link, int& group, double& factor) {
        const int p = link.mass < 0 ? 0 : m.tree->position[static_cast<std::size_t>(link.mass)];
        group = t.group[p];
        factor = link.mass < 0 ? 0 : by_position[p] * link.factor;
    };
    set(links[0], pairs.first[place], pairs.of_first[place]);
    set(links[1], pairs.second[place], pairs.of_second[place]);
}

void find_forces(const ModelData& m, const Mode& mode, TreeMode& t) {
    t.forces.count = 0;
    for (int k = 0; k < m.forces; ++k) {
        if (k < m.pairs && mode.key[k]) continue;
        const auto i = static_cast<std::size_t>(k);
        set_groups(m, t, m.force_on[i], t.ratio, t.forces.count, t.forces.slip);
        set_groups(m, t, m.force_columns[i], t.force_ratio, t.forces.count, t.forces.share);
        t.forces.place[t.forces.count++] = k;
    }
    double* const share = t.matrix.inverse;  // Σ of the forces at each group; not yet in use
    std::fill(share, share + t.paths.groups, 0.);
    for (int i = 0; i < t.forces.count; ++i) {
        share[t.forces.share.first[i]] += std::fabs(t.forces.share.of_first[i]);
        share[t.forces.share.second[i]] += std::fabs(t.forces.share.of_second[i]);
    }
    double* const widest = t.matrix.lower;  // r of the masses of each group; likewise
    std::fill(widest, widest + t.paths.groups, 0.);
    for (int p = 0; p < m.masses; ++p)
        widest[t.group[p]] = std::max(widest[t.group[p]], std::fabs(t.ratio[p]));
    t.liveliness = 0;
    for (int g = 0; g < t.paths.groups; ++g)
        t.liveliness = std::max(t.liveliness, widest[g] * share[g] * t.inverse_mass[g]);
    for (int k = 0; k < m.meshes; ++k)
        set_groups(m, t, m.mesh_loss[static_cast<std::size_t>(k)], t.ratio, k, t.turning);
}

// Can anything in the mode swing or fade fast enough to matter? Nothing is faster than the bounds of Gershgorin's
// circles of M⁻¹ K and M⁻¹ D.
void find_swing(const ModelData& m, TreeMode& t) {
    double swing = 0, fade = 0;  // ω², 1/s
    double *stiffness = t.matrix.inverse,
           *damping = t.matrix.lower;  // Σ of the links at each group; not yet in use
    std::fill(stiffness, stiffness + t.paths.groups, 0.);
    std::copy(t.drag, t.drag + t.paths.groups, damping);
    for (int g = t.paths.groups - 1; g >= 0; --g) {
        stiffness[g] += t.stiffness[g];
        damping[g] += t.damping[g];
        if (t.parent[g] >= 0) {
            stiffness[t.parent[g]] += t.stiffness[g];
            damping[t.parent[g]] += t.damping[g];
        }
        swing = std::max(swing, 2 * stiffness[g] * t.inverse_mass[g]);
        fade = std::max(fade, 2 * damping[g] * t.inverse_mass[g]);
    }
    t.swings = m.options.step_size * (std::sqrt(swing) + fade) > ark3_slow_swing;
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
    find_paths(t);
    find_masses(m, mode, t);
    find_forces(m, mode, t);
    if (t.ground_count > 0) factor_network(m, t);
    find_swing(m, t);
    t.matrix.weight = ark3_gamma * m.options.step_size;
    factor_stage(m.tree->kernel.block, t, t.matrix);
}

namespace {

// Of a block whose values each take `link` times the one before: the factors of a scan. `first` is the value that the sweep
// meets first, the others follow in this direction.
void scan_block(const double* link, int block, int first, int direction, TreeScan& scan) {
    double outside = 1;
    for (int i = 0; i < block; ++i) {
        const int g = first + direction * i;
        outside *= link[i];
        scan.by_one[g] = i < 1 ? 0 : link[i];
        scan.by_two[g] = i < 2 ? 0 : link[i] * link[i - 1];
        scan.by_four[g] = i < 4 ? 0 : link[i] * link[i - 1] * link[i - 2] * link[i - 3];
        scan.from_outside[g] = outside;
    }
}

void prepare_scans(int block, const TreePaths& t, StageMatrix& m) {
    for (int run = 0; run < t.run_count; ++run) {
        const int begin = t.run_begin[run], end = t.run_begin[run + 1];
        double link[largest_tree_block];
        for (int g = begin; g + block <= end; g += block) {
            for (int i = 0; i < block; ++i) link[i] = m.lower[g + i];
            scan_block(link, block, g, 1, m.towards_leaves);
        }
        for (int g = end; g - block >= begin; g -= block) {
            for (int i = 0; i < block; ++i) link[i] = g - i == end ? 0 : m.lower[g - i];
            scan_block(link, block, g - 1, -1, m.towards_roots);
        }
    }
}

}  // namespace

void factor_stage(int block, const TreeMode& t, StageMatrix& matrix) SHIFTRIG_REALTIME {
    const double weight = matrix.weight;
    double *const inverse = matrix.inverse, *const lower = matrix.lower;
    const int groups = t.paths.groups;
    for (int g = 0; g < groups; ++g) inverse[g] = t.mass[g] + weight * t.drag[g];
    for (int g = groups - 1; g >= 0; --g) {
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
    if (t.paths.long_runs) prepare_scans(block, t.paths, matrix);
}

}  // namespace shiftrig::plant::detail
