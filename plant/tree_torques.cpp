// Motion and torques of the groups at one instant.
#include <algorithm>
#include <cmath>

#include "plant/contact.h"
#include "plant/few.h"
#include "plant/forces.h"
#include "plant/modes.h"
#include "plant/tree.h"

namespace shiftrig::plant::detail {
namespace {

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

void read_groups(const TreeMode& t, const double* z, GroupState& s) SHIFTRIG_REALTIME {
    const int groups = t.paths.groups;
    for (int g = 0; g < groups; ++g) s.speed[g] = t.speed_factor[g] * z[t.speed_slot[g]];
    for (int g = 0; g < groups; ++g) s.twist[g] = t.twist_factor[g] * z[t.twist_slot[g]];
}

void complete_groups(const Work& w, const Mode& mode, Sample& s) SHIFTRIG_REALTIME {
    const TreeMode& t = *mode.tree;
    GroupState& groups = s.groups;
    const TreeKernel& kernel = w.model.tree->kernel;
    kernel.shaft_torques(t.paths, groups.speed, groups.twist, groups.rate, groups.passed, groups.net);
    constexpr double once[] = {-1};
    kernel.give(t.forces, {1, &s.f, once}, nullptr, groups.net);
    groups.mode = &mode;
    groups.modes_built = w.operators.misses;
}

const GroupState& groups_of(const Work& w, const Mode& mode, Sample& s) SHIFTRIG_REALTIME {
    if (s.groups.mode != &mode || s.groups.modes_built != w.operators.misses) {
        read_groups(*mode.tree, s.z, s.groups);
        complete_groups(w, mode, s);
    }
    return s.groups;
}

void group_slips(const ModelData& m, const Mode& mode, const double* speed, Sample& s) SHIFTRIG_REALTIME {
    const TreeMode& t = *mode.tree;
    if (t.forces.count < m.forces) clear_few(s.slip, s.slip + m.forces);  // what is locked does not slip
    m.tree->kernel.slips(t.forces.slip, speed, t.forces.place, t.forces.count, s.slip);
    for (int k = 0; k < m.meshes; ++k) {
        s.turning[k] = mode.loss_share[k] == 0 ? 0
                                               : t.turning.of_first[k] * speed[t.turning.first[k]] +
                                                     t.turning.of_second[k] * speed[t.turning.second[k]];
    }
}

void rigid_torques(const Work& w, const Mode& mode, Sample& s) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    const GroupState& groups = s.groups;
    const TreeMode& t = *mode.tree;
    double* const load = w.scratch.tree.load;  // on each mass that carries rigid devices: M̃ − J ω̇
    double* const torque = s.torque;
    clear_few(torque, torque + m.torques);
    for (int i = 0; i < t.inner_count; ++i) {
        const TreeMass& mass = t.inner[i];
        const double acceleration = groups.net[mass.group] * t.inverse_mass[mass.group];
        load[mass.position] = -mass.inertia * acceleration;
    }
    for (int i = 0; t.paths.drags && i < t.inner_count; ++i) {
        const TreeMass& mass = t.inner[i];
        load[mass.position] -= mass.drag * groups.speed[mass.group];
    }
    for (int i = 0; i < t.end_count; ++i)
        load[t.end_position[i]] += t.end_factor[i] * groups.passed[t.end_group[i]];
    for (int i = 0; i < t.inner_force_count; ++i) {
        const TreeForce& force = t.inner_force[i];
        load[force.position] -= force.factor * s.f[force.force];
    }
    if (t.ground_count > 0) {
        // Twice: the second pass takes what rounding left of the first.
        double* const potential = w.scratch.tree.potential;
        solve_network(m, t, load, potential, torque);
        solve_network(m, t, load, potential, torque);
    }
    const double loads = largest_of(t.inner_edge_count, [&](int e) {
        const TreeEdge& edge = t.inner_edge[e];
        const double passed = load[edge.position], moment = passed * edge.reciprocal;
        torque[edge.unknown] = moment;
        load[edge.parent] -= edge.up * moment;
        return passed;
    });
    const double rest = largest_of(t.spent_count, [&](int i) { return load[t.spent[i]]; }),
                 scale = std::max(loads, m.kernel.loops.largest(torque, m.torques));
    s.torque_residual = scale > 0 ? rest / scale : 0;
}

// Read anew: whoever asks has changed z or f.
void tree_internal_torques(const Work& w, const Mode& mode, Sample& s) SHIFTRIG_REALTIME {
    read_groups(*mode.tree, s.z, s.groups);
    complete_groups(w, mode, s);
    rigid_torques(w, mode, s);
}

void tree_slips(const ModelData& m, const Mode& mode, Sample& s) SHIFTRIG_REALTIME {
    s.groups.mode = nullptr;
    read_groups(*mode.tree, s.z, s.groups);
    group_slips(m, mode, s.groups.speed, s);
}

void tree_swings(const Work& w, const Mode& mode, Sample& s) SHIFTRIG_REALTIME {
    const TreeMode& t = *mode.tree;
    w.model.tree->kernel.spread(t.shafts, groups_of(w, mode, s).rate, w.model.twists, s.swing);
}

void tree_sample_rate(const Work& w, const Mode& mode, Sample& s) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    const TreeTopology& topology = *m.tree;
    const TreeMode& t = *mode.tree;
    const GroupState& groups = groups_of(w, mode, s);
    for (int p = 0; p < topology.positions(); ++p) {
        const auto i = static_cast<std::size_t>(p);
        const int mass = topology.mass[i], g = t.group[p];
        const bool moves = p < m.masses;  // an anchor does not
        if (moves) s.rate[mass] = t.ratio[p] * (groups.net[g] * t.inverse_mass[g]);
        const TreeTopology::Edge& edge = topology.edges[i];
        if (edge.shaft < 0) continue;
        const double speed = moves ? s.z[mass] : 0;
        s.rate[m.masses + edge.shaft] =
            edge.sign * (speed - s.z[topology.mass[static_cast<std::size_t>(edge.parent)]]);
    }
    std::fill(s.rate + m.states, s.rate + m.states_padded, 0.);
}

double tree_acceleration(const Work& w, const Mode& mode, Sample& s, int mass) SHIFTRIG_REALTIME {
    const TreeMode& t = *mode.tree;
    const int p = w.model.tree->position[static_cast<std::size_t>(mass)], g = t.group[p];
    return t.ratio[p] * (groups_of(w, mode, s).net[g] * t.inverse_mass[g]);
}

void tree_mobility(const Work& w, const Mode& mode, const double* impulse, double* change) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    const TreeTopology& topology = *m.tree;
    const TreeMode& t = *mode.tree;
    double* sum = w.scratch.tree.momentum;
    std::fill(sum, sum + t.paths.groups, 0.);
    for (int p = 0; p < m.masses; ++p) {
        sum[t.group[p]] += t.force_ratio[p] * impulse[topology.mass[static_cast<std::size_t>(p)]];
    }
    for (int p = 0; p < m.masses; ++p) {
        const int g = t.group[p];
        change[topology.mass[static_cast<std::size_t>(p)]] = t.ratio[p] * (sum[g] * t.inverse_mass[g]);
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
        const bool candidate = mesh.lossy() && (w.contact[m.pairs + k] == stuck || mode.bound[m.pairs + k]);
        part[m.pairs + k] = candidate ? relation(mesh.motion()) : static_cast<signed char>(0);
    }
    return std::fabs(direction) / std::sqrt(inertia);
}

}  // namespace shiftrig::plant::detail
