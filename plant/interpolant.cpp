#include "plant/interpolant.h"

#include <utility>

#include "plant/etd3.h"
#include "plant/few.h"
#include "plant/transitions.h"

namespace shiftrig::plant::detail {

Interpolant interpolate_part(Work& w, const Mode& mode) SHIFTRIG_REALTIME {
    ScratchData& s = w.scratch;
    Sample &begin = s.begin(), &end = s.end();
    const int n = mode.order, block = padded(n);
    const double length = end.at.time - begin.at.time;
    double* next = s.course_memory.data()->value;
    const auto take = [&next, block] { return std::exchange(next, next + block); };
    double *const rest = take(), *const q0 = take(), *const q1 = take(), *const p0 = take(),
                  *const p1 = take();
    coordinates_half_way(w, mode, rest);
    sample_rate(w, mode, begin);  // which reads the coordinates into their place
    sample_rate(w, mode, end);
    for (int i = 0; i < n; ++i) {
        const int z = mode.coordinates[i];
        q0[i] = begin.z[z];
        q1[i] = end.z[z];
        p0[i] = length * begin.rate[z];
        p1[i] = length * end.rate[z];
        rest[i] -= 0.5 * (q0[i] + q1[i]) + 0.125 * (p0[i] - p1[i]);
    }
    return {begin.at.fraction, end.at.fraction, q0, q1, p0, p1, rest};
}

void sample_within(const Work& w, const Mode& mode, const Interpolant& part, double share,
                   Sample& s) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    const double t = share, u = 1 - share, fraction = part.from + t * (part.until - part.from);
    s.at = {w.start + fraction * w.h, fraction, Side::left};
    const double end = t * t * (3 - 2 * t), begin = 1 - end, begin_rate = t * u * u, end_rate = -t * t * u,
                 rest = 16 * t * t * u * u;
    double* const q = s.f - mode.order;
    for (int i = 0; i < mode.order; ++i) {
        q[i] = begin * part.begin[i] + end * part.end[i] + begin_rate * part.begin_rate[i] +
               end_rate * part.end_rate[i] + rest * part.rest[i];
    }
    const Sample &first = w.scratch.begin(), &last = w.scratch.end();
    const double length = last.at.time - first.at.time;
    for (int i = 0; i < m.auxiliary; ++i) {
        s.auxiliary[i] = begin * first.auxiliary[i] + end * last.auxiliary[i] +
                         length * (begin_rate * first.auxiliary_rate[i] + end_rate * last.auxiliary_rate[i]);
    }
    show(m, mode, q, s, padded(m.seen));
    end_forces(w, s);
    active_torques(m, mode, s);
}

}  // namespace shiftrig::plant::detail
