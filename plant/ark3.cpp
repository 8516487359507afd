//   p = M q momenta of the groups, ψ twists, Q forces on the groups, N = −(K ψ + D δ) shaft torques, δ = ψ̇
//
//   stage i:  p* = p0 + h Σ_{j<i} (a^I_ij N_j + a^E_ij Q_j),   ψ* = ψ0 + h Σ_{j<i} a^I_ij δ_j
//             (M + hγ D + (hγ)² K) q_i = p* − hγ K ψ*
//             N_i = (M q_i − p*)/(hγ),  Q_i = Q(t0 + c_i h, q_i, a_i)
//   end:      p1 = p0 + h Σ b_j (N_j + Q_j),   ψ1 = ψ0 + h Σ b_j δ_j,   a1 = a0 + h Σ b_j ȧ_j
//
// K, D act on the differences δ of q along the tree's edges. Auxiliary states a (engine lag, boost, tyre slip) are not stiff
// and go with the explicit table. All of it is linear in the q_j, N_0 + Q_0 and Q_j, so these alone are kept: p* and N_i
// are worked out from them when this is compiled.
#include "plant/ark3.h"

#include <algorithm>

#include "plant/devices.h"
#include "plant/few.h"
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

// A momentum as M (speed_0 q_0 + Σ_{j>0} speed_j (q_j − q_0)) + net · h (N_0 + Q_0) + Σ effort_j · h Q_j. In differences:
// what all stages turn at is then weighed by exactly 1, in 10⁸ steps as in one.
struct Impulse {
    double speed[stages] = {}, net = 0, effort[stages] = {};
    constexpr void add(double factor, const Impulse& other) {
        for (int j = 0; j < stages; ++j) {
            speed[j] += factor * other.speed[j];
            effort[j] += factor * other.effort[j];
        }
        net += factor * other.net;
    }
};
struct Impulses {
    Impulse star[stages];    // p*_i
    Impulse torque[stages];  // h N_i
};
constexpr Impulses work_out_stages() {
    Impulses all;
    all.torque[0].net = 1;
    all.torque[0].effort[0] = -1;
    for (int i = 1; i < stages; ++i) {
        Impulse& star = all.star[i];
        star.speed[0] = 1;
        for (int j = 0; j < i; ++j) {
            star.add(implicit_table[i][j], all.torque[j]);
            star.effort[j] += explicit_table[i][j];
        }
        all.torque[i].speed[0] = all.torque[i].speed[i] = 1 / gamma;
        all.torque[i].add(-1 / gamma, star);
    }
    return all;
}
constexpr Impulses impulses = work_out_stages();

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
// The step has (hL)⁴ in excess by the first: so it damps a swing by the ratio 0.026 (hω)³ (docs/mechanics.md, One step). The embedded
// method differs by e = the second times (hL)³, and because the stages are of order 2, forces that change with time
// enter both alike. So −(first/second) hL e takes the excess away.
constexpr double excess = coefficient(weights, 3) - 1. / 24, embedded = coefficient(embedded_error, 2);

// By what the embedded method differs: h Σ e_j (N_j + Q_j).
constexpr Impulse embedded_impulse() {
    Impulse sum;
    for (int j = 0; j < stages; ++j) {
        sum.add(embedded_error[j], impulses.torque[j]);
        sum.effort[j] += embedded_error[j];
    }
    return sum;
}
constexpr Impulse swing_impulse = embedded_impulse();

// What the explicit part of the last stage lacks of the end.
struct Lacks {
    double share[stages] = {};
    constexpr Lacks() {
        for (int j = 0; j < stages; ++j) share[j] = weights[j] - explicit_table[stages - 1][j];
    }
};
constexpr Lacks lacks;

// What so many stages make of an impulse, and of the ways with these weights.
StageSums stage_sums(const Impulse& impulse, const double (&ways)[stages], int count, const double* net,
                     const TreeWork& v, double h) {
    return {count, v.speed, impulse.speed, ways, h, net, h * impulse.net};
}

// What the forces of so many stages take from the groups: −h Σ share_j Q_j.
Efforts efforts(const double (&shares)[stages], int count, const TreeWork& v, double h) {
    return {count, v.effort, shares, -h};
}

// Where shafts swing, makes the linear part of the step one of order 4. hL/(1 − hγL)² in place of hL: the same to that
// order, nothing where hω is large, and the step stays L-stable. With S = (1 − hγL)⁻¹, which a stage solves with,
// it is (S² − S)/γ.
void complete_swing(const ModelData& m, const TreeMode& t, TreeWork& v, double h, const StageMatrix& stage,
                    const double* net, GroupState& end) {
    const TreeKernel& kernel = m.tree->kernel;
    const StageSums sums = stage_sums(swing_impulse, embedded_error, stages, net, v, h);
    const Swing swing = v.swing_seen = kernel.swing_error(t.paths, sums, v.way);
    if (!(swing.error > ark3_swing_tolerance * h * std::max(swing.fastest, at_rest))) return;
    const SwingWork work{v.swing[0], v.swing[1], v.swing[2], v.swing[3]};
    kernel.combine(t.paths, stage.weight, sums, nullptr, work.first, v.way);
    kernel.give(t.forces, efforts(swing_impulse.effort, stages, v, h), nullptr, work.first);
    constexpr double factor = -excess / embedded / gamma;
    kernel.correct(t.paths, stage, v.way, factor, work, end.speed, end.twist);
}

