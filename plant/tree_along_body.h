// The loops of tree_kernels.h along the paths of a tree. Included in tree_kernels_body.h.

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

// What the torques of links to the parent make of the groups: +1 of each at the parent, −1 at its own. A block late, since the last
// group of a block takes part in the first link of the next.
class LinkSums {
  public:
    LinkSums(const TreePaths& t, double* sum) noexcept : groups_(t.groups), sum_(sum) {}
    // Of the block from g on: what there is without links, and these.
    void take(int g, const Lanes& free, const Lanes& link) noexcept {
        if (g > 0) put(g - lanes, link);
        free_ = free;
        link_ = where(first_of(groups_ - g), link);  // what stands behind the last group is no number
    }
    void finish() noexcept { put((groups_ - 1) / lanes * lanes, Lanes{}); }

  private:
    void put(int g, const Lanes& next) noexcept {
        write(sum_ + g, free_ + (one_behind(link_, next) - link_));
    }
    int groups_;
    double* __restrict sum_;
    Lanes free_ = {}, link_ = {};
};

void shaft_torques(const TreePaths& t, const double* speed, const double* twist, double* rate, double* passed,
                   double* torque) SHIFTRIG_REALTIME {
    // Links to the group before first; what heads have passes another one by.
    LinkSums sums(t, torque);
    along_paths(
        t, [=](int g) { return read(speed + g); },
        [&, stiffness = t.inner_stiffness, damping = t.inner_damping](int g, const Lanes&,
                                                                      const Lanes& change) {
            write(rate + g, change);
            const Lanes link =
                SHIFTRIG_BLOCK_FMA(read(stiffness + g), read(twist + g), read(damping + g) * change);
            write(passed + g, link);
            sums.take(g, Lanes{}, link);
        },
        [=](int head, int parent) { rate[head] = speed[head] - speed[parent]; });
    sums.finish();
    set_at_roots(t, rate);
    for (int i = 0; i < t.hanging; ++i) {
        const int head = t.head[i];
        passed[head] = SHIFTRIG_FMA(t.stiffness[head], twist[head], t.damping[head] * rate[head]);
        torque[head] -= passed[head];
        torque[t.up[head]] += passed[head];
    }
    if (!t.drags) return;
    for (int g = 0, groups = t.groups; g < groups; ++g)
        torque[g] = SHIFTRIG_FMA(-t.drag[g], speed[g], torque[g]);
}

// Twists of heads besides.
template <typename Twist>
inline void take_at_heads(const TreePaths& t, double weight, const Twist& twist, double* right) noexcept {
    for (int i = 0; i < t.hanging; ++i) {
        const int g = t.head[i], up = t.up[g];
        const double passed = weight * t.stiffness[g] * twist(g, up);
        right[g] -= passed;
        right[up] += passed;
    }
}

template <int count, bool twisted>
void combine_speeds(const TreePaths& t, double weight, const StageSums& s, const double* __restrict twist,
                    double* __restrict right, double* __restrict way) noexcept {
    constexpr int b = count > 1 ? 1 : 0, c = count > 2 ? 2 : 0,
                  d = count > 3 ? 3 : 0;  // where there are fewer terms the last ones are unused
    const double* __restrict q0 = s.speed[0], * __restrict q1 = s.speed[b], * __restrict q2 = s.speed[c], * __restrict q3 = s.speed[d];
    const Lanes m0 = all(s.of_momentum[0]), m1 = all(s.of_momentum[b]), m2 = all(s.of_momentum[c]),
                m3 = all(s.of_momentum[d]);
    const double* const ways = s.weight_of_way;
    const Lanes w0 = all(s.h * ways[0]), w1 = all(s.h * ways[b]), w2 = all(s.h * ways[c]),
                w3 = all(s.h * ways[d]);
    const Lanes of_net = all(s.of_net);
    const double* __restrict mass = t.mass, * __restrict net = s.net;
    const int groups = t.groups;
    const double* __restrict stiffness = t.inner_stiffness;
    const Lanes weights = all(weight);
    LinkSums sums(t, right);
    Lanes last = {};
    for (int g = 0; g < groups; g += lanes) {
        const Lanes q = read(q0 + g);
        Lanes p = m0 * q, turned = w0 * q;
        if constexpr (count > 1) {
            const Lanes next = read(q1 + g);
            p = SHIFTRIG_BLOCK_FMA(m1, next - q, p);
            turned = SHIFTRIG_BLOCK_FMA(w1, next, turned);
        }
        if constexpr (count > 2) {
            const Lanes next = read(q2 + g);
            p = SHIFTRIG_BLOCK_FMA(m2, next - q, p);
            turned = SHIFTRIG_BLOCK_FMA(w2, next, turned);
        }
        if constexpr (count > 3) {
            const Lanes next = read(q3 + g);
            p = SHIFTRIG_BLOCK_FMA(m3, next - q, p);
            turned = SHIFTRIG_BLOCK_FMA(w3, next, turned);
        }
        write(way + g, turned);
        Lanes twists = turned - one_before(last, turned);
        if constexpr (twisted) twists += read(twist + g);
        last = turned;
        sums.take(g, SHIFTRIG_BLOCK_FMA(read(mass + g), p, of_net * read(net + g)),
                  weights * read(stiffness + g) * twists);
    }
    sums.finish();
    take_at_heads(
        t, weight, [=](int g, int up) { return twisted ? twist[g] + (way[g] - way[up]) : way[g] - way[up]; },
        right);
}

