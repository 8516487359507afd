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
    for (int k = 0; k < m.forces; ++k) largest = std::max(largest, std::fabs(s.f[k]));
    return largest;
}

}  // namespace

bool is_coarse(Work& w, const Mode& mode) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    const Sample &begin = w.scratch.begin, &half = w.scratch.half, &late = w.scratch.late, &end = w.scratch.end;
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
        double* difference = w.scratch.vector_c.data();
        double* change = w.scratch.vector_b.data();
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
    // Twists half way, exact and by the cubic through both ends: what lies between does not show at the ends.
    const double h = end.at.time - begin.at.time;
    double hidden = 0;
    for (int e = 0; e < m.twists; ++e) {
        const auto& links = m.shaft_rate[static_cast<std::size_t>(e)];
        const int i = m.masses + e;
        const double cubic = 0.5 * (begin.z[i] + end.z[i]) + h / 8 * (slip_fast(links, begin.z) - slip_fast(links, end.z));
        hidden = std::max(hidden, m.structure.shafts[static_cast<std::size_t>(e)].stiffness * std::fabs(half.z[i] - cubic));
    }
    return hidden > swing_tolerance * size;
}

}  // namespace shiftrig::plant::detail
