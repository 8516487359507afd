// Which device changes first within a part of a step, and where.
#include <algorithm>
#include <cmath>

#include "plant/ark3.h"
#include "plant/devices.h"
#include "plant/flanks.h"
#include "plant/stuck_meshes.h"
#include "plant/transitions.h"
#include "plant/wedged.h"

namespace shiftrig::plant::detail {
namespace {

// Power that turns round by less is corrected, not located: loss that changes, of the largest torque.
constexpr double small_loss = 1e-4, small_loss_of_parts = 1e-7;

// A locked pair that carries more than this of what it holds may have carried more yet within the part.
constexpr double strained = 0.8;

// Root in [0, 1] of the parabola through g(0), its slope there (per unit length) and g(1) < 0.
double parabola_root(double g0, double slope, double g1) {
    if (g0 <= 0) {
        if (slope <= 0) return 0;
        g0 = 0;
    }
    const double a = g1 - g0 - slope;
    const double root = std::sqrt(std::max(0., slope * slope - 4 * a * g0));
    const double q = -0.5 * (slope + (slope < 0 ? -root : root));
    double theta = g0 == 0 ? (a != 0 ? -slope / a : 1) : q > 0 ? g0 / q : a != 0 ? q / a : 1;
    if (!(theta >= 0 && theta <= 1)) theta = a != 0 ? q / a : 1;
    return std::clamp(theta, 0., 1.);
}

double margin(const Work& w, int device, const Sample& s) {
    if (device >= w.model.first_flank) return flank_margin(w, backlash_of(w, device), s);
    const unsigned char state = w.contact[device];
    if (device >= w.model.pairs) return motion_sign(state) * device_slip(w, device, s.z);
    if (state == locked) return static_margin(w, device, s);
    return slip_sign(state) * device_slip(w, device, s.z);
}

double turning_margin(const Work& w, int device, const Sample& s) {
    const unsigned char state = w.contact[device];
    const double sign = motion_sign(state);
    return (s.torque[device] - loss_kink(w, device - w.model.pairs, sign)) * sign * loss_exponent(state);
}

SpeedCheck speed_check(const Work& w) {
    const ScratchData& s = w.scratch;
    return {w.operators.table.sense, s.begin().slip, s.half.slip, s.end().slip, w.model.law_rows};
}

// Is a locked pair under more than this share of what it holds? On a tree any pair may be locked, otherwise the
// first rows of the mode tell which.
bool some_pair_strained(const Work& w, const Mode& mode, double share, const Sample& s) {
    const int count = mode.tree ? w.model.pairs : mode.first_mesh;
    bool found = false;
    for (int i = 0; i < count; ++i) {
        const int k = mode.tree ? i : mode.rows[i];
        found |= w.contact[k] == locked && std::fabs(s.torque[k]) > share * s.holding[k];
    }
    for (const int k : w.model.one_way_pairs)
        found |= w.contact[k] == locked && std::fabs(s.torque[k]) > share * static_limit(w, k, s);
    return found;
}

// Is every state good until the end of the part? The usual answer, quickly; a no only sends us to look closely.
bool all_hold(const Work& w, const Mode& mode, const Sample& end) {
    const ModelData& m = w.model;
    if (mode.rests || mode.wedges || some_pair_strained(w, mode, 1, end) ||
        !m.kernel.loops.senses_hold(speed_check(w)))
        return false;
    const ContactTable& table = w.operators.table;
    const double *const drive = table.drive, *const offset = table.drive_offset,
                        *const torque = end.torque + m.pairs;
    bool turned = false;
    for (int k = 0, meshes = m.meshes; k < meshes; ++k) turned |= drive[k] * torque[k] - offset[k] < 0;
    if (turned || !mode.tree) return !turned;
    for (const int k : m.lossy_meshes) {  // a tree has no motions in its view
        if (motion_sign(w.contact[m.pairs + k]) *
                slip_fast(m.mesh_motion[static_cast<std::size_t>(k)], end.z) <
            0)
            return false;
    }
    return true;
}

// Has a locked pair so little left to its weak limit, at an end of the part, that it may have had nothing within? That limit
// may be zero: little is measured by the torques.
bool is_near_weak_limit(const Work& w, int pair, const Sample& begin, const Sample& end) {
    const double sense = w.model.pair_laws[static_cast<std::size_t>(pair)].weak_sense;
    const double t0 = sense * begin.torque[pair], t1 = sense * end.torque[pair];
    return static_limit(w.model, pair, sense, end) - std::max(t0, t1) <
           (1 - strained) * std::max(std::fabs(t0), std::fabs(t1));
}

// What holds half way, and the internal torques there: a stage knows neither. Its coordinates are there, but on a tree.
void complete_half(Work& w, const Mode& mode) {
    if (mode.tree) return tree_half(w, mode);
    evaluate_forces(w, w.contact, w.scratch.half);
    active_torques(w.model, mode, w.scratch.half);
}

}  // namespace

bool violated(const Work& w, const Mode& mode, int device, const Sample& end) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    const unsigned char state = w.contact[device];
    if (device < m.pairs) {
        if (state == locked) return is_overloaded(w, device, end);
        if (state == free_running || mode.bound[device]) return false;
    } else if (state == stuck || mode.bound[device] || !mesh_of(w, device - m.pairs).lossy()) {
        return false;
    }
    const double sign = device < m.pairs ? slip_sign(state) : motion_sign(state);
    const double slip = sign * device_slip(w, device, end.z);
    return slip < 0 && slip < -1e-13 * slip_scale(w, device, end.z);
}

