//   f0 = f(t0+, z0, a0)
//   za = P_h z0 + Q_h f0                   aa = a0 + h/2 ȧ0             fa = f(t0 + h/2, za, aa)
//   zb = P z0 + Q_1 (2 fa − f0)            ab = a0 + h (2 ȧa − ȧ0)      fb = f(t1−, zb, ab)
//   z1 = P z0 + (Q_1 − 3Q_2 + 4Q_3) f0 + (4Q_2 − 8Q_3) fa + (4Q_3 − Q_2) fb
//   a1 = a0 + h/6 (ȧ0 + 4 ȧa + ȧb)
//
// z coordinates of the mode, f forces, a auxiliary states (engine, tyre slip: not stiff), P = e^(hL),
// Q_k = h φ_k(hL) S̃. What z0 and f0 give to all three comes from one product, what fa and fb add from one each.
#include "plant/etd3.h"

#include "plant/few.h"

namespace shiftrig::plant::detail {

void advance(Work& w, const Mode& mode, double end_fraction) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    ScratchData& s = w.scratch;
    Sample &begin = s.begin(), &half = s.half, &late = s.late, &end = s.end();
    const bool whole = begin.at.fraction == 0 && end_fraction == 1;
    const double h = (end_fraction - begin.at.fraction) * w.h;
    if (whole) {
        s.used = mode.step;
    } else {
        // Parts of one length share their operators.
        if (s.part_mode != &mode || s.part_modes_built != w.operators.misses || s.part.length != h) {
            s.part = build_step_operators(m, mode, h, s.operator_memory.data()->value, s.workspace,
                                          s.workspace_index.data());
            s.part_mode = &mode;
            s.part_modes_built = w.operators.misses;
        }
        s.used = s.part;
    }
    const StepOperators& op = s.used;
    const Kernel& kernel = m.kernel;
    const double middle = 0.5 * (begin.at.fraction + end_fraction);
    half.at = {w.start + middle * w.h, middle, Side::right};
    late.at = end.at = {w.start + end_fraction * w.h, end_fraction, Side::left};
    tabulate_contact(w, mode);

    // One block of coordinates each for half way, the late stage and the end: first what the beginning gives to all
    // three, then what each stage adds to those after it.
    const int n = mode.order, block = padded(n);
    double* const at_half = s.vector_a;
    double* const at_late = at_half + block;
    double* const at_end = at_late + block;
    kernel.multiply(op.from_begin, 3 * block, n + m.forces, read_coordinates(mode, begin), nullptr, at_half);
    for (int i = 0, count = m.auxiliary; i < count; ++i)
        half.auxiliary[i] = begin.auxiliary[i] + 0.5 * h * begin.auxiliary_rate[i];
    copy_few(at_half, n, half.f - n);
    show(m, mode, at_half, half, m.law_rows);
    stage_forces(w, half);

    kernel.multiply(op.from_half, 2 * block, m.forces, half.f, at_late, at_late);
    for (int i = 0, count = m.auxiliary; i < count; ++i)
        late.auxiliary[i] = begin.auxiliary[i] + h * (2 * half.auxiliary_rate[i] - begin.auxiliary_rate[i]);
    show(m, mode, at_late, late, m.law_rows);
    stage_forces(w, late);

    double* const end_coordinates = end.f - n;
    kernel.multiply(op.from_late, block, m.forces, late.f, at_end, end_coordinates);
    for (int i = 0, count = m.auxiliary; i < count; ++i) {
        end.auxiliary[i] =
            begin.auxiliary[i] +
            h / 6 * (begin.auxiliary_rate[i] + 4 * half.auxiliary_rate[i] + late.auxiliary_rate[i]);
    }
    show(m, mode, end_coordinates, end, padded(m.seen));
    end_forces(w, end);
    active_torques(m, mode, end);
}

}  // namespace shiftrig::plant::detail
