// The loops of tree_kernels.h between groups and devices. Included in tree_kernels_body.h.

void slips(const GroupPairs& pairs, const double* of_group, const int* place, int count,
           double* values) SHIFTRIG_REALTIME {
    const auto work_out = [&](int i, Lanes& slip) {
        slip = read(pairs.of_first + i) * gather(of_group, pairs.first + i) +
               read(pairs.of_second + i) * gather(of_group, pairs.second + i);
    };
    int i = 0;
#if SHIFTRIG_LANES == 4  // loops over devices may take eight at a time: they read what one store has written
    constexpr int two = 2 * lanes;
    for (; i + two <= count && place[i + two - 1] - place[i] == two - 1; i += two) {  // places rise
        Lanes first, second;
        work_out(i, first);
        work_out(i + lanes, second);
        const auto both = __builtin_shufflevector(first, second, 0, 1, 2, 3, 4, 5, 6, 7);
        __builtin_memcpy(values + place[i], &both, sizeof both);
    }
#endif
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
        double first[lanes], second[lanes];
        write(first, read(share.of_first + i) * sum_of_terms);
        write(second, read(share.of_second + i) * sum_of_terms);
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