double crossing_margin(Work& w, const Mode& mode, const Crossing& crossing, Sample& s) SHIFTRIG_REALTIME {
    switch (crossing.change) {
        case Change::state:
        case Change::overrun:
        case Change::flank:
            return margin(w, crossing.device, s);
        case Change::hold:
            return wedged_excess(w, mode, crossing.device, s);
        case Change::turn:
            return turning_margin(w, crossing.device, s);
        case Change::release:
            return -release_drive(w, mode, crossing.device - w.model.pairs, s);
        case Change::limit:
            return loss_left(w, crossing.device - w.model.pairs, s);
    }
    return 0;
}

double first_dip(Work& w, const Mode& mode) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    const Sample &begin = w.scratch.begin(), &half = w.scratch.half, &end = w.scratch.end();
    double first = 1;
    if (mode.tree) return first;
    const bool by_speeds_alone =
        m.one_way_pairs.empty() && m.backlashes.empty() && !some_pair_strained(w, mode, strained, end);
    if (by_speeds_alone && !m.kernel.loops.may_dip(speed_check(w))) return first;
    // The least of the parabola through three margins; that they are about to vanish is enough to look closer.
    const auto consider = [&](double g0, double gm, double g1) {
        const double slope = 4 * gm - 3 * g0 - g1, bend = 2 * (g0 - 2 * gm + g1);
        if (!(slope < 0 && slope + 2 * bend > 0 && g0 >= 0 && g1 > 0))
            return;  // falling at first, rising at last
        const double theta = -0.5 * slope / bend;
        if (theta > 0.02 && theta < 0.98 && g0 + 0.5 * slope * theta < 0.1 * std::min(g0, g1))
            first = std::min(first, theta);
    };
    // What has just been let go begins at zero: it may be driven back at first.
    const auto begun = [](double slip) { return std::fabs(slip) < at_rest ? 0 : slip; };
    bool torques_known = false;
    const auto consider_torque = [&](int k) {
        if (!torques_known) complete_half(w, mode);
        torques_known = true;
        consider(margin(w, k, begin), margin(w, k, half), margin(w, k, end));
    };
    for (int k = 0; k < m.pairs; ++k) {
        const unsigned char state = w.contact[k];
        if (slips(state)) {
            const double sign = slip_sign(state);
            consider(begun(sign * begin.slip[k]), sign * half.slip[k], sign * end.slip[k]);
        } else if (state == locked && std::fabs(end.torque[k]) > strained * end.holding[k]) {
            consider_torque(k);
        }
    }
    for (const int k : m.one_way_pairs) {
        if (w.contact[k] == locked && is_near_weak_limit(w, k, begin, end)) consider_torque(k);
    }
    for (const BacklashLaw& law : m.backlashes) {
        first = std::min(first, touch_between(w, law, begin, end));
        if (flank_side(w.contact[law.device]) != 0)
            consider(flank_margin(w, law, begin), flank_margin_half_way(w, law), flank_margin(w, law, end));
    }
    for (const int k : m.lossy_meshes) {
        const unsigned char state = w.contact[m.pairs + k];
        if (state == stuck || mode.bound[m.pairs + k]) continue;
        const double sign = motion_sign(state);
        consider(begun(sign * begin.motion[k]), sign * half.motion[k], sign * end.motion[k]);
    }
    return first;
}

