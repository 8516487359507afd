//   p = M q momenta of the groups, ψ twists, Q forces on the groups, N = −(K ψ + D δ) shaft torques, δ = ψ̇
//
//   stage i:  p* = p0 + h Σ_{j<i} (a^I_ij N_j + a^E_ij Q_j),   ψ* = ψ0 + h Σ_{j<i} a^I_ij δ_j
//             (M + hγ D + (hγ)² K) q_i = p* − hγ K ψ*
//             δ_i = differences of q_i,  N_i = (M q_i − p*)/(hγ),  Q_i = Q(t0 + c_i h, q_i, a_i)
//   end:      p1 = p0 + h Σ b_j (N_j + Q_j),   ψ1 = ψ0 + h Σ b_j δ_j,   a1 = a0 + h Σ b_j ȧ_j
//
// K, D act on the differences along the tree's edges. Auxiliary states a (engine lag, boost, tyre slip) are not stiff
// and go with the explicit table.
#include "plant/ark3.h"

#include <algorithm>
#include <cmath>

#include "plant/contact.h"
#include "plant/modes.h"
#include "plant/tree.h"

namespace shiftrig::plant::detail {
namespace {

constexpr int stages = 4;
constexpr double gamma = ark3_gamma;
constexpr double weights[stages] = {1471266399579. / 7840856788654, -4482444167858. / 7529755066697,
                                    11266239266428. / 11593286722821, gamma};
constexpr double nodes[stages] = {0, 2 * gamma, 3. / 5, 1};
constexpr double implicit_table[stages][stages] = {
    {},
    {gamma},
    {2746238789719. / 10658868560708, -640167445237. / 6845629431997},
    {weights[0], weights[1], weights[2]}};
constexpr double explicit_table[stages][stages] = {
    {},
    {2 * gamma},
    {5535828885825. / 10492691773637, 788022342437. / 10882634858940},
    {6485989280629. / 16251701735622, -4246266847089. / 9704473918619, 10755448449292. / 10357097424841}};

// Working vectors by group; auxiliary rates by stage.
struct Vectors {
    double *momentum, *twist, *speed, *right, *star_twist;
    double *shaft[stages], *rate[stages], *force[stages];  // N, δ, Q
    double *inverse, *lower;                               // of a partial step
    double* auxiliary[stages];

