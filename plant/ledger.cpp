#include "plant/ledger.h"

#include <algorithm>
#include <cmath>

#include "plant/ark3.h"
#include "plant/etd3.h"
#include "plant/few.h"
#include "plant/transitions.h"

namespace shiftrig::plant::detail {
namespace {

constexpr int most_equal_parts = 256, most_levels = 14;
constexpr int refined = 4, finer_by = 16, finer_by_bits = 4;  // so many of the first parts, into so many
constexpr double most_radians = 0.25;                         // of a part: by so much L moves something in it

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

double flank_damping(const ModelData& m, const Mode& mode, const double* swing) {
    double power = 0;
    for (const BacklashLaw& law : m.backlashes) {
        if (is_shaft_closed(m, mode, law.shaft)) power += law.damping * swing[law.shaft] * swing[law.shaft];
    }
    return power;
}

double damping_losses(const ModelData& m, const Mode& mode, const double* swing) {
    double power = flank_damping(m, mode, swing);
    for (int i = 0; i < m.swings; ++i)
        power += m.swing_damping[static_cast<std::size_t>(i)] * swing[i] * swing[i];
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

// Torques of the meshes at `s` if the forces were f: they are linear in them.
void mesh_torques_with(Work& w, const Mode& mode, const Sample& s, const double* f, double* rows) {
    const ModelData& m = w.model;
    double* const change = w.scratch.vector_b;
    m.kernel.loops.subtract(f, s.f, m.forces, change);
    const int count = padded(mode.row_count + static_cast<int>(m.translating.size()));
    m.kernel.multiply(mode.force_torques, count, m.forces, change, s.active, rows);
}

// The motion half way, with the forces of the stage there.
void fill_middle(Work& w, const Mode& mode) {
    const ModelData& m = w.model;
    ScratchData& s = w.scratch;
    Sample& middle = s.middle;
    double* const q = middle.f - mode.order;
    coordinates_half_way(w, mode, q);
    show(m, mode, q, middle, m.power_rows);
    copy_few(s.half.f, m.forces, middle.f);
    middle.at = s.half.at;
    row_torques(m, mode, middle);
}

// The parabola through the forces at start, middle and end with which the step was made, at the fraction s.
void forces_at(const ScratchData& scratch, int count, double s, double* f) {
    const double w0 = (1 - s) * (1 - 2 * s), w1 = 4 * s * (1 - s), w2 = s * (2 * s - 1);
    for (int k = 0; k < count; ++k)
        f[k] = w0 * scratch.begin().f[k] + w1 * scratch.half.f[k] + w2 * scratch.late.f[k];
}

// The operators of one part of a level, for what has just been advanced.
StepOperators operators_of_level(Work& w, const Mode& mode, int level, double length) {
    ScratchData& s = w.scratch;
    if (s.used.length == mode.step.length) return level == 0 ? mode.ledger : mode.ledger_of_level[level - 1];
    return build_ledger_operators(w.model, mode, length, s.ledger_memory.data()->value, s.workspace,
                                  s.workspace_index.data());
}

// Equal parts that follow one another: they begin `first` of them after the beginning of what is booked, and `all` would fill it.
struct EqualParts {
    int first = 0, last = 0;
    double all = 0;
};

// What dies out or swings within a step, where three points see nothing of it. The step's own solution is
// followed through many parts (exact, as the step is) and the powers are summed over these. Returns work of external forces.
double book_parts(Work& w, const Mode& mode, const StepOperators& op, const EqualParts& equal,
                  double* at_end) {
    const ModelData& m = w.model;
    ScratchData& s = w.scratch;
    const double h = s.end().at.time - s.begin().at.time, parts = equal.all;
    Sample& at = s.middle;
    const int n = mode.order, block = padded(n);
    // Of the three blocks of `advance` only the last is asked for.
    const double* const end_from_begin = op.from_begin + 2 * block * (n + m.forces);
    double* const at_late = at_end - block;
    double* const forces = s.vector_c;
    double external_work = 0;
    for (int part = equal.first;; ++part) {
        std::copy(at_end, at_end + n, at.f - n);
        show(m, mode, at_end, at, m.power_rows);
        forces_at(s, m.forces, part / parts, at.f);
        row_torques(m, mode, at);
        const bool inside = part != equal.first && part != equal.last;
        const double weight = h / parts / 3 * (!inside ? 1 : part % 2 ? 4 : 2);  // Simpson
        double loss =
            mesh_losses(m, mode, at.active + mode.first_mesh, at.turning) + damping_losses(m, mode, at.swing);
        for (int k = 0; k < m.first_external; ++k) {
            const double power = at.f[k] * at.slip[k];
            if (k < m.pairs) s.work[k] += weight * power;
            loss += power;
        }
        s.dissipated += weight * loss;
        for (int k = m.first_external; k < m.first_flank_force; ++k)
            external_work -= weight * at.f[k] * at.slip[k];
        for (std::size_t i = 0; i < m.translating.size(); ++i) {
            w.next[m.layout.distances + static_cast<int>(i)] -= weight * at.slip[m.translating_force[i]];
        }
        if (2 * part == parts && part != equal.first) {  // once: levels share an end
            const double field = field_losses(m, s.half, at.slip);
            s.dissipated += 2 * h / 3 * field;
            s.input_work += 2 * h / 3 * field;
        }
        if (part == equal.last) return external_work;
        m.kernel.multiply(end_from_begin, block, n + m.forces, at.f - n, nullptr, at_end);
        forces_at(s, m.forces, (part + 0.5) / parts, forces);
        m.kernel.multiply(op.from_half, 2 * block, m.forces, forces, at_late, at_late);
        forces_at(s, m.forces, (part + 1.) / parts, forces);
        m.kernel.multiply(op.from_late, block, m.forces, forces, at_end, at_end);
    }
}

void book_finely(Work& w, const Mode& mode, const LedgerGrid& grid) {
    const ModelData& m = w.model;
    ScratchData& s = w.scratch;
    const double h = s.end().at.time - s.begin().at.time;
    double* const at_end = s.vector_a + padded(mode.order);
    for (int i = 0; i < mode.order; ++i) at_end[i] = s.begin().z[mode.coordinates[i]];
    double external_work = 0;
    for (int level = grid.levels; level >= 0; --level) {  // the shortest parts come first
        const EqualParts equal{level == grid.levels ? 0 : refined,
                               level == 0 ? grid.parts : refined * finer_by,
                               std::ldexp(grid.parts, finer_by_bits * level)};
        if (equal.first == equal.last) continue;
        external_work +=
            book_parts(w, mode, operators_of_level(w, mode, level, h / equal.all), equal, at_end);
    }
    const double field =
        h / 6 * (field_losses(m, s.begin(), s.begin().slip) + field_losses(m, s.late, s.end().slip));
    s.dissipated += field;
    s.input_work += external_work + field;
}

}  // namespace

double stored_energy(const ModelData& m, const double* z) SHIFTRIG_REALTIME {
    return m.kernel.loops.weighted_square(m.energy_factor.data(), z, m.states);
}

double stored_energy(const ModelData& m, const double* z, const unsigned char* contact) SHIFTRIG_REALTIME {
    double energy = stored_energy(m, z);
    for (const BacklashLaw& law : m.backlashes)
        energy += flank_energy(law, flank_side(contact[law.device]), z[m.masses + law.shaft]);
    return energy;
}

LedgerGrid ledger_grid(const ModelData& m, const Mode& mode, double share) SHIFTRIG_REALTIME {
    LedgerGrid grid;  // of two parts at least, as Simpson's rule asks for
    grid.parts = std::max(2, 2 * static_cast<int>(std::ceil(0.5 * mode.ledger_parts * share - 1e-9)));
    if (m.ledger_levels == 0) return grid;
    const double length = mode.rate_norm * m.options.step_size * share;
    if (length / grid.parts <= most_radians) return grid;
    grid.parts = std::max(grid.parts, refined);
    double radians = length / grid.parts;
    for (; radians > most_radians && grid.levels < m.ledger_levels; radians /= finer_by) ++grid.levels;
    return grid;
}

int most_ledger_levels(const Structure& s, double step_size) {
    double fastest = 0;  // trace of J⁻¹ A D Aᵀ: what is held together is heavier and slower
    for (const auto* elastics : {&s.shafts, &s.dampers}) {
        for (const Elastic& elastic : *elastics) {
            for (const Link& link : elastic.links) {
                if (link.mass >= 0)
                    fastest += elastic.damping * link.factor * link.factor /
                               s.inertia[static_cast<std::size_t>(link.mass)];
            }
        }
    }
    int levels = 0;
    double radians =
        2 * fastest * step_size / most_equal_parts;  // the norm of a matrix is more than its rates
    for (; radians > most_radians && levels < most_levels; radians /= finer_by) ++levels;
    return levels;
}

void build_ledger(const ModelData& m, Mode& mode, double* workspace, int* integers) SHIFTRIG_REALTIME {
    const int halvings = mode.step.halvings;
    mode.ledger_parts = halvings == 0 ? 1 : halvings == 1 ? 4 : 4 << std::min(halvings, 6);
    if (mode.ledger_parts == 1) return;
    double length = m.options.step_size / mode.ledger_parts;
    mode.ledger = build_ledger_operators(m, mode, length, mode.ledger_memory, workspace, integers);
    const int levels = ledger_grid(m, mode, 1).levels;
    for (int level = 0; level < levels; ++level) {
        length /= finer_by;
        StepOperators& op = mode.ledger_of_level[level];
        op = build_ledger_operators(m, mode, length, op.from_begin, workspace, integers);
    }
}

void book(Work& w, const Mode& mode) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    ScratchData& s = w.scratch;
    const Sample &begin = s.begin(), &middle = s.middle, &end = s.end();
    const double h = end.at.time - begin.at.time;
    if (!mode.tree && mode.ledger_parts > 1) {
        const LedgerGrid grid = ledger_grid(m, mode, s.used.length == mode.step.length ? 1 : h / w.h);
        if (grid.parts > 2) return book_finely(w, mode, grid);
    }

