// How the loops along a tree shift, join and add up blocks. Included in tree_kernels_body.h after lanes_body.h.

// As many numbers as a block has of two that stand in line, from this one on.
template <int first>
inline Lanes window(const Lanes& a, const Lanes& b) SHIFTRIG_REALTIME {
#if SHIFTRIG_LANES == 8
    return __builtin_shufflevector(a, b, first, first + 1, first + 2, first + 3, first + 4, first + 5,
                                   first + 6, first + 7);
#else
    return __builtin_shufflevector(a, b, first, first + 1, first + 2, first + 3);
#endif
}

// The last number of one block and all but the last of the next: each group's parent inside a path.
inline Lanes one_before(const Lanes& last, const Lanes& here) noexcept {
    return window<lanes - 1>(last, here);
}
inline Lanes one_behind(const Lanes& here, const Lanes& next) noexcept {
    return window<1>(here, next);
}

// Shifted by so many; those at the end come round.
template <int by>
inline Lanes from_below(const Lanes& v) SHIFTRIG_REALTIME {
    return window<lanes - by>(v, v);
}
template <int by>
inline Lanes from_above(const Lanes& v) SHIFTRIG_REALTIME {
    return window<by>(v, v);
}

inline double total(const Lanes& v) noexcept {
    double sum = (v[0] + v[1]) + (v[2] + v[3]);
    if constexpr (lanes == 8) sum += (v[lanes - 4] + v[lanes - 3]) + (v[lanes - 2] + v[lanes - 1]);
    return sum;
}
