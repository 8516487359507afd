#include "plant/transitions.h"

#include <algorithm>
#include <cmath>

#include "plant/flanks.h"
#include "plant/ledger.h"
#include "plant/settling.h"
#include "plant/standstill.h"
#include "plant/telling.h"
#include "plant/wedged.h"

namespace shiftrig::plant::detail {
namespace {

void close_device(Work& w, int device, Sample& s) {
    const ModelData& m = w.model;
    Mode& before = find_mode(m, w.operators, w.contact, w.scratch);
    unsigned char* was_bound = w.scratch.changed.data();
    std::copy(before.bound, before.bound + m.contact_bytes, was_bound);
    const auto set = [&](int k) {
        w.contact[k] = k < m.pairs ? static_cast<unsigned char>(locked) : static_cast<unsigned char>(stuck);
        note_closing(w, k, device_slip(w, k, s.z));
    };
    set(device);
    const Mode& mode = find_mode(m, w.operators, w.contact, w.scratch);
    const double lost = join(w, mode, s.z);
    w.scratch.dissipated += lost;
    if (device < m.pairs) w.scratch.work[device] += lost;
    // What came to rest with it: the same motion, hence the same instant.
    for (int k = 0; k < m.pairs; ++k) {
        if (slips(w.contact[k]) && mode.bound[k] && !was_bound[k]) set(k);
    }
    for (int k = m.pairs; k < m.first_flank; ++k) {
        if (w.contact[k] != stuck && mode.bound[k] && !was_bound[k] && mesh_of(w, k - m.pairs).lossy())
            set(k);
    }
}

}  // namespace

void sample_rate(const Work& w, const Mode& mode, Sample& s) SHIFTRIG_REALTIME {
    if (mode.tree) return tree_sample_rate(w, mode, s);
    const ModelData& m = w.model;
    m.kernel.multiply(mode.rates, m.states_padded, mode.order + m.forces, read_coordinates(mode, s), nullptr,
                      s.rate);
}

double join(Work& w, const Mode& mode, double* speeds) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    const auto kinetic_energy = [&] {
        double energy = 0;
        for (int j = 0; j < m.masses; ++j) {
            energy += 0.5 * m.structure.inertia[static_cast<std::size_t>(j)] * speeds[j] * speeds[j];
        }
        return energy;
    };
    const double before = kinetic_energy();
    double* momentum = w.scratch.vector_a;
    double* joined = w.scratch.vector_b;
    for (int j = 0; j < m.masses; ++j)
        momentum[j] = m.structure.inertia[static_cast<std::size_t>(j)] * speeds[j];
    if (mode.tree) {
        tree_mobility(w, mode, momentum, joined);
    } else {
        m.kernel.multiply(mode.mobility, padded(m.masses), m.masses, momentum, nullptr, joined);
    }
    std::copy(joined, joined + m.masses, speeds);
    return before - kinetic_energy();
}

// With the wrong loss, w for the right one, r, the acceleration is off by B_r (Ĉ_w − Ĉ_r) M_1, and M_1 grows linearly from the
// instant of reversal: half of M_1 at the end, over the rest of the part. The change of speed that is missed grows as t², so
// twists miss a third of rest · change; of several meshes the longest rest is taken for all.
Mode& correct_directions(Work& w, Mode& mode) SHIFTRIG_REALTIME {
    if (!w.scratch.turned) return mode;
    const ModelData& m = w.model;
    const Sample& begin = w.scratch.begin();
    Sample& end = w.scratch.end();
    const double h = end.at.time - begin.at.time;
    double* change = w.scratch.vector_c;  // of the speeds: first as if every mass were free
    double longest = 0;
    for (int k = 0; k < m.meshes; ++k) {
        unsigned char& state = w.contact[m.pairs + k];
        const Mesh& mesh = mesh_of(w, k);
        if (state == stuck || !mesh.lossy() || mode.bound[m.pairs + k]) continue;
        const double sign = motion_sign(state), kink = loss_kink(w, k, sign);
        const double from = (begin.torque[m.pairs + k] - kink) * sign * loss_exponent(state);
        const double to = (end.torque[m.pairs + k] - kink) * sign * loss_exponent(state);
        // From no torque at all (a clutch that begins to press) it is the wrong loss all along; a torque of the size of rounding at both ends is no reversal.
        if (to >= 0 || (from <= 0 && -to <= 1e-6 * m.noteworthy_torque)) continue;
        if (longest == 0) std::fill(change, change + m.masses, 0.);
        const double rest = to / (to - std::max(from, 0.)) * h;  // of the part, after the reversal [s]
        const unsigned char turned = state ^ driven;
        const double given =
            0.5 * rest * (end.torque[m.pairs + k] - kink) *
            (mesh.force_ratio(loss_exponent(turned)) - mesh.force_ratio(loss_exponent(state)));
        change[mesh.second] += given / m.structure.inertia[static_cast<std::size_t>(mesh.second)];
        if (mesh.carrier >= 0)
            change[mesh.carrier] -= given / m.structure.inertia[static_cast<std::size_t>(mesh.carrier)];
        longest = std::max(longest, rest);
        state = turned;
    }
    if (longest == 0) return mode;
    Mode& turned = find_mode(m, w.operators, w.contact, w.scratch);
    join(w, turned, change);
    const double before = stored_energy(m, end.z, w.contact);
    for (int j = 0; j < m.masses; ++j) end.z[j] += change[j];
    for (int e = 0; e < m.twists; ++e) {
        end.z[m.masses + e] +=
            longest / 3 * slip_of(m.structure.shafts[static_cast<std::size_t>(e)].links, change);
    }
    w.scratch.dissipated += before - stored_energy(m, end.z, w.contact);
    look(m, turned, end);
    evaluate_forces(w, w.contact, end);
    internal_torques(w, turned, end);
    return turned;
}