    // The forces with which the step was made act on the motion that it found: what they do is then what it did.
    const Sample* const motion[3] = {&begin, &middle, &end};
    const Sample* forces[3] = {&begin, &s.half, &s.late};
    PowerTerms terms;
    double damping = 0;  // of the tree's shafts
    if (mode.tree) {
        damping = tree_middle(w, mode);
        forces[1] = &middle;
        forces[2] = &end;
        for (int i = 0; i < 3; ++i) terms.mesh_torque[i] = motion[i]->torque + m.pairs;
    } else {
        fill_middle(w, mode);
        double* last = s.vector_c;
        mesh_torques_with(w, mode, end, s.late.f, last);
        terms.mesh_torque[0] = begin.torque + m.pairs;
        terms.mesh_torque[1] = middle.active + mode.first_mesh;
        terms.mesh_torque[2] = last + mode.first_mesh;
        terms.damping = m.swing_damping.data();
        terms.swings = m.swings;
    }
    for (int i = 0; i < 3; ++i) {
        terms.force[i] = forces[i]->f;
        terms.slip[i] = motion[i]->slip;
        terms.turning[i] = motion[i]->turning;
        terms.swing[i] = motion[i]->swing;
    }
    terms.lost = m.power_lost.data();
    terms.given = m.power_given.data();
    terms.forces = m.forces;
    terms.loss_share = mode.loss_share;
    terms.meshes = m.meshes;
    const auto [lost, given] = m.kernel.loops.book(terms, h, s.work);
    const auto simpson = [h](double a, double b, double c) { return h / 6 * (a + 4 * b + c); };
    // What tyres and converters lose goes through external forces: the rest of these is input.
    double field = 0;
    if (m.loses_in_fields) {
        field = simpson(field_losses(m, *forces[0], begin.slip), field_losses(m, *forces[1], middle.slip),
                        field_losses(m, *forces[2], end.slip));
    }
    if (!mode.tree && !m.backlashes.empty()) {
        damping = simpson(flank_damping(m, mode, begin.swing), flank_damping(m, mode, middle.swing),
                          flank_damping(m, mode, end.swing));
    }
    s.dissipated += lost + damping + field;
    s.input_work += given + field;
    for (std::size_t i = 0; i < m.translating.size(); ++i) {
        const int k = m.translating_force[i];
        w.next[m.layout.distances + static_cast<int>(i)] -=
            simpson(begin.slip[k], middle.slip[k], end.slip[k]);
    }
}

}  // namespace shiftrig::plant::detail
