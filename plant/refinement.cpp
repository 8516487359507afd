#include "plant/refinement.h"

#include <algorithm>
#include <cmath>

#include "plant/modes.h"

namespace shiftrig::plant::detail {
namespace {

constexpr double force_tolerance = 2e-5;  // of the largest torque
constexpr double swing_tolerance = 2e-5;
constexpr double speed_tolerance = 1e-6;  // of the largest speed

double largest_torque(const ModelData& m, const Sample& s) {
    double largest = 0;
    for (int k = 0; k < m.torques; ++k) largest = std::max(largest, std::fabs(s.torque[k]));
    for (int k = 0; k < m.first_flank_force; ++k) largest = std::max(largest, std::fabs(s.f[k]));
    return largest;
}

}  // namespace

bool is_coarse(Work& w, const Mode& mode) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    const Sample &begin = w.scratch.begin(), &half = w.scratch.half, &late = w.scratch.late,
                 &end = w.scratch.end();
    const double size = std::max(largest_torque(m, begin), largest_torque(m, end));
    // The last stage stands on an extrapolation: what it takes the forces to be, and what they are.
    double wrong = 0;
    for (int k = 0; k < m.forces; ++k) {
        if (k < m.pairs && w.contact[k] == locked) continue;
        wrong = std::max(wrong, std::fabs(end.f[k] - late.f[k]));
    }
    if (wrong > force_tolerance * size) return true;
    // A light body makes much of a little torque: what that difference would do to the speeds at the end.
    if (wrong > 1e-3 * force_tolerance * size) {
        double* difference = w.scratch.vector_c;
        double* change = w.scratch.vector_b;
        for (int k = 0; k < m.forces; ++k) difference[k] = end.f[k] - late.f[k];
        m.kernel.multiply(w.scratch.used.from_late, padded(mode.order), m.forces, difference, nullptr,
                          change);
        double fastest = 0, moved = 0;
        for (int j = 0; j < m.masses; ++j) fastest = std::max(fastest, std::fabs(end.z[j]));
        for (int i = 0; i < mode.order; ++i) {
            if (mode.coordinates[i] < m.masses) moved = std::max(moved, std::fabs(change[i]));
        }
        if (moved > speed_tolerance * fastest) return true;
    }
    // Twists (the last coordinates, just before f) half way, exact and by the cubic through both ends: what lies between
    // does not show at the ends.
    const double h = end.at.time - begin.at.time;
    double hidden = 0;
    for (int e = 0; e < m.twists; ++e) {
        const auto& links = m.shaft_rate[static_cast<std::size_t>(e)];
        const int i = m.masses + e;
        const double cubic =
            0.5 * (begin.z[i] + end.z[i]) + h / 8 * (slip_fast(links, begin.z) - slip_fast(links, end.z));
        hidden = std::max(hidden, m.structure.shafts[static_cast<std::size_t>(e)].stiffness *
                                      std::fabs(half.f[e - m.twists] - cubic));
    }
    return hidden > swing_tolerance * size;
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