namespace {

// Found within a step, where the loss of a mesh at rest turns unseen, and allows more or less then; or with losses that
// correct_directions() has turned since.
bool give_way(Work& w, int pair, Sample& s) {
    Mode* mode = &find_mode(w.model, w.operators, w.contact, w.scratch);
    if (mode->rests) mode = &find_directions(w, w.contact, s);
    if ((mode->rests || w.scratch.turned) &&
        static_margin(w, pair, s) > at_its_limit * static_limit(w, pair, s))
        return false;
    return give_way(w, *mode, most_used(w, w.contact, s), pair, s);
}

}  // namespace

void look_onward(Work& w, int device) SHIFTRIG_REALTIME {
    constexpr double next_to_nothing = 1e-6;  // of what it is at the end
    const ModelData& m = w.model;
    if (device >= m.pairs || w.contact[device] != locked) return;
    if (m.pair_laws[static_cast<std::size_t>(device)].weak_sense != 0) return;  // its limits say which way
    const double now = w.scratch.begin().torque[device], then = w.scratch.end().torque[device];
    if (std::fabs(now) <= next_to_nothing * std::fabs(then))
        w.scratch.onward[static_cast<std::size_t>(device)] = static_cast<signed char>(then < 0 ? -1 : 1);
}

bool change_state(Work& w, int device, Sample& s) SHIFTRIG_REALTIME {
    if (device >= w.model.first_flank) {
        change_flank(w, backlash_of(w, device), s);
    } else if (device < w.model.pairs && w.contact[device] == locked) {
        return give_way(w, device, s);
    } else {
        close_device(w, device, s);
    }
    return true;
}

void change_all(Work& w, const Mode& mode, Sample& s) SHIFTRIG_REALTIME {
    // An open flank is found deep in the other: its twist begins where it touches, not with strain from nowhere.
    for (const BacklashLaw& law : w.model.backlashes) {
        if (!is_flank_violated(w, law, s)) continue;
        change_flank(w, law, s);
        const double side = flank_side(w.contact[law.device]);
        double& twist = s.z[w.model.masses + law.shaft];
        if (side == 0 || side * twist <= law.half_gap) continue;
        w.scratch.dissipated += flank_energy(law, side, twist);
        twist = side * law.half_gap;
    }
    const auto is_closed = [&](int k) {
        return k < w.model.pairs ? w.contact[k] == locked : w.contact[k] == stuck;
    };
    enum Verdict : unsigned char { good, opens, closes };
    unsigned char* verdict = w.scratch.violations.data();
    for (int k = 0; k < w.model.first_flank; ++k)
        verdict[k] = !violated(w, mode, k, s) ? good : is_closed(k) ? opens : closes;
    for (int k = 0; mode.wedges && k < w.model.pairs; ++k) {
        if (is_wedged(w, mode, k) && may_hold(w, mode, k, s)) verdict[k] = closes;
    }
    bool changed = false;
    for (int k = 0; k < w.model.first_flank; ++k) {
        if (verdict[k] == opens && k < w.model.pairs) {
            // Those before it may have taken its load.
            if (changed) internal_torques(w, find_mode(w.model, w.operators, w.contact, w.scratch), s);
            if (w.contact[k] != locked || !is_overloaded(w, k, s)) continue;
            give_way(w, k, s);
            changed = true;
        } else if (verdict[k] == closes && !is_closed(k)) {
            // One that closes may have brought others to rest with it: these are where they were to go. It may have left others
            // another share.
            const Mode& now = find_mode(w.model, w.operators, w.contact, w.scratch);
            if (changed && k < w.model.pairs && is_wedged(w, now, k) && !may_hold(w, now, k, s)) continue;
            close_device(w, k, s);
            contact_forces(w, w.contact, s);
            changed = true;
        }
    }
    // A join with residual slip may have turned others round.
    for (int k = 0; k < w.model.first_flank; ++k) {
        const double slip = device_slip(w, k, s.z);
        if (std::fabs(slip) <= at_rest) continue;
        if (k < w.model.pairs) {
            if (slips(w.contact[k])) w.contact[k] = slipping(slip);
        } else if (w.contact[k] != stuck) {
            w.contact[k] = moving(slip, loss_exponent(w.contact[k]));
        }
    }
}

}  // namespace shiftrig::plant::detail
