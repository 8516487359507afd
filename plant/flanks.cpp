#include "plant/flanks.h"

#include <algorithm>
#include <cmath>

#include "plant/telling.h"
#include "plant/transitions.h"

namespace shiftrig::plant::detail {
namespace {

struct Twist {
    double angle, rate;
};
Twist twist_of(const ModelData& m, const BacklashLaw& law, const Sample& s) {
    return {s.z[m.masses + law.shaft], slip_fast(m.shaft_rate[static_cast<std::size_t>(law.shaft)], s.z)};
}
Twist twist_half_way(const Work& w, const BacklashLaw& law) {
    const Sample& half = w.scratch.half;
    return {half.f[law.shaft - w.model.twists], half.slip[law.force]};
}

// The one that is closed, or the nearer of two open ones.
Flank nearest_flank(const Work& w, const BacklashLaw& law, Twist t) {
    const double side = flank_side(w.contact[law.device]);
    if (side != 0) return {law, side, true};
    const bool forward = open_margin(law, 1, t.angle, t.rate) < open_margin(law, -1, t.angle, t.rate);
    return {law, forward ? 1. : -1., false};
}
double margin_of(const Flank& flank, Twist t) {
    return flank.closed ? closed_margin(flank.law, flank.side, t.angle, t.rate)
                        : open_margin(flank.law, flank.side, t.angle, t.rate);
}

}  // namespace

double flank_margin(const Work& w, const BacklashLaw& law, const Sample& s) SHIFTRIG_REALTIME {
    const Twist t = twist_of(w.model, law, s);
    return margin_of(nearest_flank(w, law, t), t);
}

double flank_margin_half_way(const Work& w, const BacklashLaw& law) SHIFTRIG_REALTIME {
    const Twist t = twist_half_way(w, law);
    return margin_of(nearest_flank(w, law, t), t);
}

Flank violated_flank(const Work& w, const BacklashLaw& law, const Sample& end) SHIFTRIG_REALTIME {
    return nearest_flank(w, law, twist_of(w.model, law, end));
}

double margin_of(const Work& w, const Flank& flank, const Sample& s) SHIFTRIG_REALTIME {
    return margin_of(flank, twist_of(w.model, flank.law, s));
}

double margin_half_way(const Work& w, const Flank& flank) SHIFTRIG_REALTIME {
    return margin_of(flank, twist_half_way(w, flank.law));
}

double margin_rate(const Work& w, const Flank& flank, const Sample& s) SHIFTRIG_REALTIME {
    const auto& [law, side, closed] = flank;
    const auto& links = w.model.shaft_rate[static_cast<std::size_t>(law.shaft)];
    const double rate = slip_fast(links, s.z), acceleration = slip_fast(links, s.rate);
    const bool damped = closed || side * rate < 0;
    const double rises = side * (law.stiffness * rate + (damped ? law.damping * acceleration : 0));
    return closed ? rises : -rises;
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
        // At the end it may be strained yet, and recede faster than its damping lets it follow.
        if (side * twist > law.half_gap && open_margin(law, side, to, to_rate) > 0) first = theta;
    }
    return first;
}

bool may_let_go_between(const Work& w, const BacklashLaw& law) SHIFTRIG_REALTIME {
    const double side = flank_side(w.contact[law.device]);
    if (side == 0) return false;
    const Sample &begin = w.scratch.begin(), &end = w.scratch.end();
    const double h = end.at.time - begin.at.time;
    const Twist from = twist_of(w.model, law, begin), half = twist_half_way(w, law),
                to = twist_of(w.model, law, end);
    const auto margin = [&](const Twist& t) { return closed_margin(law, side, t.angle, t.rate); };
    const double least = std::min({margin(from), margin(half), margin(to)});
    // Angle and rate half way, exact and by the cubic through both ends. A whole turn of a swing shows in the rate alone, as three
    // times its angle over h.
    const double angle = 0.5 * (from.angle + to.angle) + h / 8 * (from.rate - to.rate);
    const double rate = 1.5 * (to.angle - from.angle) / h - 0.25 * (from.rate + to.rate);
    const double unseen_rate = std::fabs(half.rate - rate);
    const double unseen = 8 * std::fabs(half.angle - angle) + h * unseen_rate;
    return law.stiffness * (unseen - 1e-5 * law.half_gap) + law.damping * unseen_rate >
           least + flank_rounding(law);
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
    const double next = side != 0 ? 0 : nearest_flank(w, law, {twist, rate}).side;
    state = closed_flank(next);
    w.scratch.dissipated += flank_energy(law, side, twist) - flank_energy(law, next, twist);
    log_event(w, {.time = s.at.time,
                  .kind = side == 0 ? EventKind::flank_closes : EventKind::flank_opens,
                  .device = device_index(law.device),
                  .torque = flank_torque(law, side + next, twist, rate),
                  .slip = rate,
                  .value = side + next});
}

}  // namespace shiftrig::plant::detail
