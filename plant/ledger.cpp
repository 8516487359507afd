#include "plant/ledger.h"

#include <algorithm>
#include <cmath>

#include "plant/ark3.h"
#include "plant/transitions.h"

namespace shiftrig::plant::detail {
namespace {

// Loss in meshes and their bearings at a sample [W].
double mesh_losses(const ModelData& m, const Mode& mode, const Sample& s) {
    double power = 0;
    for (int k = 0; k < m.meshes; ++k) power += mode.loss_share[k] * s.torque[m.pairs + k] * s.turning[k];
    for (int k = m.pairs; k < m.first_external; ++k) power += s.f[k] * s.slip[k];
    return power;
}

// Loss in dampers and in the damping of shafts [W].
double damping_losses(const ModelData& m, const Mode& mode, const Sample& s) {
    double power = 0;
    const double* swing = s.swing;
    int e = 0;
    for (const Elastic& shaft : m.structure.shafts) {
        if (is_shaft_closed(m, mode, e++)) power += shaft.damping * *swing * *swing;
        ++swing;
    }
    for (const Elastic& damper : m.structure.dampers) power += damper.damping * *swing * *swing, ++swing;
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
    double* q = s.vector_a.data();
    m.kernel.multiply(s.used.middle, padded(mode.order), m.forces, change, read_coordinates(mode, s.half), q);
    show(m, mode, q, middle);
    for (int i = 0; i < m.auxiliary; ++i) {
        middle.auxiliary[i] = 0.5 * (begin.auxiliary[i] + end.auxiliary[i]) +
                              h / 8 * (begin.auxiliary_rate[i] - end.auxiliary_rate[i]);
    }
    middle.at = s.half.at;
    evaluate_forces(w, w.contact, middle, Extent::moving_pairs);
    internal_torques(w, mode, middle);
    return h / 6 *
           (damping_losses(m, mode, begin) + 4 * damping_losses(m, mode, middle) + damping_losses(m, mode, end));
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
        op = build_step_operators(m, mode, h / parts, s.ledger_memory.data(), s.workspace.data());
    }
    Sample& at = s.middle;
    const int block = padded(mode.order);
    double* const at_half = s.vector_a.data();  // the three blocks of `advance`, of which the last is the end
    double* const forces = s.vector_c.data();
    std::copy(s.begin.z, s.begin.z + m.states, at.z);
    look(m, mode, at);
    double external_work = 0;
    for (int part = 0;; ++part) {
        forces_at(s, m.forces, static_cast<double>(part) / parts, at.f);
        const double weight = h / parts / 3 * (part == 0 || part == parts ? 1 : part % 2 ? 4 : 2);  // Simpson
        internal_torques(w, mode, at);
        double loss = mesh_losses(m, mode, at) + damping_losses(m, mode, at);
        for (int k = 0; k < m.pairs; ++k) {
            const double power = at.f[k] * at.slip[k];
            s.heat[static_cast<std::size_t>(k)] += weight * power;
            loss += power;
        }
        s.dissipated += weight * loss;
        for (int k = m.first_external; k < m.first_flank_force; ++k) external_work -= weight * at.f[k] * at.slip[k];
        for (std::size_t i = 0; i < m.translating.size(); ++i) {
            w.next[m.layout.distances + static_cast<int>(i)] += weight * at.z[m.translating[i]];
        }
        if (part == parts) break;
        m.kernel.multiply(op.from_begin, 3 * block, mode.order + m.forces, read_coordinates(mode, at),
                          nullptr, at_half);
        forces_at(s, m.forces, (part + 0.5) / parts, forces);
        m.kernel.multiply(op.from_half, 2 * block, m.forces, forces, at_half + block, at_half + block);
        forces_at(s, m.forces, (part + 1.) / parts, forces);
        m.kernel.multiply(op.from_late, block, m.forces, forces, at_half + 2 * block, at_half + 2 * block);
        show(m, mode, at_half + 2 * block, at);
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

double stored_energy(const ModelData& m, const double* z, const unsigned char* contact) SHIFTRIG_REALTIME {
    double energy = stored_energy(m, z);
    for (const BacklashLaw& law : m.backlashes)
        energy += flank_energy(law, flank_side(contact[law.device]), z[m.masses + law.shaft]);
    return energy;
}

void book(Work& w, const Mode& mode) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    Sample &begin = w.scratch.begin, &middle = w.scratch.middle, &end = w.scratch.end;
    const double h = end.at.time - begin.at.time;
    if (!mode.tree && mode.ledger_parts > 1 && ledger_parts(mode, h / w.h) > 2) return book_finely(w, mode);
    w.scratch.dissipated += mode.tree ? tree_middle(w, mode) : fill_middle(w, mode);

    const auto simpson = [h](double a, double b, double c) { return h / 6 * (a + 4 * b + c); };
    double heat_of_all = 0;
    for (int k = 0; k < m.pairs; ++k) {
        const double heat =
            simpson(begin.f[k] * begin.slip[k], middle.f[k] * middle.slip[k], end.f[k] * end.slip[k]);
        w.scratch.heat[static_cast<std::size_t>(k)] += heat;
        heat_of_all += heat;
    }
    w.scratch.dissipated += heat_of_all + simpson(begin.field_power + mesh_losses(m, mode, begin),
                                                  middle.field_power + mesh_losses(m, mode, middle),
                                                  end.field_power + mesh_losses(m, mode, end));
    w.scratch.input_work += simpson(begin.input_power, middle.input_power, end.input_power);
    for (std::size_t i = 0; i < m.translating.size(); ++i) {
        const int j = m.translating[i];
        w.next[m.layout.distances + static_cast<int>(i)] += simpson(begin.z[j], middle.z[j], end.z[j]);
    }
}

}  // namespace shiftrig::plant::detail
