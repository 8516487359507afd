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
#include "plant/devices.h"
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

// b − b̂: by so much of each stage the embedded method of order 2 differs.
constexpr double embedded_error[stages] = {
    weights[0] - 2756255671327. / 12835298489170, weights[1] + 10771552573575. / 22201958757719,
    weights[2] - 9247589265047. / 10645013368117, gamma - 2193209047091. / 5459859503100};

// Of a step of z' = L z: row · A^power · 1 goes with (hL)^(power + 1).
constexpr double coefficient(const double (&row)[stages], int power) {
    double vector[stages] = {1, 1, 1, 1};
    for (; power > 0; --power) {
        double next[stages] = {};
        for (int i = 0; i < stages; ++i) {
            for (int j = 0; j < i; ++j) next[i] += implicit_table[i][j] * vector[j];
            if (i > 0) next[i] += gamma * vector[i];
        }
        for (int i = 0; i < stages; ++i) vector[i] = next[i];
    }
    double sum = 0;
    for (int i = 0; i < stages; ++i) sum += row[i] * vector[i];
    return sum;
}
// The step has (hL)⁴ in excess by the first: so it damps a swing by the ratio 0.026 (hω)³ (numerics.md §6). The embedded
// method differs by e = the second times (hL)³, and because the stages are of order 2, forces that change with time
// enter both alike. So −(first/second) hL e takes the excess away.
constexpr double excess = coefficient(weights, 3) - 1. / 24, embedded = coefficient(embedded_error, 2);

// Where shafts swing, makes the linear part of the step one of order 4. hL/(1 − hγL)² in place of hL: the same to that
// order, nothing where hω is large, and the step stays L-stable. With S = (1 − hγL)⁻¹, which a stage solves with,
// it is (S² − S)/γ.
void complete_swing(const TreeKernel& kernel, const TreeMode& t, const TreeWork& v, double h,
                    const double* inverse, const double* lower) {
    const EmbeddedSums sums{
        {h * embedded_error[0], h * embedded_error[1], h * embedded_error[2], h * embedded_error[3]},
        {v.begin.torque, v.stage_torque[0], v.stage_torque[1], v.stage_torque[2]},
        {v.begin.force, v.stage_force[0], v.stage_force[1], v.stage_force[2]},
        {v.begin.rate, v.stage_rate[0], v.stage_rate[1], v.stage_rate[2]}};
    const Swing swing = kernel.swing_error(t.paths, sums, v.end.speed);
    if (!(swing.error > ark3_swing_tolerance * h * std::max(swing.fastest, at_rest))) return;
    const EmbeddedWork work{v.other.torque, v.right,       v.other.twist,
                            v.other.speed,  v.other.force, v.other.rate};
    constexpr double factor = -excess / embedded / gamma;
    kernel.correct(t.paths, sums, h * gamma, inverse, lower, factor, work, v.end.speed, v.end.twist);
}

// The sample half way, for the search of the instant at which a locked pair gives way.
void middle_sample(Work& w, const Mode& mode) {
    Sample &begin = w.scratch.begin, &half = w.scratch.half, &end = w.scratch.end;
    const double h = end.at.time - begin.at.time;
    tree_sample_rate(w, mode, begin);
    tree_sample_rate(w, mode, end);
    for (int i = 0; i < w.model.states; ++i) {
        half.z[i] = 0.5 * (begin.z[i] + end.z[i]) + h / 8 * (begin.rate[i] - end.rate[i]);
    }
    for (int i = 0; i < w.model.auxiliary; ++i) {
        half.auxiliary[i] = 0.5 * (begin.auxiliary[i] + end.auxiliary[i]) +
                            h / 8 * (begin.auxiliary_rate[i] - end.auxiliary_rate[i]);
    }
    tree_slips(w.model, mode, half);
    evaluate_forces(w, w.contact, half);
}

bool is_overloaded(const Work& w, const Sample& s) {
    for (int k = 0; k < w.model.pairs; ++k) {
        if (w.contact[k] == locked && std::fabs(s.torque[k]) > static_limit(w, k, s)) return true;
    }
    return false;
}

// What the force laws need of z, from the groups' speeds.
void show_speeds(const TreeMode& t, const double* speed, double* z) {
    for (int i = 0; i < t.observed_count; ++i)
        z[t.observed[i].mass] = t.observed[i].ratio * speed[t.observed[i].group];
}

void write_state(const ModelData& m, const TreeMode& t, const GroupState& s, double* z) {
    const TreeTopology& topology = *m.tree;
    for (int p = 0; p < m.masses; ++p)
        z[topology.mass[static_cast<std::size_t>(p)]] = t.ratio[p] * s.speed[t.group[p]];
    for (int g = 0; g < t.paths.groups; ++g) {
        if (t.twist_factor[g] != 0) z[t.twist_slot[g]] = t.twist_back[g] * s.twist[g];
    }
}

}  // namespace

