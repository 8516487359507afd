//   f0 = f(t0+, z0, a0)
//   za = P_h z0 + Q_h f0                   aa = a0 + h/2 ȧ0             fa = f(t0 + h/2, za, aa)
//   zb = P z0 + Q_1 (2 fa − f0)            ab = a0 + h (2 ȧa − ȧ0)      fb = f(t1−, zb, ab)
//   z1 = P z0 + (Q_1 − 3Q_2 + 4Q_3) f0 + (4Q_2 − 8Q_3) fa + (4Q_3 − Q_2) fb
//   a1 = a0 + h/6 (ȧ0 + 4 ȧa + ȧb)
//
// z speeds and twists, f forces, a auxiliary states (engine, tyre slip: not stiff), P = e^(hL),
// Q_k = h φ_k(hL) S̃.
#include "plant/etd3.h"

#include <algorithm>

namespace shiftrig::plant::detail {

void advance(Work& w, const Mode& mode, double end_fraction) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    ScratchData& s = w.scratch;
    Sample &begin = s.begin, &half = s.half, &late = s.late, &end = s.end;
    const bool whole = begin.at.fraction == 0 && end_fraction == 1;
    const double h = (end_fraction - begin.at.fraction) * w.h;
    StepOperators part = place_operators(m, s.operator_memory.data());
    if (!whole) build_step_operators(m, mode, h, part, s.workspace.data());
    const StepOperators& op = s.used = whole ? mode.step : part;

    const int rows = m.states_padded;
    const auto multiply = m.kernel.multiply;
    const double middle = 0.5 * (begin.at.fraction + end_fraction);
    half.at = {w.start + middle * w.h, middle, Side::right};
    late.at = end.at = {w.start + end_fraction * w.h, end_fraction, Side::left};

    multiply(op.half, rows, m.columns, begin.z, nullptr, half.z);
    for (int i = 0; i < m.auxiliary; ++i) half.auxiliary[i] = begin.auxiliary[i] + 0.5 * h * begin.auxiliary_rate[i];
    evaluate_forces(w, w.contact, half);

    double* transported = s.vector_a.data();
    double* extrapolated = s.vector_b.data();
    multiply(op.whole, rows, m.states, begin.z, nullptr, transported);
    for (int k = 0; k < m.forces; ++k) extrapolated[k] = 2 * half.f[k] - begin.f[k];
    multiply(op.first, rows, m.forces, extrapolated, transported, late.z);
    for (int i = 0; i < m.auxiliary; ++i) {
        late.auxiliary[i] = begin.auxiliary[i] + h * (2 * half.auxiliary_rate[i] - begin.auxiliary_rate[i]);
    }
    evaluate_forces(w, w.contact, late, Extent::moving_pairs);

    double* forces = s.vector_c.data();
    std::copy(begin.f, begin.f + m.forces, forces);
    std::copy(half.f, half.f + m.forces, forces + m.forces);
    std::copy(late.f, late.f + m.forces, forces + 2 * m.forces);
    multiply(op.combined, rows, 3 * m.forces, forces, transported, end.z);
    for (int i = 0; i < m.auxiliary; ++i) {
        end.auxiliary[i] = begin.auxiliary[i] + h / 6 * (begin.auxiliary_rate[i] + 4 * half.auxiliary_rate[i] +
                                                         late.auxiliary_rate[i]);
    }
    evaluate_forces(w, w.contact, end);
    internal_torques(w, mode, end);
}

}  // namespace shiftrig::plant::detail