Crossing first_crossing(Work& w, const Mode& mode, Sample& begin, Sample& end,
                        bool locates) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    w.scratch.turned = false;
    Crossing first;
    if (all_hold(w, mode, end) && flanks_hold(w, end)) return first;
    // Of those that give way at the beginning already, since they are pressed from nothing, the one goes first that falls
    // shortest of its load, `use`.
    double use_of_first = 0;
    const auto consider = [&](const Crossing& next, double use = 0) {
        const bool by_time = locates || is_event(next.change) == is_event(first.change);
        const bool at_once = next.theta == 0 && first.theta == 0 && use_of_first > 0;
        const bool earlier = next.theta < first.theta || (at_once && use > use_of_first);
        if (first.device >= 0 && !(by_time ? earlier : is_event(next.change))) return;
        first = next;
        use_of_first = use;
    };
    bool rates_known = false, middle_known = false, begin_known = false;
    for (int k = 0; k < m.first_flank; ++k) {
        if (!violated(w, mode, k, end)) continue;
        double theta, use = 0;
        Change change = Change::state;
        if (k < m.pairs && w.contact[k] == locked) {
            if (!middle_known) complete_half(w, mode);
            middle_known = true;
            const double g0 = margin(w, k, begin), gm = margin(w, k, w.scratch.half), g1 = margin(w, k, end);
            theta = g0 <= 0 ? 0 : parabola_root(g0, 4 * gm - 3 * g0 - g1, g1);
            if (is_weak(m, k, opening_sense(w, k, end.torque[k], end))) change = Change::overrun;
            if (theta == 0) use = std::fabs(end.torque[k]) / static_limit(w, k, end);
        } else {
            if (!rates_known) sample_rate(w, mode, begin);
            rates_known = true;
            const double sign = k < m.pairs ? slip_sign(w.contact[k]) : motion_sign(w.contact[k]);
            const double length = end.at.time - begin.at.time;
            theta = parabola_root(margin(w, k, begin), sign * device_slip(w, k, begin.rate) * length,
                                  margin(w, k, end));
        }
        consider({k, theta, change}, use);
    }
    for (int k = 0; mode.wedges && k < m.pairs; ++k) {
        if (!is_wedged(w, mode, k) || !may_hold(w, mode, k, end)) continue;
        if (!middle_known) complete_half(w, mode);
        middle_known = true;
        Sample& half = w.scratch.half;
        if (!mode.tree) show(m, mode, half.f - mode.order, half, padded(m.seen));  // asked in another mode
        const double g0 = wedged_excess(w, mode, k, begin), gm = wedged_excess(w, mode, k, half),
                     g1 = wedged_excess(w, mode, k, end);
        consider({k, parabola_root(g0, 4 * gm - 3 * g0 - g1, g1), Change::hold});
    }
    if (!m.backlashes.empty()) {
        const Crossing flank = first_flank(w, begin, end);
        if (flank.device >= 0) consider(flank);
    }
    for (int r = mode.row_count - 1; r >= 0 && mode.rows[r] >= m.pairs + m.meshes; --r) {
        const int leader = mode.rows[r] - m.pairs - m.meshes;
        if (is_held(w, leader, end)) continue;
        const double drive = release_drive(w, mode, leader, end);
        if (drive <= 0) {
            const double left = loss_left(w, leader, end), rounding = 1e-9 * torque_scale(w, end);
            if (left >= -rounding) continue;
            if (!begin_known) internal_torques(w, mode, begin);
            begin_known = true;
            const double before = loss_left(w, leader, begin);
            if (before < -rounding) continue;  // already, and nobody took the rest
            const double theta = std::max(before, 0.) / (std::max(before, 0.) - left);
            consider({m.pairs + leader, theta, Change::limit});
            continue;
        }
        const double before = std::min(release_drive(w, mode, leader, begin), 0.);
        const double theta = before / (before - drive);
        consider({m.pairs + leader, theta, Change::release});
    }
    w.scratch.turned = false;
    double size = 0;
    const double small = m.maximum_parts == 1 ? small_loss : small_loss_of_parts;
    for (int k = m.pairs; k < m.first_flank; ++k) {
        if (w.contact[k] == stuck || mode.bound[k] || !mesh_of(w, k - m.pairs).lossy()) continue;
        const double g1 = turning_margin(w, k, end);
        if (g1 >= 0) continue;
        w.scratch.turned = true;
        if (mode.tree) continue;
        if (size == 0) size = torque_scale(w, end);
        if (g1 * loss_difference(mesh_of(w, k - m.pairs)) >= -small * size) continue;
        if (!middle_known) complete_half(w, mode);
        middle_known = true;
        const double g0 = turning_margin(w, k, begin), gm = turning_margin(w, k, w.scratch.half);
        if (g0 <= 0 && gm >= 0)
            continue;  // just turned: within rounding of the point where both losses agree
        // From no torque at all the other loss acts from the beginning: θ is 0 then.
        const double theta = parabola_root(g0, 4 * gm - 3 * g0 - g1, g1);
        consider({k, theta, Change::turn});
    }
    return first;
}

Crossing first_flank(const Work& w, const Sample& begin, const Sample& end) SHIFTRIG_REALTIME {
    Crossing first;
    for (const BacklashLaw& law : w.model.backlashes) {
        if (!is_flank_violated(w, law, end)) continue;
        const Flank flank = violated_flank(w, law, end);
        const double g0 = margin_of(w, flank, begin), g1 = margin_of(w, flank, end);
        const double gm = margin_half_way(w, flank);
        const double theta = parabola_root(g0, 4 * gm - 3 * g0 - g1, g1);
        if (first.device < 0 || theta < first.theta) first = {law.device, theta, Change::flank};
    }
    return first;
}

bool hides_contact(const Work& w) SHIFTRIG_REALTIME {
    for (const BacklashLaw& law : w.model.backlashes) {
        if (is_flank_violated(w, law, w.scratch.end())) continue;
        if (is_flank_violated(law, flank_margin_half_way(w, law)) || may_let_go_between(w, law)) return true;
    }
    return false;
}

}  // namespace shiftrig::plant::detail
