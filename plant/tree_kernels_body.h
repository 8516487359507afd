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
    const int groups = t.groups;
    for (int g = 0; g < groups; ++g) rate[g] = speed[g] - speed[g - 1];
    for (int p = 0; p < t.count; ++p) {
        const int head = t.begin[p];
        rate[head] = t.parent[p] < 0 ? 0 : speed[head] - speed[t.parent[p]];
    }
}

void shaft_torques(const TreePaths& t, const double* speed, const double* twist, double* rate, double* passed,
                   double* torque) SHIFTRIG_REALTIME {
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
    constexpr int b = count > 1 ? 1 : 0,
                  c = count > 2 ? 2 : 0;  // where there are fewer terms the last ones are unused
    const double* __restrict n0 = s.torque[0], * __restrict q0 = s.force[0], * __restrict d0 = s.rate[0];
    const double* __restrict n1 = s.torque[b], * __restrict q1 = s.force[b], * __restrict d1 = s.rate[b];
    const double* __restrict n2 = s.torque[c], * __restrict q2 = s.force[c], * __restrict d2 = s.rate[c];
    const double i0 = s.implicit_weight[0], e0 = s.explicit_weight[0], i1 = s.implicit_weight[b],
                 e1 = s.explicit_weight[b], i2 = s.implicit_weight[c], e2 = s.explicit_weight[c];
    const double* __restrict stiffness = t.stiffness;
    const int groups = t.groups;
    for (int g = 0; g < groups; ++g) {
        double p = SHIFTRIG_FMA(e0, q0[g], SHIFTRIG_FMA(i0, n0[g], momentum[g]));
        double psi = SHIFTRIG_FMA(i0, d0[g], twist[g]);
        if constexpr (count > 1) {
            p = SHIFTRIG_FMA(e1, q1[g], SHIFTRIG_FMA(i1, n1[g], p));
            psi = SHIFTRIG_FMA(i1, d1[g], psi);
        }
        if constexpr (count > 2) {
            p = SHIFTRIG_FMA(e2, q2[g], SHIFTRIG_FMA(i2, n2[g], p));
            psi = SHIFTRIG_FMA(i2, d2[g], psi);
        }
        star_momentum[g] = p;
        star_twist[g] = psi;
        passed[g] = weight * stiffness[g] * psi;
    }
}

// Leaves towards roots: b of the parent += L b. Two neighbouring paths run side by side, since each is a chain of
// dependent operations: the later one must be done before the earlier one passes the group it hangs on.
inline void eliminate(const TreePaths& t, const double* __restrict lower, double* __restrict right) noexcept {
    if (!t.long_runs) {
        for (int g = t.groups - 1; g > 0; --g) {
            right[t.up[g]] = SHIFTRIG_FMA(lower[g], right[g], right[t.up[g]]);
        }
        return;
    }
    int p = t.run_count - 1;
    while (p >= 0) {
        const int b_begin = t.run_begin[p], b_end = t.run_begin[p + 1];
        int b = b_end - 1;
        double rb = right[b];
        if (p > 0) {
            const int a_begin = t.run_begin[p - 1];
            const int stop = t.run_parent[p] > a_begin ? t.run_parent[p] : a_begin;
            int a = b_begin - 1;
            double ra = right[a];
            int common = b - b_begin < a - stop ? b - b_begin : a - stop;
            for (; common >= 4; common -= 4, a -= 4, b -= 4) {
                for (int i = 0; i < 4; ++i) {
                    rb = SHIFTRIG_FMA(lower[b - i], rb, right[b - i - 1]);
                    ra = SHIFTRIG_FMA(lower[a - i], ra, right[a - i - 1]);
                    right[b - i - 1] = rb;
                    right[a - i - 1] = ra;
                }
            }
            for (; common > 0; --common) {
                rb = SHIFTRIG_FMA(lower[b], rb, right[b - 1]);
                ra = SHIFTRIG_FMA(lower[a], ra, right[a - 1]);
                right[--b] = rb;
                right[--a] = ra;
            }
            while (b > b_begin) {
                rb = SHIFTRIG_FMA(lower[b], rb, right[b - 1]);
                right[--b] = rb;
            }
            if (t.run_parent[p] >= 0)
                right[t.run_parent[p]] = SHIFTRIG_FMA(lower[b], rb, right[t.run_parent[p]]);
            ra = right[a];
            while (a > a_begin) {
                ra = SHIFTRIG_FMA(lower[a], ra, right[a - 1]);
                right[--a] = ra;
            }
            if (t.run_parent[p - 1] >= 0)
                right[t.run_parent[p - 1]] = SHIFTRIG_FMA(lower[a], ra, right[t.run_parent[p - 1]]);
            p -= 2;
        } else {
            while (b > b_begin) {
                rb = SHIFTRIG_FMA(lower[b], rb, right[b - 1]);
                right[--b] = rb;
            }
            if (t.run_parent[p] >= 0)
                right[t.run_parent[p]] = SHIFTRIG_FMA(lower[b], rb, right[t.run_parent[p]]);
            p -= 1;
        }
    }
}

