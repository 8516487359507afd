#include "plant/ledger.h"

#include <algorithm>
#include <cmath>

#include "plant/ark3.h"
#include "plant/transitions.h"

namespace shiftrig::plant::detail {
namespace {

// What the machine loses at an instant, and what it is given [W].
struct Powers {
    double lost = 0, given = 0;
};

// Loss in meshes, from their torques.
double mesh_losses(const ModelData& m, const Mode& mode, const double* mesh_torques, const double* turning) {
    const double* const share = mode.loss_share;
    double power[2] = {};
    int k = 0;
    for (const int count = m.meshes - 1; k < count; k += 2) {
        power[0] += share[k] * mesh_torques[k] * turning[k];
        power[1] += share[k + 1] * mesh_torques[k + 1] * turning[k + 1];
    }
    if (k < m.meshes) power[0] += share[k] * mesh_torques[k] * turning[k];
    return power[0] + power[1];
}

double damping_losses(const ModelData& m, const Mode& mode, const double* swing) {
    double power = 0;
    const auto count = static_cast<int>(m.swing_damping.size());
    const double* damping = m.swing_damping.data();
    for (int i = 0; i < count; ++i) power += damping[i] * swing[i] * swing[i];
    for (const BacklashLaw& law : m.backlashes) {
        if (is_shaft_closed(m, mode, law.shaft)) power += law.damping * swing[law.shaft] * swing[law.shaft];
    }
    return power;
}

// Lost between the masses of tyres and converters, with the forces of one sample and the motion of another.
double field_losses(const ModelData& m, const Sample& forces, const double* slip) {
    double power = 0;
    for (std::size_t t = 0; t < m.tyres.size(); ++t) {
        const TyreLaw& law = m.tyres[t];
        power += forces.tyre_force[t] *
                 (slip[law.body_force] - slip[law.wheel_force] * m.description.tyres[t].radius);
    }
    for (std::size_t c = 0; c < m.converters.size(); ++c) {
        const ConverterLaw& law = m.converters[c];
        power += forces.converter[2 * c + 1] * slip[law.turbine_force] -
                 forces.converter[2 * c] * slip[law.pump_force];
    }
    return power;
}

// With the forces of one sample and the motion of another, as the step takes them. The heat of pairs is not in it.
Powers powers(const ModelData& m, const Mode& mode, const Sample& forces, const Sample& motion,
              const double* mesh_torques) {
    const double field = field_losses(m, forces, motion.slip);
    const double *const f = forces.f, *const slip = motion.slip;
    double bearings = 0, external = 0;
    int k = m.pairs;
    for (const int end = m.first_external; k < end; ++k) bearings += f[k] * slip[k];
    for (const int end = m.first_flank_force; k < end; ++k) external -= f[k] * slip[k];
    // What tyres and converters lose goes through external forces: the rest of these is input.
    return {field + bearings + mesh_losses(m, mode, mesh_torques, motion.turning), external + field};
}

void subtract(const double* a, const double* b, int count, double* __restrict difference) {
    for (int i = 0; i < count; ++i) difference[i] = a[i] - b[i];
}

// Torques of the meshes at `s` if the forces were f: they are linear in them.
void mesh_torques_with(Work& w, const Mode& mode, const Sample& s, const double* f, double* rows) {
    const ModelData& m = w.model;
    double* const change = w.scratch.vector_b;
    subtract(f, s.f, m.forces, change);
    const int count = padded(mode.row_count + static_cast<int>(m.translating.size()));
    m.kernel.multiply(mode.force_torques, count, m.forces, change, s.active, rows);
}

// The motion half way: the step's own solution, which is exact for forces on the parabola through its three.
void fill_middle(Work& w, const Mode& mode) {
    const ModelData& m = w.model;
    ScratchData& s = w.scratch;
    double* const change = s.vector_b;
    subtract(s.half.f, s.begin.f, m.forces, change);
    subtract(s.late.f, s.begin.f, m.forces, change + m.forces);
    double* q = s.vector_a;
    m.kernel.multiply(s.used.middle, padded(mode.order), 2 * m.forces, change, s.half.f - mode.order, q);
    Sample& middle = s.middle;
    show(m, mode, q, middle, m.power_rows);
    std::copy(q, q + mode.order, middle.f - mode.order);
    std::copy(s.half.f, s.half.f + m.forces, middle.f);
    middle.at = s.half.at;
    active_torques(m, mode, middle);
}

// The parabola through the forces at start, middle and end with which the step was made, at the fraction s.
void forces_at(const ScratchData& scratch, int count, double s, double* f) {
    const double w0 = (1 - s) * (1 - 2 * s), w1 = 4 * s * (1 - s), w2 = s * (2 * s - 1);
    for (int k = 0; k < count; ++k)
        f[k] = w0 * scratch.begin.f[k] + w1 * scratch.half.f[k] + w2 * scratch.late.f[k];
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
        op = build_step_operators(m, mode, h / parts, s.ledger_memory.data()->value, s.workspace.data());
    }
    Sample& at = s.middle;
    const int n = mode.order, block = padded(n);
    double* const at_half = s.vector_a;  // the three blocks of `advance`, of which the last is the end
    double* const at_end = at_half + 2 * block;
    double* const forces = s.vector_c;
    for (int i = 0; i < n; ++i) at_end[i] = s.begin.z[mode.coordinates[i]];
    double external_work = 0;
    for (int part = 0;; ++part) {
        std::copy(at_end, at_end + n, at.f - n);
        show(m, mode, at_end, at, m.power_rows);
        forces_at(s, m.forces, static_cast<double>(part) / parts, at.f);
        active_torques(m, mode, at);
        const double weight = h / parts / 3 * (part == 0 || part == parts ? 1 : part % 2 ? 4 : 2);  // Simpson
        double loss =
            mesh_losses(m, mode, at.active + mode.first_mesh, at.turning) + damping_losses(m, mode, at.swing);
        for (int k = 0; k < m.first_external; ++k) {
            const double power = at.f[k] * at.slip[k];
            if (k < m.pairs) s.heat[static_cast<std::size_t>(k)] += weight * power;
            loss += power;
        }
        s.dissipated += weight * loss;
        for (int k = m.first_external; k < m.first_flank_force; ++k)
            external_work -= weight * at.f[k] * at.slip[k];
        for (std::size_t i = 0; i < m.translating.size(); ++i) {
            w.next[m.layout.distances + static_cast<int>(i)] -= weight * at.slip[m.translating_force[i]];
        }
        if (2 * part == parts) {
            const double field = field_losses(m, s.half, at.slip);
            s.dissipated += 2 * h / 3 * field;
            s.input_work += 2 * h / 3 * field;
        }
        if (part == parts) break;
        m.kernel.multiply(op.from_begin, 3 * block, n + m.forces, at.f - n, nullptr, at_half);
        forces_at(s, m.forces, (part + 0.5) / parts, forces);
        m.kernel.multiply(op.from_half, 2 * block, m.forces, forces, at_half + block, at_half + block);
        forces_at(s, m.forces, (part + 1.) / parts, forces);
        m.kernel.multiply(op.from_late, block, m.forces, forces, at_end, at_end);
    }
    const double field =
        h / 6 * (field_losses(m, s.begin, s.begin.slip) + field_losses(m, s.late, s.end.slip));
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

double stored_energy(const ModelData& m, const double* z, const unsigned char* contact) SHIFTRIG_REALTIME {
    double energy = stored_energy(m, z);
    for (const BacklashLaw& law : m.backlashes)
        energy += flank_energy(law, flank_side(contact[law.device]), z[m.masses + law.shaft]);
    return energy;
}

void book(Work& w, const Mode& mode) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    ScratchData& s = w.scratch;
    const Sample &begin = s.begin, &middle = s.middle, &end = s.end;
    const double h = end.at.time - begin.at.time;
    if (!mode.tree && mode.ledger_parts > 1 && ledger_parts(mode, h / w.h) > 2) return book_finely(w, mode);

