// The loops of tree_kernels.h, included once per instruction set with SHIFTRIG_FMA(a, b, c) = a b + c. No function of the
// standard library may be instantiated here: the linker would keep one copy for all instruction sets.
#include "plant/tree_kernels.h"

namespace shiftrig::plant::detail {
namespace {

// Along the tree's edges; 0 at roots.
inline void differences(const TreePaths& t, const double* __restrict way, double* __restrict difference) noexcept {
    const int groups = t.groups;
    for (int g = 0; g < groups; ++g) difference[g] = way[g] - way[g - 1];
    for (int p = 0; p < t.count; ++p) {
        const int head = t.begin[p];
        difference[head] = t.parent[p] < 0 ? 0 : way[head] - way[t.parent[p]];
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
    const double *stiffness = t.stiffness, *damping = t.damping, *drag = t.drag;
    const int groups = t.groups;
    for (int g = 0; g < groups; ++g) through[g] = SHIFTRIG_FMA(stiffness[g], psi[g], damping[g] * delta[g]);
    through[groups] = 0;
    for (int g = 0; g < groups; ++g) sum[g] = through[g + 1] - through[g];
    // passed[g] − passed[g + 1] belongs to g inside a path; heads hand theirs to another group.
    for (int i = 0; i < t.hanging; ++i) {
        const int head = t.head[i];
        sum[head - 1] -= through[head];
        sum[t.up[head]] += through[head];
    }
    if (!t.drags) return;
    for (int g = 0; g < groups; ++g) sum[g] = SHIFTRIG_FMA(-drag[g], q[g], sum[g]);
}

template <int count>
void combine_speeds(const TreePaths& t, const StageSums& s, double* __restrict momentum,
                    double* __restrict way) noexcept {
    constexpr int b = count > 1 ? 1 : 0, c = count > 2 ? 2 : 0,
                  d = count > 3 ? 3 : 0;  // where there are fewer terms the last ones are unused
    const double* __restrict q0 = s.speed[0], * __restrict q1 = s.speed[b], * __restrict q2 = s.speed[c],
                             * __restrict q3 = s.speed[d];
    const double m0 = s.of_momentum[0], m1 = s.of_momentum[b], m2 = s.of_momentum[c], m3 = s.of_momentum[d];
    const double w0 = s.of_way[0], w1 = s.of_way[b], w2 = s.of_way[c], w3 = s.of_way[d];
    const double of_net = s.of_net;
    const double* __restrict mass = t.mass, * __restrict net = s.net;
    const int groups = t.groups;
    for (int g = 0; g < groups; ++g) {
        double p = m0 * q0[g], turned = w0 * q0[g];
        if constexpr (count > 1) {
            p = SHIFTRIG_FMA(m1, q1[g], p);
            turned = SHIFTRIG_FMA(w1, q1[g], turned);
        }
        if constexpr (count > 2) {
            p = SHIFTRIG_FMA(m2, q2[g], p);
            turned = SHIFTRIG_FMA(w2, q2[g], turned);
        }
        if constexpr (count > 3) {
            p = SHIFTRIG_FMA(m3, q3[g], p);
            turned = SHIFTRIG_FMA(w3, q3[g], turned);
        }
        momentum[g] = SHIFTRIG_FMA(mass[g], p, of_net * net[g]);
        way[g] = turned;
    }
    way[-1] = way[groups] = 0;  // read, and of no consequence
}

void combine(const TreePaths& t, const StageSums& s, double* momentum, double* way) SHIFTRIG_REALTIME {
    if (s.count == 1) combine_speeds<1>(t, s, momentum, way);
    if (s.count == 2) combine_speeds<2>(t, s, momentum, way);
    if (s.count == 3) combine_speeds<3>(t, s, momentum, way);
    if (s.count == 4) combine_speeds<4>(t, s, momentum, way);
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

// Roots towards leaves: q = b/D + L q of the parent.
inline void substitute(const TreePaths& t, const double* __restrict inverse, const double* __restrict lower,
                       double* __restrict speed) noexcept {
    const auto next = [=](int g, double above) {
        return speed[g] = SHIFTRIG_FMA(lower[g], above, inverse[g] * speed[g]);
    };
    if (!t.long_runs) {
        speed[0] *= inverse[0];
        for (int g = 1; g < t.groups; ++g) next(g, speed[t.up[g]]);
        return;
    }
    int p = 0;
    const auto head = [&](int path) {
        const int g = t.run_begin[path], up = t.run_parent[path];
        return next(g, up >= 0 ? speed[up] : 0);
    };
    while (p < t.run_count) {
        const int a_end = t.run_begin[p + 1];
        double qa = head(p);
        int a = t.run_begin[p] + 1;
        if (p + 1 < t.run_count) {
            const int up = t.run_parent[p + 1];
            while (a <= up && a < a_end) qa = next(a++, qa);
            const int b_end = t.run_begin[p + 2];
            double qb = head(p + 1);
            int b = a_end + 1;
            int common = a_end - a < b_end - b ? a_end - a : b_end - b;
            for (; common >= 4; common -= 4, a += 4, b += 4) {
                for (int i = 0; i < 4; ++i) {
                    qa = next(a + i, qa);
                    qb = next(b + i, qb);
                }
            }
            for (; common > 0; --common) {
                qa = next(a++, qa);
                qb = next(b++, qb);
            }
            while (b < b_end) qb = next(b++, qb);
            ++p;
        }
        while (a < a_end) qa = next(a++, qa);
        ++p;
    }
}

void solve(const TreePaths& t, const StageMatrix& stage, const double* momentum, const Twists& twists,
           double* speed) SHIFTRIG_REALTIME {
    const double* __restrict p = momentum, * __restrict psi = twists.twist, * __restrict way = twists.way;
    const double* __restrict stiffness = t.stiffness;
    double* __restrict right = speed;
    const double weight = stage.weight, share = twists.share;
    const auto link = [=](int g, double difference) {
        return weight * stiffness[g] * SHIFTRIG_FMA(share, difference, psi[g]);
    };
    const int groups = t.groups;
    for (int g = 0; g < groups; ++g)
        right[g] = p[g] + (link(g + 1, way[g + 1] - way[g]) - link(g, way[g] - way[g - 1]));
    for (int i = 0; i < t.hanging; ++i) {
        const int g = t.head[i], up = t.up[g];
        const double taken = link(g, way[g] - way[g - 1]), passed = link(g, way[g] - way[up]);
        right[g - 1] -= taken;
        right[g] += taken - passed;
        right[up] += passed;
    }
    eliminate(t, stage.lower, right);
    substitute(t, stage.inverse, stage.lower, right);
}

void finish(const TreePaths& t, const Twists& twists, double weight, const double* last_speed, double* speed,
            double* twist) SHIFTRIG_REALTIME {
    const double* __restrict way = twists.way, * __restrict psi = twists.twist, * __restrict last = last_speed;
    double* __restrict q = speed;
    double* __restrict end = twist;
    const auto turned = [=](int g, int up) {
        return psi[g] + SHIFTRIG_FMA(weight, last[g] - last[up], way[g] - way[up]);
    };
    const int groups = t.groups;
    for (int g = 0; g < groups; ++g) {
        end[g] = turned(g, g - 1);
        q[g] = last[g];
    }
    for (int p = 0; p < t.count; ++p) {
        const int head = t.begin[p];
        end[head] = t.parent[p] < 0 ? 0 : turned(head, t.parent[p]);
    }
    end[groups] = 0;  // read, and of no consequence
}

double middle(const TreePaths& t, const MiddleSums& s, double* speed, double* rate) SHIFTRIG_REALTIME {
    double* __restrict q = speed;
    const double eighth = s.h / 8;
    const double *__restrict q0 = s.speed[0], *__restrict q1 = s.speed[1], *__restrict n0 = s.net[0],
                            *__restrict n1 = s.net[1], *__restrict inverse = t.inverse_mass;
    const int groups = t.groups;
    for (int g = 0; g < groups; ++g)
        q[g] = SHIFTRIG_FMA(eighth, (n0[g] - n1[g]) * inverse[g], 0.5 * (q0[g] + q1[g]));
    differences(t, speed, rate);
    constexpr int lanes = 8;
    double sums[lanes] = {};
    const double *d0 = s.rate[0], *d1 = s.rate[1], *loss = s.loss, *drag_loss = s.drag_loss;
    const auto squares = [](double a, double b, double c) {
        return SHIFTRIG_FMA(4 * b, b, SHIFTRIG_FMA(a, a, c * c));
    };
    int g = 0;
    for (; g + lanes <= groups; g += lanes) {
        for (int i = 0; i < lanes; ++i)
            sums[i] = SHIFTRIG_FMA(loss[g + i], squares(d0[g + i], rate[g + i], d1[g + i]), sums[i]);
    }
    for (int i = 0; g < groups; ++g, ++i) sums[i] = SHIFTRIG_FMA(loss[g], squares(d0[g], rate[g], d1[g]), sums[i]);
    if (t.drags) {
        for (g = 0; g < groups; ++g)
            sums[g % lanes] = SHIFTRIG_FMA(drag_loss[g], squares(q0[g], q[g], q1[g]), sums[g % lanes]);
    }
    return ((sums[0] + sums[1]) + (sums[2] + sums[3])) + ((sums[4] + sums[5]) + (sums[6] + sums[7]));
}

Swing swing_error(const TreePaths& t, const StageSums& s, double* way, double* twist) SHIFTRIG_REALTIME {
    constexpr int lanes = 8;
    double errors[lanes] = {}, speeds[lanes] = {};
    const double *__restrict q0 = s.speed[0], *__restrict q1 = s.speed[1], *__restrict q2 = s.speed[2],
                            *__restrict q3 = s.speed[3];
    const double w0 = s.of_way[0], w1 = s.of_way[1], w2 = s.of_way[2], w3 = s.of_way[3];
    double* __restrict turned = way;
    const int groups = t.groups;
    for (int g = 0; g < groups; ++g)
        turned[g] = SHIFTRIG_FMA(w3, q3[g], SHIFTRIG_FMA(w2, q2[g], SHIFTRIG_FMA(w1, q1[g], w0 * q0[g])));
    differences(t, way, twist);
    twist[-1] = twist[groups] = 0;  // read, and of no consequence
    const auto look = [=](int g, double& error, double& fastest) {
        const double wrong = __builtin_fabs(twist[g]), q = __builtin_fabs(q3[g]);
        error = wrong > error ? wrong : error;
        fastest = q > fastest ? q : fastest;
    };
    int g = 0;
    for (; g + lanes <= groups; g += lanes) {
        for (int i = 0; i < lanes; ++i) look(g + i, errors[i], speeds[i]);
    }
    for (int i = 0; g < groups; ++g, ++i) look(g, errors[i], speeds[i]);
    Swing swing;
    for (int i = 0; i < lanes; ++i) {
        swing.error = errors[i] > swing.error ? errors[i] : swing.error;
        swing.fastest = speeds[i] > swing.fastest ? speeds[i] : swing.fastest;
    }
    return swing;
}

void correct(const TreePaths& t, const StageMatrix& stage, double* momentum, const double* error,
             double factor, const SwingWork& work, double* speed, double* twist) SHIFTRIG_REALTIME {
    // S e, then S of that: the momenta and twists it stands for are M q and ψ + hγ δ.
    double *const first = work.first, *const second = work.second;
    solve(t, stage, momentum, {error, error, 0}, first);
    const double* mass = t.mass;
    const int groups = t.groups;
    first[-1] = first[groups] = 0;  // read, and of no consequence
    for (int g = 0; g < groups; ++g) momentum[g] = mass[g] * first[g];
    solve(t, stage, momentum, {error, first, stage.weight}, second);
    differences(t, second, work.rate);
    const double* rate = work.rate;
    double* __restrict q = speed;
    double* __restrict end = twist;
    const double of_rate = factor * stage.weight;
    for (int g = 0; g < groups; ++g) {
        q[g] = SHIFTRIG_FMA(factor, second[g] - first[g], q[g]);
        end[g] = SHIFTRIG_FMA(of_rate, rate[g], end[g]);
    }
}

constexpr TreeKernel kernel{shaft_torques, combine, solve, finish, middle, swing_error, correct};

}  // namespace
}  // namespace shiftrig::plant::detail