// Parts of one length share their matrix.
const StageMatrix& part_matrix(Work& w, const Mode& mode, double weight) {
    ScratchData& s = w.scratch;
    StageMatrix& matrix = s.tree.matrix;
    if (s.part_mode != &mode || s.part_modes_built != w.operators.misses || matrix.weight != weight) {
        matrix.weight = weight;
        factor_stage(w.model.tree->kernel.block, *mode.tree, matrix);
        s.part_mode = &mode;
        s.part_modes_built = w.operators.misses;
    }
    return matrix;
}

}  // namespace

void advance_tree(Work& w, const Mode& mode, double end_fraction) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    ScratchData& s = w.scratch;
    const TreeMode& t = *mode.tree;
    const TreeKernel& kernel = m.tree->kernel;
    TreeWork& v = s.tree;
    Sample &begin = s.begin(), &end = s.end();
    const double from = begin.at.fraction, length = end_fraction - from;
    const double h = length * w.h;
    const bool whole = from == 0 && end_fraction == 1;
    const StageMatrix& matrix = whole ? t.matrix : part_matrix(w, mode, h * ark3_gamma);

    tabulate_contact(w, mode);
    const GroupState& start = groups_of(w, mode, begin);
    v.speed[0] = start.speed;
    v.effort[0] = begin.f;
    Sample& late = s.late;  // of each stage in turn, its f kept
    copy_few(begin.auxiliary_rate, m.auxiliary, v.auxiliary_rate[0]);
    for (int i = 1; i < stages; ++i) {
        double* const speed = v.stage_speed[i - 1];
        kernel.combine(t.paths, matrix.weight,
                       stage_sums(impulses.star[i], implicit_table[i], i, start.net, v, h), start.twist,
                       speed, v.way);
        kernel.give(t.forces, efforts(impulses.star[i].effort, i, v, h), nullptr, speed);
        kernel.solve(t.paths, matrix, speed);
        v.speed[i] = speed;

        const bool last = i == stages - 1;
        const double fraction = last ? end_fraction : from + nodes[i] * length;
        late.at = {w.start + fraction * w.h, fraction, last ? Side::left : Side::right};
        for (int a = 0; a < m.auxiliary; ++a) {
            double change = 0;
            for (int j = 0; j < i; ++j) change += explicit_table[i][j] * v.auxiliary_rate[j][a];
            late.auxiliary[a] = begin.auxiliary[a] + h * change;
        }
        group_slips(m, mode, speed, late);
        v.effort[i] = late.f = v.stage_effort[i - 1];
        stage_forces(w, late);
        copy_few(late.auxiliary_rate, m.auxiliary, v.auxiliary_rate[i]);
    }

    // The implicit table ends with b: the last stage needs only what its explicit part lacks.
    GroupState& groups = end.groups;
    kernel.finish(t.paths, matrix.weight, start.twist, v.way, v.speed[stages - 1], groups.speed,
                  groups.twist);
    kernel.give(t.forces, efforts(lacks.share, stages, v, h), t.inverse_mass, groups.speed);
    v.swing_seen = {};
    if (t.swings) complete_swing(m, t, v, h, matrix, start.net, groups);
    for (int a = 0; a < m.auxiliary; ++a) {
        double change = 0;
        for (int j = 0; j < stages; ++j) change += weights[j] * v.auxiliary_rate[j][a];
        end.auxiliary[a] = begin.auxiliary[a] + h * change;
    }
    kernel.spread(t.masses, groups.speed, m.masses, end.z);
    kernel.spread(t.shafts, groups.twist, m.twists, end.z + m.masses);
    if (!t.exact) read_groups(t, end.z, groups);  // as the next step would, if it had to
    group_slips(m, mode, groups.speed, end);
    end.at = {w.start + end_fraction * w.h, end_fraction, Side::left};
    end_forces(w, end);
    complete_groups(w, mode, end);
    rigid_torques(w, mode, end);
    const double middle = 0.5 * (from + end_fraction);
    s.half.at = {w.start + middle * w.h, middle, Side::right};
}

void tree_half(Work& w, const Mode& mode) SHIFTRIG_REALTIME {
    Sample &begin = w.scratch.begin(), &half = w.scratch.half, &end = w.scratch.end();
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
    internal_torques(w, mode, half);
}

double tree_middle(Work& w, const Mode& mode) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    ScratchData& s = w.scratch;
    const TreeMode& t = *mode.tree;
    const double h = s.end().at.time - s.begin().at.time;
    const GroupState &begin = s.begin().groups, &end = s.end().groups;  // advance_tree() left them
    GroupState& groups = s.middle.groups;
    const MiddleSums sums{
        h, {begin.speed, end.speed}, {begin.net, end.net}, {begin.rate, end.rate}, t.loss, t.drag_loss};
    const double loss = h / 6 * m.tree->kernel.middle(t.paths, sums, groups.speed);
    for (int i = 0; i < m.auxiliary; ++i) {
        s.middle.auxiliary[i] = 0.5 * (s.begin().auxiliary[i] + s.end().auxiliary[i]) +
                                h / 8 * (s.begin().auxiliary_rate[i] - s.end().auxiliary_rate[i]);
    }
    group_slips(m, mode, groups.speed, s.middle);
    s.middle.at = s.half.at;
    stage_forces(w, s.middle);
    if (m.tree->lossy) {
        // Twists half way as well, for the torques of the gears.
        for (int g = 0; g < t.paths.groups; ++g)
            groups.twist[g] = 0.5 * (begin.twist[g] + end.twist[g]) + h / 8 * (begin.rate[g] - end.rate[g]);
        complete_groups(w, mode, s.middle);
        rigid_torques(w, mode, s.middle);
    }
    return loss;
}

}  // namespace shiftrig::plant::detail
