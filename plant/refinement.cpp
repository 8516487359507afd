#include "plant/refinement.h"

#include <algorithm>
#include <cmath>

namespace shiftrig::plant::detail {
namespace {

constexpr double force_tolerance = 2e-5;  // of the largest torque
constexpr double swing_tolerance = 2e-5;

double largest_torque(const ModelData& m, const Sample& s) {
    double largest = 0;
    for (int k = 0; k < m.torques; ++k) largest = std::max(largest, std::fabs(s.torque[k]));
    for (int k = 0; k < m.first_flank_force; ++k) largest = std::max(largest, std::fabs(s.f[k]));
    return largest;
}

}  // namespace

bool is_coarse(const Work& w) SHIFTRIG_REALTIME {
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
    // Twists (the last coordinates, just before f) half way, exact and by the cubic through both ends: what lies between does not show at the ends.
    const double h = end.at.time - begin.at.time;
    double hidden = 0;
    for (int e = 0; e < m.twists; ++e) {
        const auto& links = m.shaft_rate[static_cast<std::size_t>(e)];
        const int i = m.masses + e;
        const double cubic = 0.5 * (begin.z[i] + end.z[i]) + h / 8 * (slip_fast(links, begin.z) - slip_fast(links, end.z));
        hidden = std::max(hidden, m.structure.shafts[static_cast<std::size_t>(e)].stiffness * std::fabs(half.f[e - m.twists] - cubic));
    }
    return hidden > swing_tolerance * size;
}

}  // namespace shiftrig::plant::detail
