// The loops of tree_kernels.h, included once per instruction set with SHIFTRIG_FMA(a, b, c) = a b + c. No function of the
// standard library may be instantiated here: the linker would keep one copy for all instruction sets.
#include "plant/tree_kernels.h"

namespace shiftrig::plant::detail {
namespace {

// passed[g] − passed[g + 1] belongs to g inside a path; heads hand theirs to another group.
inline void move_heads(const TreePaths& t, const double* __restrict passed, double* __restrict sum) noexcept {
    for (int p = 1; p < t.count; ++p) {
        const int head = t.begin[p];
        sum[head - 1] -= passed[head];
        if (t.parent[p] >= 0) sum[t.parent[p]] += passed[head];
    }
}

inline void differences(const TreePaths& t, const double* __restrict speed,
                        double* __restrict rate) noexcept {
    for (int g = 0; g < t.groups; ++g) rate[g] = speed[g] - speed[g - 1];
    for (int p = 0; p < t.count; ++p) {
        const int head = t.begin[p];
        rate[head] = t.parent[p] < 0 ? 0 : speed[head] - speed[t.parent[p]];
    }
}

void shaft_torques(const TreePaths& t, const double* speed, const double* twist, double* rate, double* passed,
                   double* torque) noexcept {
    const double* __restrict q = speed;
    const double* __restrict psi = twist;
    double* __restrict through = passed;
    double* __restrict sum = torque;
    differences(t, speed, rate);
    const double* __restrict delta = rate;
    for (int g = 0; g < t.groups; ++g)
        through[g] = SHIFTRIG_FMA(t.stiffness[g], psi[g], t.damping[g] * delta[g]);
    through[t.groups] = 0;
    for (int g = 0; g < t.groups; ++g) sum[g] = through[g + 1] - SHIFTRIG_FMA(t.drag[g], q[g], through[g]);
    move_heads(t, through, sum);
}

template <int count>
void stage_start(const TreePaths& t, const StageSums& s, const double* __restrict momentum,
                 const double* __restrict twist, double weight, double* __restrict star_momentum,
                 double* __restrict star_twist, double* __restrict passed) noexcept {
    for (int g = 0; g < t.groups; ++g) {
        double p = momentum[g], psi = twist[g];
        for (int j = 0; j < count; ++j) {
            p = SHIFTRIG_FMA(s.implicit_weight[j], s.torque[j][g], p);
            p = SHIFTRIG_FMA(s.explicit_weight[j], s.force[j][g], p);
            psi = SHIFTRIG_FMA(s.implicit_weight[j], s.rate[j][g], psi);
        }
        star_momentum[g] = p;
        star_twist[g] = psi;
        passed[g] = weight * t.stiffness[g] * psi;
    }
}

// Leaves towards roots: b of the parent += L b. Two neighbouring paths run side by side, since each is a chain of
// dependent operations: the later one must be done before the earlier one passes the group it hangs on.
inline void eliminate(const TreePaths& t, const double* __restrict lower, double* __restrict right) noexcept {
    int p = t.count - 1;
    while (p >= 0) {
        const int b_begin = t.begin[p], b_end = t.begin[p + 1];
        int b = b_end - 1;
        double rb = right[b];
        if (p > 0) {
            const int a_begin = t.begin[p - 1];
            const int stop = t.parent[p] > a_begin ? t.parent[p] : a_begin;
            int a = b_begin - 1;
            double ra = right[a];
            while (b > b_begin && a > stop) {
                rb = SHIFTRIG_FMA(lower[b], rb, right[b - 1]);
                ra = SHIFTRIG_FMA(lower[a], ra, right[a - 1]);
                right[--b] = rb;
                right[--a] = ra;
            }
            while (b > b_begin) {
                rb = SHIFTRIG_FMA(lower[b], rb, right[b - 1]);
                right[--b] = rb;
            }
            if (t.parent[p] >= 0) right[t.parent[p]] = SHIFTRIG_FMA(lower[b], rb, right[t.parent[p]]);
            ra = right[a];
            while (a > a_begin) {
                ra = SHIFTRIG_FMA(lower[a], ra, right[a - 1]);
                right[--a] = ra;
            }
            if (t.parent[p - 1] >= 0)
                right[t.parent[p - 1]] = SHIFTRIG_FMA(lower[a], ra, right[t.parent[p - 1]]);
            p -= 2;
        } else {
            while (b > b_begin) {
                rb = SHIFTRIG_FMA(lower[b], rb, right[b - 1]);
                right[--b] = rb;
            }
            if (t.parent[p] >= 0) right[t.parent[p]] = SHIFTRIG_FMA(lower[b], rb, right[t.parent[p]]);
            p -= 1;
        }
    }
}

// Roots towards leaves: q = b/D + L q of the parent; `speed` comes in as b/D.
inline void substitute(const TreePaths& t, const double* __restrict lower,
                       double* __restrict speed) noexcept {
    int p = 0;
    const auto head = [&](int path) {
        const int g = t.begin[path], up = t.parent[path];
        if (up >= 0) speed[g] = SHIFTRIG_FMA(lower[g], speed[up], speed[g]);
        return speed[g];
    };
    while (p < t.count) {
        const int a_end = t.begin[p + 1];
        double qa = head(p);
        int a = t.begin[p] + 1;
        if (p + 1 < t.count) {
            const int up = t.parent[p + 1];
            while (a <= up && a < a_end) {
                qa = SHIFTRIG_FMA(lower[a], qa, speed[a]);
                speed[a++] = qa;
            }
            const int b_end = t.begin[p + 2];
            double qb = head(p + 1);
            int b = a_end + 1;
            while (a < a_end && b < b_end) {
                qa = SHIFTRIG_FMA(lower[a], qa, speed[a]);
                qb = SHIFTRIG_FMA(lower[b], qb, speed[b]);
                speed[a++] = qa;
                speed[b++] = qb;
            }
            while (b < b_end) {
                qb = SHIFTRIG_FMA(lower[b], qb, speed[b]);
                speed[b++] = qb;
            }
            ++p;
        }
        while (a < a_end) {
            qa = SHIFTRIG_FMA(lower[a], qa, speed[a]);
            speed[a++] = qa;
        }
        ++p;
    }
}

void stage(const TreePaths& t, const StageSums& s, const double* momentum, const double* twist, double weight,
           const double* inverse, const double* lower, double* work, double* star_twist, double* speed,
           double* rate, double* torque) noexcept {
    double* const star_momentum = torque;  // until N takes its place
    if (s.count == 1) stage_start<1>(t, s, momentum, twist, weight, star_momentum, star_twist, work);
    if (s.count == 2) stage_start<2>(t, s, momentum, twist, weight, star_momentum, star_twist, work);
    if (s.count == 3) stage_start<3>(t, s, momentum, twist, weight, star_momentum, star_twist, work);
    work[t.groups] = 0;
    const double* __restrict passed = work;
    const double* __restrict star = star_momentum;
    double* __restrict right = speed;
    for (int g = 0; g < t.groups; ++g) right[g] = star[g] + (passed[g + 1] - passed[g]);
    move_heads(t, passed, right);
    eliminate(t, lower, speed);
    for (int g = 0; g < t.groups; ++g) right[g] *= inverse[g];
    substitute(t, lower, speed);
    differences(t, speed, rate);
    const double inverse_weight = 1 / weight;
    double* __restrict shaft = torque;
    for (int g = 0; g < t.groups; ++g) shaft[g] = (t.mass[g] * right[g] - shaft[g]) * inverse_weight;
}

void finish(const TreePaths& t, const FinalSums& s, double* speed, double* twist) noexcept {
    double* __restrict q = speed;
    double* __restrict psi = twist;
    const double *f0 = s.force[0], *f1 = s.force[1], *f2 = s.force[2], *f3 = s.force[3];
    for (int g = 0; g < t.groups; ++g) {
        double impulse = s.correction[0] * f0[g];
        impulse = SHIFTRIG_FMA(s.correction[1], f1[g], impulse);
        impulse = SHIFTRIG_FMA(s.correction[2], f2[g], impulse);
        impulse = SHIFTRIG_FMA(s.correction[3], f3[g], impulse);
        q[g] = SHIFTRIG_FMA(t.inverse_mass[g], impulse, s.last_speed[g]);
        psi[g] = SHIFTRIG_FMA(s.weight, s.last_rate[g], s.star_twist[g]);
    }
}

double middle(const TreePaths& t, const MiddleSums& s, double* speed, double* rate) noexcept {
    double* __restrict q = speed;
    const double eighth = s.h / 8;
    const double *q0 = s.speed[0], *q1 = s.speed[1], *n0 = s.torque[0], *n1 = s.torque[1], *f0 = s.force[0],
                 *f1 = s.force[1];
    for (int g = 0; g < t.groups; ++g) {
        const double change = ((n0[g] + f0[g]) - (n1[g] + f1[g])) * t.inverse_mass[g];
        q[g] = SHIFTRIG_FMA(eighth, change, 0.5 * (q0[g] + q1[g]));
    }
    differences(t, speed, rate);
    constexpr int lanes = 8;
    double sums[lanes] = {};
    const double *d0 = s.rate[0], *d1 = s.rate[1];
    const auto term = [&](int g) {
        const double shaft = SHIFTRIG_FMA(4 * rate[g], rate[g], SHIFTRIG_FMA(d0[g], d0[g], d1[g] * d1[g]));
        const double air = SHIFTRIG_FMA(4 * q[g], q[g], SHIFTRIG_FMA(q0[g], q0[g], q1[g] * q1[g]));
        return SHIFTRIG_FMA(s.loss[g], shaft, s.drag_loss[g] * air);
    };
    int g = 0;
    for (; g + lanes <= t.groups; g += lanes) {
        for (int i = 0; i < lanes; ++i) sums[i] += term(g + i);
    }
    for (int i = 0; g < t.groups; ++g, ++i) sums[i] += term(g);
    return ((sums[0] + sums[1]) + (sums[2] + sums[3])) + ((sums[4] + sums[5]) + (sums[6] + sums[7]));
}

constexpr TreeKernel kernel{shaft_torques, stage, finish, middle};

}  // namespace
}  // namespace shiftrig::plant::detail
