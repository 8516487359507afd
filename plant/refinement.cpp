#include "plant/refinement.h"

#include <algorithm>
#include <cmath>

#include "plant/ark3.h"
#include "plant/devices.h"
#include "plant/laws/engine.h"
#include "plant/laws/tyre.h"
#include "plant/modes.h"

namespace shiftrig::plant::detail {
namespace {

// Of the largest torque, of the largest speed, of the way that the fastest mass turns.
// What the shortest parts leave of forces is told of where it is ten times as much: their extrapolation errs by more than they do.
constexpr double force_tolerance = 2e-6, told_force_tolerance = 2e-5, swing_tolerance = 2e-5,
                 speed_tolerance = 1e-6, twist_tolerance = 3e-6;
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
// differences, and by change() in fact. `other`: a torque that is amiss besides.
template <typename Change>
bool takes_forces_amiss(const Work& w, double tolerance, const double* late, double reach,
                        const Change& change, double other = 0) {
    const ModelData& m = w.model;
    const DeviceLoops& loops = m.kernel.loops;
    const Sample& end = w.scratch.end();
    const double wrong = loops.largest_difference(end.f, late, m.forces);
    if (wrong == 0 && other == 0) return false;
    const double much = speed_tolerance * loops.largest(end.z, m.masses);
    return (reach * wrong > much && change() > much) || exceeds(w, std::max(wrong, other), tolerance);
}

// Slow states (slip of tyres, torque and boost of engines) stand on the same stage, which weighs so much [s]: the torque that
// they would be off by. A wheel that swings on its tyre shows in the forces twice a turn not at all.
double slow_states_amiss(const Work& w, double weight) {
    const ModelData& m = w.model;
    if (m.auxiliary == 0) return 0;
    const Sample &late = w.scratch.late, &end = w.scratch.end();
    const auto wrong = [&](std::size_t i) {
        return std::fabs(end.auxiliary_rate[i] - late.auxiliary_rate[i]);
    };
    double most = 0;
    std::size_t next = 0;
    for (std::size_t t = 0; t < m.tyres.size(); ++t) {
        const double slope = tyre_force_slope(w.operators.soils[t]);
        most = std::max(most, slope * std::max(1., m.description.tyres[t].radius) * wrong(next++));
    }
    for (std::size_t e = 0; e < m.engines.size(); ++e) {
        const double boosted = 1 - m.description.engines[e].turbo_instant_fraction;
        most = std::max(most, wrong(next++));
        most = std::max(most, boosted * end.engine_full_load[e] * wrong(next++));
    }
    return most * weight;
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

// A shaft that is mostly a damper takes so many parts or more to creep back. Its torque is its damper's, and there may be no other
// torque in the machine to tell much from little by.
constexpr double creeping = 50;

bool only_creeps(const Work& w, int shaft, double missed) {
    const ModelData& m = w.model;
    const Sample &begin = w.scratch.begin(), &end = w.scratch.end();
    const auto e = static_cast<std::size_t>(shaft);
    const double damping = m.swing_damping[e], h = end.at.time - begin.at.time;
    if (!(damping > creeping * m.structure.shafts[e].stiffness * h)) return false;
    const double from = slip_fast(m.shaft_rate[e], begin.z), to = slip_fast(m.shaft_rate[e], end.z);
    return missed <= swing_tolerance * damping * std::max(std::fabs(from), std::fabs(to));
}

// Twists (the last coordinates, just before f) half way, exact and by the cubic through both ends: what lies between does
// not show at the ends. With those that creep, which mostly settles it, or without.
bool hides_swing(const Work& w, bool all) {
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
        const double missed = stiffness * std::fabs(half.f[e - m.twists] - cubic);
        strain = std::max(strain, stiffness * std::fabs(end.z[i]));
        if (all || !only_creeps(w, e, missed)) hidden = std::max(hidden, missed);
    }
    return hidden > rounding * strain && exceeds(w, hidden, swing_tolerance);
}
bool hides_swing(const Work& w) {
    return hides_swing(w, true) && hides_swing(w, false);
}

bool is_dense_coarse(Work& w, const Mode& mode, double tolerance) {
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
    const double slow = slow_states_amiss(w, (end.at.time - w.scratch.begin().at.time) / 6);
    return takes_forces_amiss(w, tolerance, late.f, w.scratch.used.late_reach, change, slow) ||
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

bool is_tree_coarse(Work& w, const Mode& mode, double tolerance) {
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
    return swings_between(w, mode) ||
           takes_forces_amiss(w, tolerance, late, weight * t.liveliness, change,
                              slow_states_amiss(w, weight)) ||
           friction_outruns_stages(w, [&](int k) { return tree_answer(t, h, k); });
}

}  // namespace

bool is_coarse(Work& w, const Mode& mode, bool shortest) SHIFTRIG_REALTIME {
    const double tolerance = shortest ? told_force_tolerance : force_tolerance;
    return mode.tree ? is_tree_coarse(w, mode, tolerance) : is_dense_coarse(w, mode, tolerance);
}

namespace {

// The first of the knots that the part comes upon. Of each: what is zero there, at begin, half way and end, and of what size
// its terms are: a converter that stands stalled is at the knot of no speed all the time, by rounding on either side.
class FirstKnot {
  public:
    explicit FirstKnot(const Work& work) : w(work) {}
    template <typename Quantity>
    void of_speeds(double g0, double g1, const Quantity& zero) {
        if (!(g0 * g1 < 0)) return;
        consider(g0, g1, w.model.kernel.loops.largest(begin.z, w.model.masses), zero);
    }
    template <typename Quantity>
    void of_torques(double g0, double g1, double size, const Quantity& zero) {
        if (g0 * g1 < 0) consider(g0, g1, size, zero);
    }
    const Work& w;
    const Sample &begin = w.scratch.begin(), &half = w.scratch.half, &end = w.scratch.end();
    double first = 1;