void advance_tree(Work& w, const Mode& mode, double end_fraction) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    ScratchData& s = w.scratch;
    const TreeMode& t = *mode.tree;
    const TreeKernel& kernel = m.tree->kernel;
    TreeWork v(m, s.workspace.data());
    const Sample& begin = s.begin;
    Sample &stage = s.late, &end = s.end;
    const double from = begin.at.fraction, length = end_fraction - from;
    const double h = length * w.h, weight = h * ark3_gamma;
    const double *inverse = t.inverse, *lower = t.lower;
    if (from != 0 || end_fraction != 1) {
        factor_stage(t, weight, v.inverse, v.lower);
        inverse = v.inverse;
        lower = v.lower;
    }

    tabulate_contact(w, mode);
    if (s.begin_groups != &mode) {
        read_groups(m, t, begin.z, v.begin);
        group_forces(t, begin.f, v.begin.force);
        s.begin_groups = &mode;
    }
    for (int g = 0; g < t.paths.groups; ++g) v.momentum[g] = t.mass[g] * v.begin.speed[g];
    std::copy(begin.auxiliary_rate, begin.auxiliary_rate + m.auxiliary, v.auxiliary[0]);

    StageSums sums;
    sums.torque[0] = v.begin.torque;
    sums.force[0] = v.begin.force;
    sums.rate[0] = v.begin.rate;
    for (int i = 1; i < stages; ++i) {
        sums.count = i;
        for (int j = 0; j < i; ++j) {
            sums.implicit_weight[j] = h * implicit_table[i][j];
            sums.explicit_weight[j] = h * explicit_table[i][j];
        }
        kernel.stage(t.paths, sums, v.momentum, v.begin.twist, weight, inverse, lower, v.right, v.star_twist,
                     v.stage_speed, v.stage_rate[i - 1], v.stage_torque[i - 1]);

        const bool last = i == stages - 1;
        const double fraction = last ? end_fraction : from + nodes[i] * length;
        stage.at = {w.start + fraction * w.h, fraction, last ? Side::left : Side::right};
        for (int a = 0; a < m.auxiliary; ++a) {
            double change = 0;
            for (int j = 0; j < i; ++j) change += explicit_table[i][j] * v.auxiliary[j][a];
            stage.auxiliary[a] = begin.auxiliary[a] + h * change;
        }
        show_speeds(t, v.stage_speed, stage.z);
        tree_slips(m, mode, stage);
        stage_forces(w, stage);
        group_forces(t, stage.f, v.stage_force[i - 1]);
        std::copy(stage.auxiliary_rate, stage.auxiliary_rate + m.auxiliary, v.auxiliary[i]);
        sums.torque[i] = v.stage_torque[i - 1];
        sums.force[i] = v.stage_force[i - 1];
        sums.rate[i] = v.stage_rate[i - 1];
    }

    // The implicit table ends with b: the last stage needs only what its explicit part lacks.
    FinalSums final;
    final.weight = weight;
    for (int j = 0; j < stages; ++j) {
        final.correction[j] = h * (weights[j] - explicit_table[stages - 1][j]);
        final.force[j] = sums.force[j];
    }
    final.last_speed = v.stage_speed;
    final.last_rate = v.stage_rate[stages - 2];
    final.star_twist = v.star_twist;
    kernel.finish(t.paths, final, v.end.speed, v.end.twist);
    if (t.swings) complete_swing(kernel, t, v, h, inverse, lower);
    kernel.shaft_torques(t.paths, v.end.speed, v.end.twist, v.end.rate, v.end.passed, v.end.torque);
    for (int a = 0; a < m.auxiliary; ++a) {
        double change = 0;
        for (int j = 0; j < stages; ++j) change += weights[j] * v.auxiliary[j][a];
        end.auxiliary[a] = begin.auxiliary[a] + h * change;
    }
    write_state(m, t, v.end, end.z);
    tree_slips(m, mode, end);
    end.at = {w.start + end_fraction * w.h, end_fraction, Side::left};
    end_forces(w, end);
    group_forces(t, end.f, v.end.force);
    s.torque_residual = rigid_torques(w, mode, v.end, end);
    const double middle = 0.5 * (from + end_fraction);
    s.half.at = {w.start + middle * w.h, middle, Side::right};
    if (is_overloaded(w, end)) middle_sample(w, mode);
}

double tree_middle(Work& w, const Mode& mode) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    ScratchData& s = w.scratch;
    const TreeMode& t = *mode.tree;
    TreeWork v(m, s.workspace.data());
    const double h =
        s.end.at.time - s.begin.at.time;  // begin's groups are those that advance_tree started from
    const MiddleSums sums{h,
                          {v.begin.speed, v.end.speed},
                          {v.begin.torque, v.end.torque},
                          {v.begin.force, v.end.force},
                          {v.begin.rate, v.end.rate},
                          t.loss,
                          t.drag_loss};
    const double loss = h / 6 * m.tree->kernel.middle(t.paths, sums, v.other.speed, v.other.rate);
    for (int i = 0; i < m.auxiliary; ++i) {
        s.middle.auxiliary[i] = 0.5 * (s.begin.auxiliary[i] + s.end.auxiliary[i]) +
                                h / 8 * (s.begin.auxiliary_rate[i] - s.end.auxiliary_rate[i]);
    }
    show_speeds(t, v.other.speed, s.middle.z);
    tree_slips(m, mode, s.middle);
    for (int j : m.translating) {
        const int g = t.group[m.tree->position[static_cast<std::size_t>(j)]];
        s.end.rate[j] = t.ratio[m.tree->position[static_cast<std::size_t>(j)]] *
                        (v.end.torque[g] + v.end.force[g]) * t.inverse_mass[g];
    }
    s.middle.at = s.half.at;
    stage_forces(w, s.middle);
    if (m.tree->lossy) {
        // Twists half way as well, for the torques of the gears.
        for (int g = 0; g < t.paths.groups; ++g) {
            v.other.twist[g] =
                0.5 * (v.begin.twist[g] + v.end.twist[g]) + h / 8 * (v.begin.rate[g] - v.end.rate[g]);
        }
        m.tree->kernel.shaft_torques(t.paths, v.other.speed, v.other.twist, v.other.rate, v.other.passed,
                                     v.other.torque);
        group_forces(t, s.middle.f, v.other.force);
        rigid_torques(w, mode, v.other, s.middle);
    }
    return loss;
}

}  // namespace shiftrig::plant::detail
