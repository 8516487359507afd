// A quantity that a step needs at its start, middle and end: what a third-order method samples. The ends are
// the one-sided limits from inside the step.
#pragma once

namespace shiftrig::plant {

struct StepValues {
    double begin = 0, middle = 0, end = 0;

    // At the fraction s of the step, by the parabola through the three.
    double at(double s) const noexcept {
        if (s == 0) return begin;
        if (s == 1) return end;
        const double d1 = 4 * middle - 3 * begin - end;
        const double d2 = 2 * (begin - 2 * middle + end);
        return begin + s * (d1 + s * d2);
    }
};

inline bool is_constant(const StepValues& y) noexcept {
    return y.begin == y.middle && y.begin == y.end;
}

}  // namespace shiftrig::plant
