// The loops of tree_kernels.h, included once per instruction set with SHIFTRIG_FMA(a, b, c) = a b + c of numbers and
// SHIFTRIG_BLOCK_FMA the same of four of them. No function of the standard library may be instantiated here: the linker
// would keep one copy for all instruction sets.
#include <cstdint>

#include "plant/tree_kernels.h"

namespace shiftrig::plant::detail {
namespace {

// All of it is inlined here: no other file ever passes a block by value.
#pragma GCC diagnostic ignored "-Wpsabi"

constexpr int lanes = tree_block;
#include "plant/lanes_body.h"

inline Lanes all(double value) noexcept {
    return Lanes{value, value, value, value};
}

// The last numbers of one block and all but the last of the next: each group's parent inside a path.
inline Lanes one_before(const Lanes& last, const Lanes& here) noexcept {
    return __builtin_shufflevector(last, here, 3, 4, 5, 6);
}
inline Lanes one_behind(const Lanes& here, const Lanes& next) noexcept {
    return __builtin_shufflevector(here, next, 1, 2, 3, 4);
}

// Of value(g), in blocks: use(g, value, difference to the group before). At heads of paths that is nobody's business;
// at_head(g, parent) puts right what came of it.
template <typename Value, typename Use, typename AtHead>
inline void along_paths(const TreePaths& t, const Value& value, const Use& use,
                        const AtHead& at_head) noexcept {
    Lanes last = {};
    for (int g = 0, groups = t.groups; g < groups; g += lanes) {
        const Lanes here = value(g);
        use(g, here, here - one_before(last, here));
        last = here;
    }
    for (int i = 0; i < t.hanging; ++i) at_head(t.head[i], t.up[t.head[i]]);
}

inline void set_at_roots(const TreePaths& t, double* values) noexcept {
    for (int p = 0; p < t.count; ++p) {
        if (t.parent[p] < 0) values[t.begin[p]] = 0;
    }
}

// Along the tree's edges; 0 at roots.
inline void differences(const TreePaths& t, const double* way, double* difference) noexcept {
    along_paths(
        t, [=](int g) { return read(way + g); },
        [=](int g, const Lanes&, const Lanes& change) { write(difference + g, change); },
        [=](int head, int parent) { difference[head] = way[head] - way[parent]; });
    set_at_roots(t, difference);
}

void shaft_torques(const TreePaths& t, const double* speed, const double* twist, double* rate, double* passed,
                   double* torque) SHIFTRIG_REALTIME {
    // Links to the group before first; what heads have passes another one by.
    along_paths(
        t, [=](int g) { return read(speed + g); },
        [=, stiffness = t.inner_stiffness, damping = t.inner_damping](int g, const Lanes&,
                                                                      const Lanes& change) {
            write(rate + g, change);
            write(passed + g,
                  SHIFTRIG_BLOCK_FMA(read(stiffness + g), read(twist + g), read(damping + g) * change));
        },
        [=](int head, int parent) { rate[head] = speed[head] - speed[parent]; });
    set_at_roots(t, rate);
    const int groups = t.groups;
    passed[groups] = 0;
    Lanes here = read(passed);
    for (int g = 0; g < groups; g += lanes) {
        const Lanes next = read(passed + g + lanes);
        write(torque + g, one_behind(here, next) - here);
        here = next;
    }
    for (int i = 0; i < t.hanging; ++i) {
        const int head = t.head[i];
        passed[head] = SHIFTRIG_FMA(t.stiffness[head], twist[head], t.damping[head] * rate[head]);
        torque[head] -= passed[head];
        torque[t.up[head]] += passed[head];
    }
    if (!t.drags) return;
    for (int g = 0; g < groups; ++g) torque[g] = SHIFTRIG_FMA(-t.drag[g], speed[g], torque[g]);
}

template <int count>
void combine_speeds(const TreePaths& t, const StageSums& s, double* __restrict momentum,
                    double* __restrict way) noexcept {
    constexpr int b = count > 1 ? 1 : 0, c = count > 2 ? 2 : 0,
                  d = count > 3 ? 3 : 0;  // where there are fewer terms the last ones are unused
    const double* __restrict q0 = s.speed[0], * __restrict q1 = s.speed[b], * __restrict q2 = s.speed[c], * __restrict q3 = s.speed[d];
    const double m0 = s.of_momentum[0], m1 = s.of_momentum[b], m2 = s.of_momentum[c], m3 = s.of_momentum[d];
    const double *const ways = s.weight_of_way, w0 = s.h * ways[0], w1 = s.h * ways[b], w2 = s.h * ways[c],
                        w3 = s.h * ways[d];
    const double of_net = s.of_net;
    const double* __restrict mass = t.mass, * __restrict net = s.net;
    const int groups = t.groups;
    for (int g = 0; g < groups; ++g) {
        const double q = q0[g];
        double p = m0 * q, turned = w0 * q;
        if constexpr (count > 1) {
            p = SHIFTRIG_FMA(m1, q1[g] - q, p);
            turned = SHIFTRIG_FMA(w1, q1[g], turned);
        }
        if constexpr (count > 2) {
            p = SHIFTRIG_FMA(m2, q2[g] - q, p);
            turned = SHIFTRIG_FMA(w2, q2[g], turned);
        }
        if constexpr (count > 3) {
            p = SHIFTRIG_FMA(m3, q3[g] - q, p);
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

// x_i + L_i · (the one before) along a run is a chain of dependent operations. A block at a time it is a scan in a register,
// and only what one block hands on to the next is a chain: TreeScan says what of a block's values goes on to which.
// Shifted by one and by two; those at the end come round, and their factors are 0.
inline Lanes from_below(const Lanes& v) noexcept {
    return __builtin_shufflevector(v, v, 3, 0, 1, 2);
}
inline Lanes from_above(const Lanes& v) noexcept {
    return __builtin_shufflevector(v, v, 1, 2, 3, 0);
}
inline Lanes by_two(const Lanes& v) noexcept {
    return __builtin_shufflevector(v, v, 2, 3, 0, 1);
}

// Leaves towards roots: b of the parent += L b.
inline void eliminate(const TreePaths& t, const StageMatrix& m, double* __restrict right) noexcept {
    const double* __restrict lower = m.lower;
    if (!t.long_runs) {
        for (int g = t.groups - 1; g > 0; --g)
            right[t.up[g]] = SHIFTRIG_FMA(lower[g], right[g], right[t.up[g]]);
        return;
    }
    const TreeScan& scan = m.towards_roots;
    for (int run = t.run_count - 1; run >= 0; --run) {
        const int begin = t.run_begin[run];
        int g = t.run_begin[run + 1];
        double below = 0;  // of the group behind
        for (; g - lanes >= begin; g -= lanes) {
            const int at = g - lanes;
            Lanes b = read(right + at);
            b = SHIFTRIG_BLOCK_FMA(read(scan.by_one + at), from_above(b), b);
            b = SHIFTRIG_BLOCK_FMA(read(scan.by_two + at), by_two(b), b);
            const Lanes outside = read(scan.from_outside + at);
            write(right + at, SHIFTRIG_BLOCK_FMA(outside, all(below), b));
            below = SHIFTRIG_FMA(outside[0], below, b[0]);
        }
        for (; g > begin; --g) {
            const double above = right[g - 1];
            below = g == t.run_begin[run + 1] ? above : SHIFTRIG_FMA(lower[g], below, above);
            right[g - 1] = below;
        }
        const int up = t.run_parent[run];
        if (up >= 0) right[up] = SHIFTRIG_FMA(lower[begin], below, right[up]);
    }
}

// Roots towards leaves: q = b/D + L q of the parent.
inline void substitute(const TreePaths& t, const StageMatrix& m, double* __restrict speed) noexcept {
    const double* __restrict inverse = m.inverse, * __restrict lower = m.lower;
    if (!t.long_runs) {
        speed[0] *= inverse[0];
        for (int g = 1; g < t.groups; ++g)
            speed[g] = SHIFTRIG_FMA(lower[g], speed[t.up[g]], inverse[g] * speed[g]);
        return;
    }
    const TreeScan& scan = m.towards_leaves;
    for (int run = 0; run < t.run_count; ++run) {
        const int up = t.run_parent[run], end = t.run_begin[run + 1];
        double above = up >= 0 ? speed[up] : 0;
        int g = t.run_begin[run];
        for (; g + lanes <= end; g += lanes) {
            Lanes q = read(inverse + g) * read(speed + g);
            q = SHIFTRIG_BLOCK_FMA(read(scan.by_one + g), from_below(q), q);
            q = SHIFTRIG_BLOCK_FMA(read(scan.by_two + g), by_two(q), q);
            const Lanes outside = read(scan.from_outside + g);
            write(speed + g, SHIFTRIG_BLOCK_FMA(outside, all(above), q));
            above = SHIFTRIG_FMA(outside[lanes - 1], above, q[lanes - 1]);
        }
        for (; g < end; ++g) above = speed[g] = SHIFTRIG_FMA(lower[g], above, inverse[g] * speed[g]);
    }
}

void solve(const TreePaths& t, const StageMatrix& stage, const double* momentum, const Twists& twists,
           double* speed) SHIFTRIG_REALTIME {
    const double* __restrict p = momentum, * __restrict psi = twists.twist, * __restrict way = twists.way;
    double* __restrict right = speed;
    const double weight = stage.weight, share = twists.share;
    // Links to the group before, a block at a time: those of the next one are needed for the last group of this one.
    const auto links = [=, stiffness = t.inner_stiffness](int g) {
        const Lanes twisted =
            SHIFTRIG_BLOCK_FMA(all(share), read(way + g) - read(way + g - 1), read(psi + g));
        return all(weight) * read(stiffness + g) * twisted;
    };
    Lanes here = links(0);
    for (int g = 0; g < t.groups; g += lanes) {
        const Lanes next = links(g + lanes);
        write(right + g, read(p + g) + (one_behind(here, next) - here));
        here = next;
    }
    for (int i = 0; i < t.hanging; ++i) {
        const int g = t.head[i], up = t.up[g];
        const double passed = weight * t.stiffness[g] * SHIFTRIG_FMA(share, way[g] - way[up], psi[g]);
        right[g] -= passed;
        right[up] += passed;
    }
    eliminate(t, stage, right);
    substitute(t, stage, right);
}

void finish(const TreePaths& t, const Twists& twists, double weight, const double* last_speed, double* speed,
            double* twist) SHIFTRIG_REALTIME {
    const double *way = twists.way, *psi = twists.twist;
    along_paths(
        t,
        [=](int g) {
            const Lanes last = read(last_speed + g);
            write(speed + g, last);
            return SHIFTRIG_BLOCK_FMA(all(weight), last, read(way + g));
        },
        [=](int g, const Lanes&, const Lanes& turned) { write(twist + g, read(psi + g) + turned); },
        [=](int head, int parent) {
            twist[head] = psi[head] + (SHIFTRIG_FMA(weight, last_speed[head], way[head]) -
                                       SHIFTRIG_FMA(weight, last_speed[parent], way[parent]));
        });
    set_at_roots(t, twist);
    twist[t.groups] = 0;  // read, and of no consequence
}

// Σ weight (a² + 4 b² + c²)
inline Lanes squares(const Lanes& weight, const Lanes& a, const Lanes& b, const Lanes& c) noexcept {
    return weight * SHIFTRIG_BLOCK_FMA(4. * b, b, SHIFTRIG_BLOCK_FMA(a, a, c * c));
}

double middle(const TreePaths& t, const MiddleSums& s, double* speed) SHIFTRIG_REALTIME {
    const double *q0 = s.speed[0], *q1 = s.speed[1], *n0 = s.net[0], *n1 = s.net[1],
                 *inverse = t.inverse_mass, *d0 = s.rate[0], *d1 = s.rate[1];
    const Lanes eighth = all(s.h / 8);
    const int groups = t.groups;
    Lanes sums = {};
    double at_heads = 0;
    along_paths(
        t,
        [=](int g) {
            const Lanes change = (read(n0 + g) - read(n1 + g)) * read(inverse + g);
            const Lanes q = SHIFTRIG_BLOCK_FMA(eighth, change, 0.5 * (read(q0 + g) + read(q1 + g)));
            write(speed + g, q);
            return q;
        },
        [&](int g, const Lanes&, const Lanes& rate) {
            sums += where(first_of(groups - g), squares(read(s.loss + g), read(d0 + g), rate, read(d1 + g)));
        },
        [&](int head, int parent) {
            const double wrong = speed[head] - speed[head - 1], rate = speed[head] - speed[parent];
            at_heads += 4 * s.loss[head] * (rate * rate - wrong * wrong);
        });
    if (t.drags) {
        for (int g = 0; g < groups; g += lanes)
            sums += where(first_of(groups - g),
                          squares(read(s.drag_loss + g), read(q0 + g), read(speed + g), read(q1 + g)));
    }
    return ((sums[0] + sums[1]) + (sums[2] + sums[3])) + at_heads;
}

Swing swing_error(const TreePaths& t, const StageSums& s, double* way) SHIFTRIG_REALTIME {
    const double *q0 = s.speed[0], *q1 = s.speed[1], *q2 = s.speed[2], *q3 = s.speed[3];
    const double* const ways = s.weight_of_way;
    const Lanes w0 = all(s.h * ways[0]), w1 = all(s.h * ways[1]), w2 = all(s.h * ways[2]),
                w3 = all(s.h * ways[3]);
    const int groups = t.groups;
    const double* const inside = t.inside;
    const auto largest = [](const Lanes& a, const Lanes& b) { return a > b ? a : b; };
    Lanes errors = {}, speeds = {};
    Swing swing;
    along_paths(
        t,
        [=](int g) {
            return SHIFTRIG_BLOCK_FMA(
                w3, read(q3 + g),
                SHIFTRIG_BLOCK_FMA(w2, read(q2 + g),
                                   SHIFTRIG_BLOCK_FMA(w1, read(q1 + g), w0 * read(q0 + g))));
        },
        [&](int g, const Lanes& turned, const Lanes& twisted) {
            write(way + g, turned);
            const Lanes error = read(inside + g) > 0. ? magnitude(twisted) : Lanes{};
            errors = largest(where(first_of(groups - g), error), errors);
            speeds = largest(where(first_of(groups - g), magnitude(read(q3 + g))), speeds);
        },
        [&](int head, int parent) {
            const double error = __builtin_fabs(way[head] - way[parent]);
            swing.error = error > swing.error ? error : swing.error;
        });
    way[-1] = way[groups] = 0;  // read, and of no consequence
    for (int i = 0; i < lanes; ++i) {
        swing.error = errors[i] > swing.error ? errors[i] : swing.error;
        swing.fastest = speeds[i] > swing.fastest ? speeds[i] : swing.fastest;
    }
    return swing;
}

void correct(const TreePaths& t, const StageMatrix& stage, double* momentum, const double* way, double factor,
             const SwingWork& work, double* speed, double* twist) SHIFTRIG_REALTIME {
    // S e, then S of that: the momenta and twists it stands for are M q and ψ + hγ δ.
    double *const error = work.error, *const first = work.first, *const second = work.second;
    differences(t, way, error);
    const int groups = t.groups;
    error[-1] = error[groups] = 0;  // read, and of no consequence
    solve(t, stage, momentum, {error, error, 0}, first);
    const double* mass = t.mass;
    first[-1] = first[groups] = 0;  // likewise
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

void slips(const GroupPairs& pairs, const double* of_group, const int* place, int count,
           double* values) SHIFTRIG_REALTIME {
    const auto work_out = [&](int i, Lanes& slip) {
        slip = read(pairs.of_first + i) * gather(of_group, pairs.first + i) +
               read(pairs.of_second + i) * gather(of_group, pairs.second + i);
    };
    int i = 0;
    // Where loops over devices take eight at a time, they read what one store has written.
    constexpr int two = 2 * lanes;
    for (; i + two <= count && place[i + two - 1] - place[i] == two - 1; i += two) {  // places rise
        Lanes first, second;
        work_out(i, first);
        work_out(i + lanes, second);
        const auto both = __builtin_shufflevector(first, second, 0, 1, 2, 3, 4, 5, 6, 7);
        __builtin_memcpy(values + place[i], &both, sizeof both);
    }
    for (; i + lanes <= count; i += lanes) {
        Lanes slip;
        work_out(i, slip);
        if (place[i + lanes - 1] - place[i] == lanes - 1) {  // places rise
            write(values + place[i], slip);
        } else {
            for (int j = 0; j < lanes; ++j) values[place[i + j]] = slip[j];
        }
    }
    for (; i < count; ++i) {
        values[place[i]] =
            pairs.of_first[i] * of_group[pairs.first[i]] + pairs.of_second[i] * of_group[pairs.second[i]];
    }
}

template <int terms, bool scaled>
void give_efforts(const GroupForces& forces, const Efforts& e, const double* scale, double* sum) noexcept {
    const auto give = [=](int g, double impulse) { sum[g] += scaled ? impulse * scale[g] : impulse; };
    const GroupPairs& share = forces.share;
    const double* effort[terms];
    double weight[terms];
    for (int j = 0; j < terms; ++j) {
        effort[j] = e.effort[j];
        weight[j] = e.factor * e.weight[j];
    }
    int i = 0;
    for (; i + lanes <= forces.count; i += lanes) {
        const int* const place = forces.place + i;
        const bool side_by_side = place[lanes - 1] - place[0] == lanes - 1;
        Lanes sum_of_terms = {};
        for (int j = 0; j < terms; ++j) {
            const Lanes term = side_by_side ? read(effort[j] + place[0]) : gather(effort[j], place);
            sum_of_terms = SHIFTRIG_BLOCK_FMA(all(weight[j]), term, sum_of_terms);
        }
        const Lanes first = read(share.of_first + i) * sum_of_terms,
                    second = read(share.of_second + i) * sum_of_terms;
        for (int j = 0; j < lanes; ++j) {
            give(share.first[i + j], first[j]);
            give(share.second[i + j], second[j]);
        }
    }
    for (; i < forces.count; ++i) {
        double sum_of_terms = 0;
        for (int j = 0; j < terms; ++j)
            sum_of_terms = SHIFTRIG_FMA(weight[j], effort[j][forces.place[i]], sum_of_terms);
        give(share.first[i], share.of_first[i] * sum_of_terms);
        give(share.second[i], share.of_second[i] * sum_of_terms);
    }
}

template <int terms>
inline void give_terms(const GroupForces& forces, const Efforts& e, const double* scale,
                       double* sum) noexcept {
    scale ? give_efforts<terms, true>(forces, e, scale, sum)
          : give_efforts<terms, false>(forces, e, nullptr, sum);
}

void give(const GroupForces& forces, const Efforts& e, const double* scale, double* sum) SHIFTRIG_REALTIME {
    if (e.terms == 1) give_terms<1>(forces, e, scale, sum);
    if (e.terms == 2) give_terms<2>(forces, e, scale, sum);
    if (e.terms == 3) give_terms<3>(forces, e, scale, sum);
    if (e.terms == 4) give_terms<4>(forces, e, scale, sum);
}

void spread(const Spreading& s, const double* of_group, int count, double* values) SHIFTRIG_REALTIME {
    const int* const group = s.group;
    int i = 0;
    for (; i + lanes <= count; i += lanes) {
        const Lanes from = s.in_line[i / lanes] ? read(of_group + group[i]) : gather(of_group, group + i);
        write(values + i, read(s.ratio + i) * from);
    }
    for (; i < count; ++i) values[i] = s.ratio[i] * of_group[group[i]];
}

constexpr TreeKernel kernel{shaft_torques, combine, solve, finish, middle,
                            swing_error,   correct, slips, give,   spread};

}  // namespace
}  // namespace shiftrig::plant::detail
