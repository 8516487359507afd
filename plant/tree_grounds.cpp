// What holds groups at rest, and how they share a load.
#include <algorithm>

#include "plant/contact.h"
#include "plant/modes.h"
#include "plant/tree.h"

namespace shiftrig::plant::detail {
namespace {

// Closed pairs whose torques are not unique: each of two or more that hold a group, and those between them.
void find_shared_loads(const ModelData& m, Mode& mode, TreeMode& t) {
    const TreeTopology& topology = *m.tree;
    // All that hold one group at rest are in one loop, which the housing closes.
    const auto share = [&](int pair, int position) {
        mode.bound[pair] |= shares_load;
        mode.loop[pair] = t.group[position] + 1;
    };
    // How many hold the part of its group that lies beyond a position.
    double* held = t.network_inverse;  // not yet in use
    std::fill(held, held + m.masses, 0.);
    for (int i = 0; i < t.ground_count; ++i) held[t.ground_position[i]] += 1;
    for (int p = m.masses; p-- > 0;) {
        const TreeTopology::Edge& edge = topology.edges[static_cast<std::size_t>(p)];
        if (is_active(m, mode, edge)) held[edge.parent] += held[p];
    }
    for (int p = 0; p < m.masses; ++p) {
        const TreeTopology::Edge& edge = topology.edges[static_cast<std::size_t>(p)];
        if (edge.rigid >= m.pairs || !is_active(m, mode, edge)) continue;
        if (held[p] > 0 && held[p] < held[t.first[t.group[p]]]) share(edge.rigid, p);
    }
    for (int i = 0; i < t.ground_count; ++i) {
        if (t.ground_unknown[i] < m.pairs && held[t.first[t.group[t.ground_position[i]]]] > 1)
            share(t.ground_unknown[i], t.ground_position[i]);
    }
}

}  // namespace

bool is_active(const ModelData& m, const Mode& mode, const TreeTopology::Edge& edge) SHIFTRIG_REALTIME {
    return edge.rigid >= m.pairs || (edge.rigid >= 0 && mode.key[edge.rigid] != 0);
}

void find_grounds(const ModelData& m, Mode& mode, TreeMode& t) SHIFTRIG_REALTIME {
    const TreeTopology& topology = *m.tree;
    t.ground_count = 0;
    mode.redundant = false;
    for (int anchor = m.masses; anchor < topology.positions(); ++anchor) t.grounded[t.group[anchor]] = 1;
    std::fill(mode.loop, mode.loop + m.pairs, 0);
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
        mode.bound[m.pairs + k] = t.grounded[g] == 1 ? held_in_set : 0;
        if (!mesh.lossy() || mode.key[m.pairs + k] != 0 || t.grounded[g] != 0) continue;
        t.grounded[g] = 2;
        mode.rows[mode.row_count++] = m.pairs + m.meshes + k;
        hold(topology.position[static_cast<std::size_t>(mesh.second)], m.pairs + m.meshes + k, mesh.ratio);
    }
    for (int k = 0; k < m.meshes; ++k) {
        const Mesh& mesh = m.structure.meshes[static_cast<std::size_t>(k)];
        if (t.grounded[t.group[topology.position[static_cast<std::size_t>(mesh.first)]]])
            mode.bound[m.pairs + k] |= held_in_set;
    }
    for (int k = 0; k < m.pairs; ++k) {
        bool held = true;
        for (const Link& link : m.structure.pairs[static_cast<std::size_t>(k)].links) {
            if (link.mass >= 0)
                held = held && t.grounded[t.group[topology.position[static_cast<std::size_t>(link.mass)]]];
        }
        mode.bound[k] = held || mode.key[k] ? held_in_set : 0;
    }
    if (mode.redundant) find_shared_loads(m, mode, t);
}

void factor_network(const ModelData& m, TreeMode& t) SHIFTRIG_REALTIME {
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

}  // namespace shiftrig::plant::detail
