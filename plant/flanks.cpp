#include "plant/flanks.h"

#include <algorithm>
#include <cmath>

#include "plant/transitions.h"

namespace shiftrig::plant::detail {
namespace {

struct Twist {
    double angle, rate;
};
Twist twist_of(const ModelData& m, const BacklashLaw& law, const Sample& s) {
    return {s.z[m.masses + law.shaft], slip_fast(m.shaft_rate[static_cast<std::size_t>(law.shaft)], s.z)};
}

double flank_margin(const Work& w, const BacklashLaw& law, double twist, double rate) {
    const double side = flank_side(w.contact[law.device]);
    if (side != 0) return closed_margin(law, side, twist, rate);
    return std::min(open_margin(law, 1, twist, rate), open_margin(law, -1, twist, rate));
}

}  // namespace

double flank_margin(const Work& w, const BacklashLaw& law, const Sample& s) SHIFTRIG_REALTIME {
    const auto [twist, rate] = twist_of(w.model, law, s);
    return flank_margin(w, law, twist, rate);
}

double flank_margin_half_way(const Work& w, const BacklashLaw& law) SHIFTRIG_REALTIME {
    const Sample& half = w.scratch.half;
    const double twist = half.f[law.shaft - w.model.twists], rate = half.slip[law.force];
    return flank_margin(w, law, twist, rate);
}

bool is_flank_violated(const Work& w, const BacklashLaw& law, const Sample& s) SHIFTRIG_REALTIME {
    return is_flank_violated(law, flank_margin(w, law, s));
}

double touch_between(const Work& w, const BacklashLaw& law, const Sample& begin,
                     const Sample& end) SHIFTRIG_REALTIME {
    if (flank_side(w.contact[law.device]) != 0) return 1;
    const double h = end.at.time - begin.at.time;
    const auto [from, from_rate] = twist_of(w.model, law, begin);
    const auto [to, to_rate] = twist_of(w.model, law, end);
    // φ = from + θ (c + θ (b + θ a)); its rate vanishes at two θ.
    const double c = from_rate * h, a = c + to_rate * h - 2 * (to - from), b = to - from - c - a;
    const double root = b * b - 3 * a * c;
    if (root <= 0) return 1;
    const double q = -(b + std::copysign(std::sqrt(root), b));
    double first = 1;
    for (const double theta : {q / (3 * a), c / q}) {
        if (!(theta > 1e-3 && theta < first)) continue;
        const double twist = from + theta * (c + theta * (b + theta * a)), side = twist < 0 ? -1 : 1;
        if (side * twist > law.half_gap && side * to < law.half_gap) first = theta;
    }
    return first;
}

bool flanks_hold(const Work& w, const Sample& end) SHIFTRIG_REALTIME {
    for (const BacklashLaw& law : w.model.backlashes) {
        if (is_flank_violated(w, law, end)) return false;
    }
    return true;
}

void change_flank(Work& w, const BacklashLaw& law, Sample& s) SHIFTRIG_REALTIME {
    const auto [twist, rate] = twist_of(w.model, law, s);
    unsigned char& state = w.contact[law.device];
    const double side = flank_side(state);
    const double next = side != 0                                                              ? 0
                        : open_margin(law, 1, twist, rate) < open_margin(law, -1, twist, rate) ? 1
                                                                                               : -1;
    state = closed_flank(next);
    w.scratch.dissipated += flank_energy(law, side, twist) - flank_energy(law, next, twist);
    log_event(w, side == 0 ? EventKind::flank_closes : EventKind::flank_opens, law.device, s.at.time,
              flank_torque(law, side + next, twist, rate), side + next, rate);
}

}  // namespace shiftrig::plant::detail
