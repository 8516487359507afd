#include "plant/refinement.h"

#include <algorithm>
#include <cmath>

#include "plant/ark3.h"
#include "plant/devices.h"
#include "plant/modes.h"

namespace shiftrig::plant::detail {
namespace {

// Of the largest torque, of the largest speed, of the way that the fastest mass turns.
constexpr double force_tolerance = 2e-5, swing_tolerance = 2e-5, speed_tolerance = 1e-6,
                 twist_tolerance = 3e-6;
constexpr double rounding = 1e-9;  // of the torques in shafts: by so much they differ where nothing swings

// Is this more than so much of the largest torque? That the forces are among these mostly settles it.
bool exceeds(const Work& w, double torque, double share) {
    const ModelData& m = w.model;
    const DeviceLoops& loops = m.kernel.loops;
    const auto within = [=](double size) { return !(torque > share * size); };
    const Sample &begin = w.scratch.begin(), &end = w.scratch.end();
    return !within(loops.largest(end.f, m.first_flank_force)) &&
           !within(loops.largest(end.torque, m.torques)) &&
           !within(loops.largest(begin.f, m.first_flank_force)) &&
           !within(loops.largest(begin.torque, m.torques));
}

// The last stage stands on an extrapolation: what it took the forces to be, `late`, and what they are. A light body makes much
// of a little torque, so speeds matter as well: at the end they differ by at most `reach` times the largest of those
// differences, and by change() in fact.
template <typename Change>
bool takes_forces_amiss(const Work& w, const double* late, double reach, const Change& change) {
    const ModelData& m = w.model;
    const DeviceLoops& loops = m.kernel.loops;
    const Sample& end = w.scratch.end();
    const double wrong = loops.largest_difference(end.f, late, m.forces);
    if (wrong == 0) return false;
    const double much = speed_tolerance * loops.largest(end.z, m.masses);
    return (reach * wrong > much && change() > much) || exceeds(w, wrong, force_tolerance);
}

// Friction that falls as the slip grows lets it grow by itself, as e^(λt): what is amiss while it is small grows with it,
// however little torque that is. The stages follow λ times the length of the part up to this. Friction that falls as the slip
// shrinks holds it up as a damper would, and is taken explicitly.
constexpr double most_growth = 0.15, most_damping = 1, growing = 1.2;

// `answer(k)`: by how much a torque of 1 Nm, over the part, changes the slip of pair k.
template <typename Answer>
bool friction_outruns_stages(const Work& w, const Answer& answer) {
    const ModelData& m = w.model;
    if (!w.operators.table.fades && m.tabled_pairs.empty()) return false;
    const Sample &begin = w.scratch.begin(), &end = w.scratch.end();
    for (int k = 0; k < m.pairs; ++k) {
        if (!slips(w.contact[k])) continue;
        // One that passes through no slip is past all that there is.
        const double from = std::fabs(begin.slip[k]),
                     to = std::fmax(0, slip_sign(w.contact[k]) * end.slip[k]);
        const bool grows = to > growing * from, shrinks = from > growing * to;
        const FrictionLaw& law = m.pair_laws[static_cast<std::size_t>(k)].friction;
        const bool fades = law.factor_over_slip == nullptr && law.rise >= 0;
        if (!grows && (!shrinks || fades)) continue;
        const double before = sliding_factor(law, from), fall = before - sliding_factor(law, to);
        if (!(fall > rounding * before)) continue;
        const double steepness = std::max(begin.load[k], end.load[k]) * fall / std::fabs(to - from);
        if (steepness * answer(k) > (grows ? most_growth : most_damping)) return true;
    }
    return false;
}

// The last stage weighs a sixth of the part.
double dense_answer(const Work& w, const Mode& mode, int k) {
    const ModelData& m = w.model;
    const int n = mode.order, seen = padded(m.seen), block = padded(n);
    double change = 0;
    for (int c = 0; c < n; ++c)
        change += mode.view[panel_index(seen, n, k, c)] *
                  w.scratch.used.from_late[panel_index(block, m.forces, c, k)];
    return 6 * std::fabs(change);
}

double tree_answer(const TreeMode& t, double length, int k) {
    const GroupPairs &slip = t.forces.slip, &share = t.forces.share;
    double mobility = 0;
    for (int i = 0; i < t.forces.count; ++i) {
        if (t.forces.place[i] != k) continue;
        mobility = slip.of_first[i] * share.of_first[i] * t.inverse_mass[share.first[i]] +
                   slip.of_second[i] * share.of_second[i] * t.inverse_mass[share.second[i]];
    }
    return std::fabs(mobility) * length;
}

// Twists (the last coordinates, just before f) half way, exact and by the cubic through both ends: what lies between does
// not show at the ends.
bool hides_swing(const Work& w) {
    const ModelData& m = w.model;
    const Sample &begin = w.scratch.begin(), &half = w.scratch.half, &end = w.scratch.end();
    const double h = end.at.time - begin.at.time;
    double hidden = 0, strain = 0;
    for (int e = 0; e < m.twists; ++e) {
        const auto& links = m.shaft_rate[static_cast<std::size_t>(e)];
        const int i = m.masses + e;
        const double cubic =
            0.5 * (begin.z[i] + end.z[i]) + h / 8 * (slip_fast(links, begin.z) - slip_fast(links, end.z));
        const double stiffness = m.structure.shafts[static_cast<std::size_t>(e)].stiffness;
        hidden = std::max(hidden, stiffness * std::fabs(half.f[e - m.twists] - cubic));
        strain = std::max(strain, stiffness * std::fabs(end.z[i]));
    }
    return hidden > rounding * strain && exceeds(w, hidden, swing_tolerance);
}

bool is_dense_coarse(Work& w, const Mode& mode) {
    const ModelData& m = w.model;
    const Sample &late = w.scratch.late, &end = w.scratch.end();
    const auto change = [&] {
        double* difference = w.scratch.vector_c;
        double* changed = w.scratch.vector_b;
        m.kernel.loops.subtract(end.f, late.f, m.forces, difference);
        m.kernel.multiply(w.scratch.used.from_late, padded(mode.order), m.forces, difference, nullptr,
                          changed);
        double moved = 0;
        for (int i = 0; i < mode.order; ++i) {
            if (mode.coordinates[i] < m.masses) moved = std::max(moved, std::fabs(changed[i]));
        }
        return moved;
    };
    return takes_forces_amiss(w, late.f, w.scratch.used.late_reach, change) ||
           friction_outruns_stages(w, [&](int k) { return dense_answer(w, mode, k); }) || hides_swing(w);
}

// Along the tree shafts are not exact: the embedded method says how near they are. Where all stand still it says what rounding does.
bool swings_between(const Work& w, const Mode& mode) {
    const DeviceLoops& loops = w.model.kernel.loops;
    const Sample &begin = w.scratch.begin(), &end = w.scratch.end();
    const Swing& seen = w.scratch.tree.swing_seen;
    const double h = end.at.time - begin.at.time;
    if (!(seen.error > twist_tolerance * h * std::max(seen.fastest, at_rest))) return false;
    const TreePaths& paths = mode.tree->paths;
    return seen.error * loops.largest(paths.stiffness, paths.groups) >
           rounding * loops.largest(end.groups.passed, paths.groups);
}

bool is_tree_coarse(Work& w, const Mode& mode) {
    const ModelData& m = w.model;
    const Sample &begin = w.scratch.begin(), &end = w.scratch.end();
    const TreeMode& t = *mode.tree;
    const TreeWork& v = w.scratch.tree;
    const double h = end.at.time - begin.at.time, weight = ark3_gamma * h;  // of the last stage
    const double* const late = v.effort[3];
    const auto change = [&] {
        double* const difference = w.scratch.vector_c;
        m.kernel.loops.subtract(end.f, late, m.forces, difference);
        std::fill(v.load, v.load + t.paths.groups, 0.);
        m.tree->kernel.give(t.forces, {1, &difference, &weight}, t.inverse_mass, v.load);
        double* const of_mass = w.scratch.vector_b;
        m.tree->kernel.spread(t.masses, v.load, m.masses, of_mass);
        return m.kernel.loops.largest(of_mass, m.masses);
    };
    return swings_between(w, mode) || takes_forces_amiss(w, late, weight * t.liveliness, change) ||
           friction_outruns_stages(w, [&](int k) { return tree_answer(t, h, k); });
}

}  // namespace

bool is_coarse(Work& w, const Mode& mode) SHIFTRIG_REALTIME {
    return mode.tree ? is_tree_coarse(w, mode) : is_dense_coarse(w, mode);
}

double first_knot(const Work& w) SHIFTRIG_REALTIME {
    constexpr double edge = 1e-3;  // nearer to an end of the part than this is there
    double first = 1;
    for (const int k : w.model.tabled_pairs) {
        if (!slips(w.contact[k])) continue;
        const double s0 = std::fabs(w.scratch.begin().slip[k]), s1 = std::fabs(w.scratch.end().slip[k]);
        // The engine for long chains has no stage half way.
        const double sm = w.model.tree ? 0.5 * (s0 + s1) : std::fabs(w.scratch.half.slip[k]);
        for (const auto& [knot, factor] :
             *w.model.pair_laws[static_cast<std::size_t>(k)].friction.factor_over_slip) {
            if ((knot - s0) * (knot - s1) >= 0) continue;
            // On the parabola through the three, from the straight line.
            const double a = 2 * (s0 - 2 * sm + s1), b = 4 * sm - 3 * s0 - s1;
            double theta = (knot - s0) / (s1 - s0);
            for (int i = 0; i < 2; ++i) {
                const double slope = b + 2 * a * theta;
                if (slope != 0) theta -= (s0 + theta * (b + theta * a) - knot) / slope;
            }
            if (theta > edge && theta < 1 - edge) first = std::min(first, theta);
        }
    }
    return first;
}

}  // namespace shiftrig::plant::detail
