// Registers of `lanes` doubles, for loops that are compiled for each instruction set: whoever includes this defines `lanes`
// and includes it inside its own unnamed namespace, so that no two files share what they compile.

using Lanes = double __attribute__((vector_size(8 * lanes)));
using Marks = std::int64_t __attribute__((vector_size(8 * lanes)));

inline Lanes read(const double* p) noexcept {
    Lanes v;
    __builtin_memcpy(&v, p, sizeof v);
    return v;
}
inline void write(double* p, const Lanes& v) noexcept {
    __builtin_memcpy(p, &v, sizeof v);
}
inline Lanes all(double value) noexcept {
    return value - Lanes{};
}
inline Lanes magnitude(const Lanes& v) noexcept {
    return reinterpret_cast<Lanes>(reinterpret_cast<Marks>(v) & INT64_MAX);
}
inline Lanes where(const Marks& marks, const Lanes& v) noexcept {  // 0 elsewhere
    return reinterpret_cast<Lanes>(reinterpret_cast<Marks>(v) & marks);
}
// Read from 8 − n on, marks for the first n.
alignas(64) constexpr std::int64_t first_marks[16] = {-1, -1, -1, -1, -1, -1, -1, -1};

inline Marks first_of(int count) noexcept {
    Marks counted;
    __builtin_memcpy(&counted, first_marks + 8 - (count < lanes ? count : lanes), sizeof counted);
    return counted;
}

inline Lanes gather(const double* from, const int* index) noexcept {
    Lanes v;
    for (int i = 0; i < lanes; ++i) v[i] = from[index[i]];
    return v;
}
