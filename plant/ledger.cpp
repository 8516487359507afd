#include "plant/ledger.h"

#include <algorithm>
#include <cmath>

#include "plant/ark3.h"
#include "plant/transitions.h"

namespace shiftrig::plant::detail {
namespace {

// Loss in tyres, converters and meshes at a sample [W].
double field_and_mesh_losses(const Work& w, const Mode& mode, const Sample& s) {
    const ModelData& m = w.model;
    double power = s.field_power;
    for (int k = 0; k < m.meshes; ++k) {
        const auto i = static_cast<std::size_t>(k);
        const Mesh& mesh = m.structure.meshes[i];
        const unsigned char state = w.contact[m.pairs + k];
        if (!mesh.lossy() || state == stuck || mode.bound[m.pairs + k]) continue;
        // M₁ (ω_1 − û ω_2 − (1 − û) ω_c), of which u in place of û gives nothing.
        const double turning = slip_fast(m.mesh_loss[i], s.z) / mesh.ratio;
        power += s.torque[m.pairs + k] * (mesh.ratio - mesh.force_ratio(loss_exponent(state))) * turning;
        const int bearing = m.bearing_force[i];
        if (bearing >= 0) power += s.f[bearing] * mesh.ratio * turning;
    }
    return power;
}

// Loss in dampers and in the damping of shafts [W].
double damping_losses(const Work& w, const Sample& s) {
    const ModelData& m = w.model;
    double power = 0;
    const auto damped = [&](double damping, const std::array<Link, 2>& links) {
        const double rate = slip_fast(links, s.z);
        power += damping * rate * rate;
    };
    for (std::size_t e = 0; e < m.shaft_rate.size(); ++e) damped(m.structure.shafts[e].damping, m.shaft_rate[e]);
    for (std::size_t e = 0; e < m.damper_rate.size(); ++e) damped(m.structure.dampers[e].damping, m.damper_rate[e]);
    return power;
}

// The state half way, by the step's own weights with the force linear over its first half, with forces and
// internal torques; returns the energy lost by damping [J].
double fill_middle(Work& w, const Mode& mode) {
    const ModelData& m = w.model;
    ScratchData& s = w.scratch;
    Sample &begin = s.begin, &middle = s.middle, &end = s.end;
    const double h = end.at.time - begin.at.time;
    double* change = s.vector_b.data();
    for (int k = 0; k < m.forces; ++k) change[k] = s.half.f[k] - begin.f[k];
    m.kernel.multiply(s.used.middle, m.states_padded, m.forces, change, s.half.z, middle.z);
    for (int i = 0; i < m.auxiliary; ++i) {
        middle.auxiliary[i] = 0.5 * (begin.auxiliary[i] + end.auxiliary[i]) +
                              h / 8 * (begin.auxiliary_rate[i] - end.auxiliary_rate[i]);
    }
    middle.at = s.half.at;
    evaluate_forces(w, w.contact, middle, Extent::moving_pairs);
    internal_torques(w, mode, middle);
    return h / 6 * (damping_losses(w, begin) + 4 * damping_losses(w, middle) + damping_losses(w, end));
}

// The parabola through the forces at start, middle and end with which the step was made, at the fraction s.
void forces_at(const ScratchData& scratch, int count, double s, double* f) {
    const double w0 = (1 - s) * (1 - 2 * s), w1 = 4 * s * (1 - s), w2 = s * (2 * s - 1);
    for (int k = 0; k < count; ++k) f[k] = w0 * scratch.begin.f[k] + w1 * scratch.half.f[k] + w2 * scratch.late.f[k];
}

// An even number, at least the two of Simpson's rule.
int ledger_parts(const Mode& mode, double fraction) {
    return std::max(2, 2 * static_cast<int>(std::ceil(0.5 * mode.ledger_parts * fraction - 1e-9)));
}

// Stiff shafts swing or die out within a step, where three points see nothing of them. The step's own solution is
// followed through many parts (exact, as the step is) and the powers are summed over these.
void book_finely(Work& w, const Mode& mode) {
    const ModelData& m = w.model;
    ScratchData& s = w.scratch;
    const double h = s.end.at.time - s.begin.at.time;
    StepOperators op = mode.ledger;
    int parts = mode.ledger_parts;
    if (s.used.length != mode.step.length) {
        parts = ledger_parts(mode, h / w.h);
        op = place_operators(m, s.ledger_memory.data());
        build_step_operators(m, mode, h / parts, op, s.workspace.data());
    }
    Sample& at = s.middle;
    double* forces = s.vector_c.data();     // at start, middle and end of a part
    double* moved = s.vector_a.data();
    std::copy(s.begin.z, s.begin.z + m.states, at.z);
    double external_work = 0;
    for (int part = 0;; ++part) {
        forces_at(s, m.forces, static_cast<double>(part) / parts, at.f);
        const double weight = h / parts / 3 * (part == 0 || part == parts ? 1 : part % 2 ? 4 : 2);  // Simpson
        internal_torques(w, mode, at);
        at.field_power = 0;
        double loss = field_and_mesh_losses(w, mode, at) + damping_losses(w, at);
        for (int k = 0; k < m.pairs; ++k) {
            if (w.contact[k] == locked) continue;
            const double power = at.f[k] * slip_fast(m.pair_slip[static_cast<std::size_t>(k)], at.z);
            s.heat[static_cast<std::size_t>(k)] += weight * power;
            loss += power;
        }
        s.dissipated += weight * loss;
        for (int k = m.first_external; k < m.forces; ++k) {
            external_work -= weight * at.f[k] * slip_fast(m.force_on[static_cast<std::size_t>(k)], at.z);
        }
        for (std::size_t i = 0; i < m.translating.size(); ++i) {
            w.next[m.layout.distances + static_cast<int>(i)] += weight * at.z[m.translating[i]];
        }
        if (part == parts) break;
        std::copy(at.f, at.f + m.forces, forces);
        forces_at(s, m.forces, (part + 0.5) / parts, forces + m.forces);
        forces_at(s, m.forces, (part + 1.) / parts, forces + 2 * m.forces);
        m.kernel.multiply(op.whole, m.states_padded, m.states, at.z, nullptr, moved);
        m.kernel.multiply(op.combined, m.states_padded, 3 * m.forces, forces, moved, at.z);
    }
    // What tyres and converters lose goes through external forces: the rest of these is input.
    const double field = h / 6 * (s.begin.field_power + 4 * s.half.field_power + s.end.field_power);
    s.dissipated += field;
    s.input_work += external_work + field;
}

}  // namespace

double stored_energy(const ModelData& m, const double* z) SHIFTRIG_REALTIME {
    // Four running sums, so that one addition need not wait for the last.
    double sums[4] = {};
    const double* stored = m.energy_factor.data();
    int i = 0;
    for (; i + 4 <= m.states; i += 4) {
        for (int lane = 0; lane < 4; ++lane) sums[lane] += stored[i + lane] * z[i + lane] * z[i + lane];
    }
    for (int lane = 0; i < m.states; ++i, ++lane) sums[lane] += stored[i] * z[i] * z[i];
    return (sums[0] + sums[1]) + (sums[2] + sums[3]);
}

void book(Work& w, const Mode& mode) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    Sample &begin = w.scratch.begin, &middle = w.scratch.middle, &end = w.scratch.end;
    const double h = end.at.time - begin.at.time;
    if (!mode.tree && mode.ledger_parts > 1 && ledger_parts(mode, h / w.h) > 2) return book_finely(w, mode);
    w.scratch.dissipated += mode.tree ? tree_middle(w, mode) : fill_middle(w, mode);

    const auto simpson = [h](double a, double b, double c) { return h / 6 * (a + 4 * b + c); };
    for (int k = 0; k < m.pairs; ++k) {
        if (w.contact[k] == locked) continue;
        if (begin.f[k] == 0 && middle.f[k] == 0 && end.f[k] == 0) continue;
        const auto& links = m.pair_slip[static_cast<std::size_t>(k)];
        const double heat = simpson(begin.f[k] * slip_fast(links, begin.z), middle.f[k] * slip_fast(links, middle.z),
                                    end.f[k] * slip_fast(links, end.z));
        w.scratch.heat[static_cast<std::size_t>(k)] += heat;
        w.scratch.dissipated += heat;
    }
    w.scratch.dissipated +=
        simpson(field_and_mesh_losses(w, mode, begin), field_and_mesh_losses(w, mode, middle),
                field_and_mesh_losses(w, mode, end));
    w.scratch.input_work += simpson(begin.input_power, middle.input_power, end.input_power);
    for (std::size_t i = 0; i < m.translating.size(); ++i) {
        const int j = m.translating[i];
        w.next[m.layout.distances + static_cast<int>(i)] += simpson(begin.z[j], middle.z[j], end.z[j]);
    }
}

}  // namespace shiftrig::plant::detail