    Vectors(const ModelData& m, double* memory) {
        const auto take = [&memory](int count) {
            double* const at = memory;
            memory += count;
            return at;
        };
        for (double** vector : {&momentum, &twist, &speed, &right, &star_twist, &inverse, &lower})
            *vector = take(m.masses);
        for (int i = 0; i < stages; ++i) {
            shaft[i] = take(m.masses);
            rate[i] = take(m.masses);
            force[i] = take(m.masses);
            auxiliary[i] = take(m.auxiliary);
        }
    }
};

// Σ of the sample's forces on every group.
void group_forces(const ModelData& m, const TreeMode& t, const double* f, double* force) {
    std::fill(force, force + t.groups, 0.);
    for (int k = 0; k < m.forces; ++k) {
        if (f[k] == 0) continue;
        for (const Link& link : m.force_columns[static_cast<std::size_t>(k)]) {
            if (link.mass < 0) continue;
            const int p = m.tree->position[static_cast<std::size_t>(link.mass)];
            force[t.group[p]] -= t.force_ratio[p] * link.factor * f[k];
        }
    }
}

// δ of every group towards its parent.
void differences(const TreeMode& t, const double* speed, double* rate) {
    for (int g = 0; g < t.groups; ++g) rate[g] = t.parent[g] < 0 ? 0 : speed[g] - speed[t.parent[g]];
}

// Twists of the sample in the groups' measure and back.
void read_state(const ModelData& m, const TreeMode& t, const double* z, double* speed, double* twist) {
    const TreeTopology& topology = *m.tree;
    for (int g = 0; g < t.groups; ++g) {
        const int p = t.first[g];
        const TreeTopology::Edge& edge = topology.edges[static_cast<std::size_t>(p)];
        speed[g] = t.grounded[g] ? 0 : z[topology.mass[static_cast<std::size_t>(p)]] / t.ratio[p];
        twist[g] = edge.shaft < 0 ? 0 : edge.sign * z[m.masses + edge.shaft] / t.ratio[p];
    }
}

void write_speeds(const ModelData& m, const TreeMode& t, const double* speed, double* z) {
    for (int p = 0; p < m.masses; ++p)
        z[m.tree->mass[static_cast<std::size_t>(p)]] = t.ratio[p] * speed[t.group[p]];
}

void write_twists(const ModelData& m, const TreeMode& t, const double* twist, double* z) {
    for (int g = 0; g < t.groups; ++g) {
        const int p = t.first[g];
        const TreeTopology::Edge& edge = m.tree->edges[static_cast<std::size_t>(p)];
        if (edge.shaft >= 0) z[m.masses + edge.shaft] = edge.sign * t.ratio[p] * twist[g];
    }
    std::fill(z + m.states, z + m.states_padded, 0.);
}

// Shaft torques N at given twists and differences.
void shaft_torques(const TreeMode& t, const double* speed, const double* twist, const double* rate,
                   double* torque) {
    for (int g = 0; g < t.groups; ++g) torque[g] = -t.drag[g] * speed[g];
    for (int g = t.groups - 1; g >= 0; --g) {
        if (t.parent[g] < 0) continue;
        const double passed = t.stiffness[g] * twist[g] + t.damping[g] * rate[g];
        torque[g] -= passed;
        torque[t.parent[g]] += passed;
    }
}

// q from (M + hγ D + (hγ)² K) q = p* − hγ K ψ*; p* comes in `right` and is kept in `momentum`.
void solve_stage(const TreeMode& t, double weight, const double* inverse, const double* lower,
                 const double* twist, double* right, double* speed) {
    for (int g = t.groups - 1; g >= 0; --g) {
        if (t.parent[g] < 0) continue;
        const double passed = weight * t.stiffness[g] * twist[g];
        right[g] -= passed;
        right[t.parent[g]] += passed + lower[g] * right[g];
    }
    for (int g = 0; g < t.groups; ++g) {
        speed[g] = inverse[g] * right[g];
        if (t.parent[g] >= 0) speed[g] += lower[g] * speed[t.parent[g]];
    }
}

void middle_sample(Work& w, const Mode& mode) {
    Sample &begin = w.scratch.begin, &half = w.scratch.half, &end = w.scratch.end;
    const double h = end.at.time - begin.at.time;
    tree_sample_rate(w, mode, begin);
    tree_sample_rate(w, mode, end);
    for (int i = 0; i < w.model.states_padded; ++i) {
        half.z[i] = 0.5 * (begin.z[i] + end.z[i]) + h / 8 * (begin.rate[i] - end.rate[i]);
    }
    for (int i = 0; i < w.model.auxiliary; ++i) {
        half.auxiliary[i] = 0.5 * (begin.auxiliary[i] + end.auxiliary[i]) +
                            h / 8 * (begin.auxiliary_rate[i] - end.auxiliary_rate[i]);
    }
    evaluate_forces(w, w.contact, half);
}

bool is_overloaded(const Work& w, const Sample& s) {
    for (int k = 0; k < w.model.pairs; ++k) {
        if (w.contact[k] == locked && std::fabs(s.torque[k]) > s.holding[k]) return true;
    }
    return false;
}

}  // namespace

int tree_workspace_doubles(const ModelData& m) noexcept {
    return (7 + 3 * stages) * m.masses + stages * m.auxiliary + 4 * m.masses;
}

void advance_tree(Work& w, const Mode& mode, double end_fraction) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    ScratchData& s = w.scratch;
    const TreeMode& t = *mode.tree;
    const Sample& begin = s.begin;
    Sample &stage = s.late, &end = s.end;
    const double from = begin.at.fraction, length = end_fraction - from;
    const double h = length * w.h, weight = h * gamma;
    Vectors v(m, s.workspace.data() + 4 * m.masses);
    const bool whole = from == 0 && end_fraction == 1;
    const double *inverse = t.inverse, *lower = t.lower;
    if (!whole) {
        factor_stage(t, weight, v.inverse, v.lower);
        inverse = v.inverse;
        lower = v.lower;
    }