template <bool twisted>
inline void combine_stages(const TreePaths& t, double weight, const StageSums& s, const double* twist,
                           double* right, double* way) noexcept {
    if (s.count == 1) combine_speeds<1, twisted>(t, weight, s, twist, right, way);
    if (s.count == 2) combine_speeds<2, twisted>(t, weight, s, twist, right, way);
    if (s.count == 3) combine_speeds<3, twisted>(t, weight, s, twist, right, way);
    if (s.count == 4) combine_speeds<4, twisted>(t, weight, s, twist, right, way);
}

void combine(const TreePaths& t, double weight, const StageSums& s, const double* twist, double* right,
             double* way) SHIFTRIG_REALTIME {
    twist ? combine_stages<true>(t, weight, s, twist, right, way)
          : combine_stages<false>(t, weight, s, nullptr, right, way);
}

// x_i + L_i · (the one before) along a run is a chain of dependent operations. A block at a time it is a scan in a register,
// and only what one block hands on to the next is a chain: TreeScan says what of a block's values goes on to which; of those
// that come round when a block is shifted its factors are 0.
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
            b = SHIFTRIG_BLOCK_FMA(read(scan.by_one + at), from_above<1>(b), b);
            b = SHIFTRIG_BLOCK_FMA(read(scan.by_two + at), from_above<2>(b), b);
            if constexpr (lanes == 8) b = SHIFTRIG_BLOCK_FMA(read(scan.by_four + at), from_above<4>(b), b);
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
            q = SHIFTRIG_BLOCK_FMA(read(scan.by_one + g), from_below<1>(q), q);
            q = SHIFTRIG_BLOCK_FMA(read(scan.by_two + g), from_below<2>(q), q);
            if constexpr (lanes == 8) q = SHIFTRIG_BLOCK_FMA(read(scan.by_four + g), from_below<4>(q), q);
            const Lanes outside = read(scan.from_outside + g);
            write(speed + g, SHIFTRIG_BLOCK_FMA(outside, all(above), q));
            above = SHIFTRIG_FMA(outside[lanes - 1], above, q[lanes - 1]);
        }
        for (; g < end; ++g) above = speed[g] = SHIFTRIG_FMA(lower[g], above, inverse[g] * speed[g]);
    }
}

void solve(const TreePaths& t, const StageMatrix& stage, double* right) SHIFTRIG_REALTIME {
    eliminate(t, stage, right);
    substitute(t, stage, right);
}

void finish(const TreePaths& t, double weight, const double* psi, const double* way, const double* last_speed,
            double* speed, double* twist) SHIFTRIG_REALTIME {
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
    return total(sums) + at_heads;
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
    for (int i = 0; i < lanes; ++i) {
        swing.error = errors[i] > swing.error ? errors[i] : swing.error;
        swing.fastest = speeds[i] > swing.fastest ? speeds[i] : swing.fastest;
    }
    return swing;
}

void correct(const TreePaths& t, const StageMatrix& stage, const double* way, double factor,
             const SwingWork& work, double* speed, double* twist) SHIFTRIG_REALTIME {
    // S e, then S of that: the momenta and twists it stands for are M q and ψ + hγ δ.
    double *const error = work.error, *const first = work.first, *const second = work.second;
    const double weight = stage.weight;
    const int groups = t.groups;
    solve(t, stage, first);
    differences(t, way, error);
    LinkSums sums(t, second);
    along_paths(
        t, [=](int g) { return read(first + g); },
        [&, mass = t.mass, stiffness = t.inner_stiffness](int g, const Lanes& q, const Lanes& change) {
            const Lanes twists = SHIFTRIG_BLOCK_FMA(all(weight), change, read(error + g));
            const Lanes link = all(weight) * read(stiffness + g) * twists;
            sums.take(g, read(mass + g) * q, link);
        },
        [](int, int) {});
    sums.finish();
    take_at_heads(
        t, weight, [=](int g, int up) { return SHIFTRIG_FMA(weight, first[g] - first[up], error[g]); },
        second);
    solve(t, stage, second);
    differences(t, second, work.rate);
    const double* rate = work.rate;
    double* __restrict q = speed;
    double* __restrict end = twist;
    const double of_rate = factor * weight;
    for (int g = 0; g < groups; ++g) {
        q[g] = SHIFTRIG_FMA(factor, second[g] - first[g], q[g]);
        end[g] = SHIFTRIG_FMA(of_rate, rate[g], end[g]);
    }
}