    // The forces with which the step was made act on the motion that it found: what they do is then what it did.
    const Sample* forces[3] = {&begin, &s.half, &s.late};
    const double* torques[3];
    double damping;
    if (mode.tree) {
        damping = tree_middle(w, mode);
        forces[1] = &middle;
        forces[2] = &end;
        const Sample* const samples[3] = {&begin, &middle, &end};
        for (int i = 0; i < 3; ++i) torques[i] = samples[i]->torque + m.pairs;
    } else {
        fill_middle(w, mode);
        damping = h / 6 *
                  (damping_losses(m, mode, begin.swing) + 4 * damping_losses(m, mode, middle.swing) +
                   damping_losses(m, mode, end.swing));
        double* last = s.vector_c;
        mesh_torques_with(w, mode, end, s.late.f, last);
        torques[0] = begin.torque + m.pairs;
        torques[1] = middle.active + mode.first_mesh;
        torques[2] = last + mode.first_mesh;
    }
    const Powers first = powers(m, mode, *forces[0], begin, torques[0]);
    const Powers half = powers(m, mode, *forces[1], middle, torques[1]);
    const Powers last = powers(m, mode, *forces[2], end, torques[2]);
    const double sixth = h / 6;
    const auto simpson = [sixth](double a, double b, double c) { return sixth * (a + 4 * b + c); };
    double* __restrict heat = s.vector_b;  // of the pairs in this part
    for (int k = 0, pairs = m.pairs; k < pairs; ++k) {
        heat[k] = simpson(forces[0]->f[k] * begin.slip[k], forces[1]->f[k] * middle.slip[k],
                          forces[2]->f[k] * end.slip[k]);
    }
    double heat_of_all = 0;
    for (int k = 0, pairs = m.pairs; k < pairs; ++k) {
        s.heat[static_cast<std::size_t>(k)] += heat[k];
        heat_of_all += heat[k];
    }
    s.dissipated += damping + heat_of_all + simpson(first.lost, half.lost, last.lost);
    s.input_work += simpson(first.given, half.given, last.given);
    for (std::size_t i = 0; i < m.translating.size(); ++i) {
        const int k = m.translating_force[i];
        w.next[m.layout.distances + static_cast<int>(i)] -=
            simpson(begin.slip[k], middle.slip[k], end.slip[k]);
    }
}

}  // namespace shiftrig::plant::detail