    read_state(m, t, begin.z, v.speed, v.twist);
    for (int g = 0; g < t.groups; ++g) v.momentum[g] = t.mass[g] * v.speed[g];
    differences(t, v.speed, v.rate[0]);
    shaft_torques(t, v.speed, v.twist, v.rate[0], v.shaft[0]);
    group_forces(m, t, begin.f, v.force[0]);
    std::copy(begin.auxiliary_rate, begin.auxiliary_rate + m.auxiliary, v.auxiliary[0]);

    for (int i = 1; i < stages; ++i) {
        for (int g = 0; g < t.groups; ++g) {
            double momentum = 0, twist = 0;
            for (int j = 0; j < i; ++j) {
                momentum += implicit_table[i][j] * v.shaft[j][g] + explicit_table[i][j] * v.force[j][g];
                twist += implicit_table[i][j] * v.rate[j][g];
            }
            v.shaft[i][g] = v.right[g] = v.momentum[g] + h * momentum;
            v.star_twist[g] = v.twist[g] + h * twist;
        }
        solve_stage(t, weight, inverse, lower, v.star_twist, v.right, v.speed);
        differences(t, v.speed, v.rate[i]);
        for (int g = 0; g < t.groups; ++g) v.shaft[i][g] = (t.mass[g] * v.speed[g] - v.shaft[i][g]) / weight;

        const double fraction = i == stages - 1 ? end_fraction : from + nodes[i] * length;
        stage.at = {w.start + fraction * w.h, fraction, i == stages - 1 ? Side::left : Side::right};
        for (int a = 0; a < m.auxiliary; ++a) {
            double change = 0;
            for (int j = 0; j < i; ++j) change += explicit_table[i][j] * v.auxiliary[j][a];
            stage.auxiliary[a] = begin.auxiliary[a] + h * change;
        }
        for (int p : m.tree->observed) {
            stage.z[m.tree->mass[static_cast<std::size_t>(p)]] = t.ratio[p] * v.speed[t.group[p]];
        }
        evaluate_forces(w, w.contact, stage);
        group_forces(m, t, stage.f, v.force[i]);
        std::copy(stage.auxiliary_rate, stage.auxiliary_rate + m.auxiliary, v.auxiliary[i]);
    }

    for (int g = 0; g < t.groups; ++g) {
        double momentum = 0, twist = 0;
        for (int j = 0; j < stages; ++j) {
            momentum += weights[j] * (v.shaft[j][g] + v.force[j][g]);
            twist += weights[j] * v.rate[j][g];
        }
        v.speed[g] = t.grounded[g] ? 0 : (v.momentum[g] + h * momentum) / t.mass[g];
        v.twist[g] += h * twist;
    }
    for (int a = 0; a < m.auxiliary; ++a) {
        double change = 0;
        for (int j = 0; j < stages; ++j) change += weights[j] * v.auxiliary[j][a];
        end.auxiliary[a] = begin.auxiliary[a] + h * change;
    }
    write_speeds(m, t, v.speed, end.z);
    write_twists(m, t, v.twist, end.z);
    end.at = {w.start + end_fraction * w.h, end_fraction, Side::left};
    evaluate_forces(w, w.contact, end);
    tree_internal_torques(w, mode, end);
    const double middle = 0.5 * (from + end_fraction);
    s.half.at = {w.start + middle * w.h, middle, Side::right};
    if (is_overloaded(w, end)) middle_sample(w, mode);
}

}  // namespace shiftrig::plant::detail