// Roots towards leaves: q = b/D + L q of the parent; `speed` comes in as b/D.
inline void substitute(const TreePaths& t, const double* __restrict lower,
                       double* __restrict speed) noexcept {
    if (!t.long_runs) {
        for (int g = 1; g < t.groups; ++g) speed[g] = SHIFTRIG_FMA(lower[g], speed[t.up[g]], speed[g]);
        return;
    }
    int p = 0;
    const auto head = [&](int path) {
        const int g = t.run_begin[path], up = t.run_parent[path];
        if (up >= 0) speed[g] = SHIFTRIG_FMA(lower[g], speed[up], speed[g]);
        return speed[g];
    };
    while (p < t.run_count) {
        const int a_end = t.run_begin[p + 1];
        double qa = head(p);
        int a = t.run_begin[p] + 1;
        if (p + 1 < t.run_count) {
            const int up = t.run_parent[p + 1];
            while (a <= up && a < a_end) {
                qa = SHIFTRIG_FMA(lower[a], qa, speed[a]);
                speed[a++] = qa;
            }
            const int b_end = t.run_begin[p + 2];
            double qb = head(p + 1);
            int b = a_end + 1;
            int common = a_end - a < b_end - b ? a_end - a : b_end - b;
            for (; common >= 4; common -= 4, a += 4, b += 4) {
                for (int i = 0; i < 4; ++i) {
                    qa = SHIFTRIG_FMA(lower[a + i], qa, speed[a + i]);
                    qb = SHIFTRIG_FMA(lower[b + i], qb, speed[b + i]);
                    speed[a + i] = qa;
                    speed[b + i] = qb;
                }
            }
            for (; common > 0; --common) {
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

// q and δ of (M + hγ D + (hγ)² K) q = p* − hγ K ψ*, with `passed` = hγ K ψ* link by link.
inline void solve_stage(const TreePaths& t, const double* __restrict star_momentum, double* passed,
                        const double* inverse, const double* lower, double* speed, double* rate) noexcept {
    passed[t.groups] = 0;
    const double* __restrict link = passed;
    double* __restrict right = speed;
    const int groups = t.groups;
    for (int g = 0; g < groups; ++g) right[g] = star_momentum[g] + (link[g + 1] - link[g]);
    move_heads(t, link, right);
    eliminate(t, lower, right);
    const double* __restrict reciprocal = inverse;
    for (int g = 0; g < groups; ++g) right[g] *= reciprocal[g];
    substitute(t, lower, right);
    differences(t, right, rate);
}

void stage(const TreePaths& t, const StageSums& s, const double* momentum, const double* twist, double weight,
           const double* inverse, const double* lower, double* work, double* star_twist, double* speed,
           double* rate, double* torque) SHIFTRIG_REALTIME {
    double* const star_momentum = torque;  // until N takes its place
    if (s.count == 1) stage_start<1>(t, s, momentum, twist, weight, star_momentum, star_twist, work);
    if (s.count == 2) stage_start<2>(t, s, momentum, twist, weight, star_momentum, star_twist, work);
    if (s.count == 3) stage_start<3>(t, s, momentum, twist, weight, star_momentum, star_twist, work);
    solve_stage(t, star_momentum, work, inverse, lower, speed, rate);

    const double inverse_weight = 1 / weight;
    const double* __restrict mass = t.mass, * __restrict q = speed;
    double* const shaft = torque;
    const int groups = t.groups;
    for (int g = 0; g < groups; ++g) shaft[g] = (mass[g] * q[g] - shaft[g]) * inverse_weight;
}

void finish(const TreePaths& t, const FinalSums& s, double* speed, double* twist) SHIFTRIG_REALTIME {
    double* __restrict q = speed;
    double* __restrict psi = twist;
    const double* __restrict f0 = s.force[0], * __restrict f1 = s.force[1], * __restrict f2 = s.force[2], * __restrict f3 = s.force[3];
    const double c0 = s.correction[0], c1 = s.correction[1], c2 = s.correction[2], c3 = s.correction[3];
    const double* __restrict last_speed = s.last_speed, * __restrict last_rate = s.last_rate;
    const double* __restrict star = s.star_twist, * __restrict inverse = t.inverse_mass;
    const double weight = s.weight;
    const int groups = t.groups;
    for (int g = 0; g < groups; ++g) {
        const double impulse =
            SHIFTRIG_FMA(c3, f3[g], SHIFTRIG_FMA(c2, f2[g], SHIFTRIG_FMA(c1, f1[g], c0 * f0[g])));
        q[g] = SHIFTRIG_FMA(inverse[g], impulse, last_speed[g]);
        psi[g] = SHIFTRIG_FMA(weight, last_rate[g], star[g]);
    }
}

double middle(const TreePaths& t, const MiddleSums& s, double* speed, double* rate) SHIFTRIG_REALTIME {
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

Swing swing_error(const TreePaths& t, const EmbeddedSums& s, const double* speed) SHIFTRIG_REALTIME {
    constexpr int lanes = 8;
    double errors[lanes] = {}, speeds[lanes] = {};
    const double *d0 = s.rate[0], *d1 = s.rate[1], *d2 = s.rate[2], *d3 = s.rate[3];
    const double w0 = s.weight[0], w1 = s.weight[1], w2 = s.weight[2], w3 = s.weight[3];
    const auto look = [&](int g, double& error, double& fastest) {
        const double sum =
            SHIFTRIG_FMA(w3, d3[g], SHIFTRIG_FMA(w2, d2[g], SHIFTRIG_FMA(w1, d1[g], w0 * d0[g])));
        const double wrong = __builtin_fabs(sum), q = __builtin_fabs(speed[g]);
        error = wrong > error ? wrong : error;
        fastest = q > fastest ? q : fastest;
    };
    int g = 0;
    for (; g + lanes <= t.groups; g += lanes) {
        for (int i = 0; i < lanes; ++i) look(g + i, errors[i], speeds[i]);
    }
    for (int i = 0; g < t.groups; ++g, ++i) look(g, errors[i], speeds[i]);
    Swing swing;
    for (int i = 0; i < lanes; ++i) {
        swing.error = errors[i] > swing.error ? errors[i] : swing.error;
        swing.fastest = speeds[i] > swing.fastest ? speeds[i] : swing.fastest;
    }
    return swing;
}

void correct(const TreePaths& t, const EmbeddedSums& s, double weight, const double* inverse,
             const double* lower, double factor, const EmbeddedWork& work, double* speed,
             double* twist) SHIFTRIG_REALTIME {
    const double *n0 = s.torque[0], *n1 = s.torque[1], *n2 = s.torque[2], *n3 = s.torque[3];
    const double *f0 = s.force[0], *f1 = s.force[1], *f2 = s.force[2], *f3 = s.force[3];
    const double *d0 = s.rate[0], *d1 = s.rate[1], *d2 = s.rate[2], *d3 = s.rate[3];
    const double w0 = s.weight[0], w1 = s.weight[1], w2 = s.weight[2], w3 = s.weight[3];
    const double *mass = t.mass, *stiffness = t.stiffness;
    double* __restrict star = work.momentum;
    double* __restrict passed = work.passed;
    double* __restrict psi = work.twist;
    const int groups = t.groups;
    for (int g = 0; g < groups; ++g) {
        star[g] = SHIFTRIG_FMA(
            w3, n3[g] + f3[g],
            SHIFTRIG_FMA(w2, n2[g] + f2[g], SHIFTRIG_FMA(w1, n1[g] + f1[g], w0 * (n0[g] + f0[g]))));
        psi[g] = SHIFTRIG_FMA(w3, d3[g], SHIFTRIG_FMA(w2, d2[g], SHIFTRIG_FMA(w1, d1[g], w0 * d0[g])));
        passed[g] = weight * stiffness[g] * psi[g];
    }
    solve_stage(t, star, passed, inverse, lower, work.first, work.rate);
    const double *first = work.first, *rate = work.rate;
    for (int g = 0; g < groups; ++g) {
        star[g] = mass[g] * first[g];
        passed[g] = weight * stiffness[g] * SHIFTRIG_FMA(weight, rate[g], psi[g]);
    }
    solve_stage(t, star, passed, inverse, lower, work.second, work.rate);
    const double* second = work.second;
    double* __restrict q = speed;
    double* __restrict end = twist;
    const double of_rate = factor * weight;
    for (int g = 0; g < groups; ++g) {
        q[g] = SHIFTRIG_FMA(factor, second[g] - first[g], q[g]);
        end[g] = SHIFTRIG_FMA(of_rate, rate[g], end[g]);
    }
}

constexpr TreeKernel kernel{shaft_torques, stage, finish, middle, swing_error, correct};

}  // namespace
}  // namespace shiftrig::plant::detail