  private:
    template <typename Quantity>
    void consider(double g0, double g1, double size, const Quantity& zero) {
        if (std::max(std::fabs(g0), std::fabs(g1)) <= rounding * size) return;
        // The engine for long chains has no stage half way.
        const double gm = w.model.tree ? 0.5 * (g0 + g1) : zero(half);
        // On the parabola through the three, from the straight line.
        const double a = 2 * (g0 - 2 * gm + g1), b = 4 * gm - 3 * g0 - g1;
        double theta = g0 / (g0 - g1);
        for (int i = 0; i < 2; ++i) {
            const double slope = b + 2 * a * theta;
            if (slope != 0) theta -= (g0 + theta * (b + theta * a)) / slope;
        }
        constexpr double edge = 1e-3;  // nearer to an end of the part than this is there
        if (theta > edge && theta < 1 - edge) first = std::min(first, theta);
    }
};

void knots_of_friction(const Work& w, FirstKnot& knots) {
    for (const int k : w.model.tabled_pairs) {
        if (!slips(w.contact[k])) continue;
        const auto slip = [k](const Sample& s) { return std::fabs(s.slip[k]); };
        const double from = slip(knots.begin), to = slip(knots.end);
        for (const auto& [knot, factor] :
             *w.model.pair_laws[static_cast<std::size_t>(k)].friction.factor_over_slip) {
            const double at = knot;
            knots.of_speeds(from - at, to - at, [=](const Sample& s) { return slip(s) - at; });
        }
    }
}

void knots_of_converters(const Work& w, FirstKnot& knots) {
    for (const ConverterLaw& law : w.model.converters) {
        const auto pump = [&](const Sample& s) { return s.slip[law.pump_force]; };
        const auto turbine = [&](const Sample& s) { return s.slip[law.turbine_force]; };
        const double p0 = pump(knots.begin), p1 = pump(knots.end), t0 = turbine(knots.begin),
                     t1 = turbine(knots.end);
        for (const ConverterKnot& knot : law.knots) {
            knots.of_speeds(knot.pump * p0 + knot.turbine * t0, knot.pump * p1 + knot.turbine * t1,
                            [&](const Sample& s) { return knot.pump * pump(s) + knot.turbine * turbine(s); });
        }
    }
}

// Where the governor comes upon a limit or leaves it, and bends of the full-load curve under it.
void knots_of_engines(const Work& w, FirstKnot& knots) {
    const ModelData& m = w.model;
    for (std::size_t e = 0; e < m.engines.size(); ++e) {
        const EngineSetting& set = w.operators.engine_settings[e];
        if (w.scratch.engine_modes[e] != EngineMode::running || set.fuel_cut) continue;
        const Engine& engine = m.description.engines[e];
        const EngineLaw& law = m.engines[e];
        const auto boost = m.tyres.size() + 2 * e + 1;
        const auto demand = [&](const Sample& s) {
            return engine_demand(engine, set, -s.slip[law.force], s.engine_full_load[e], s.auxiliary[boost]);
        };
        const EngineDemand at_begin = demand(knots.begin), at_end = demand(knots.end);
        const auto meets = [&](const auto& limit) {
            knots.of_torques(limit(at_begin), limit(at_end), law.peak,
                             [&](const Sample& s) { return limit(demand(s)); });
        };
        meets([&](const EngineDemand& d) { return d.governor - std::min(d.available, set.most); });
        meets([&](const EngineDemand& d) { return d.governor + d.friction; });
        if (at_begin.governor < std::min(at_begin.available, set.most)) continue;
        meets([&](const EngineDemand& d) { return d.available - set.most; });
        if (at_begin.available > set.most) continue;
        const auto speed_of = [&](const Sample& s) { return -s.slip[law.force]; };
        const double from = speed_of(knots.begin), to = speed_of(knots.end);
        const auto bend = [&](double speed) {
            knots.of_speeds(from - speed, to - speed, [&](const Sample& s) { return speed_of(s) - speed; });
        };
        bool bends = false;  // mostly not
        for (const auto& [speed, torque] : engine.full_load) bends |= (from - speed) * (to - speed) < 0;
        if (bends) {
            for (const auto& [speed, torque] : engine.full_load) bend(speed);
        }
        bend(engine.fade_from);
        bend(engine.fade_to);
    }
}

}  // namespace

double look_for_knots(const Work& w) SHIFTRIG_REALTIME {
    FirstKnot knots(w);
    knots_of_friction(w, knots);
    knots_of_converters(w, knots);
    knots_of_engines(w, knots);
    return knots.first;
}

}  // namespace shiftrig::plant::detail
