// A few doubles copied, cleared, compared in place: memmove, memset and memcmp would be called for no more than a
// register or two, and their wide reads wait for the narrow writes just before them.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace shiftrig::plant::detail {

// Returns where it ends.
inline double* copy_few(const double* from, int count, double* to) noexcept {
    for (int i = 0; i < count; ++i) to[i] = from[i];
    return to + count;
}

inline void clear_few(double* from, double* end) noexcept {
    while (from < end) *from++ = 0;
}

// The largest magnitude of value(i), at least 0; of an even and an odd one in turn, since each waits for the one before.
template <typename Value>
double largest_of(int count, const Value& value) noexcept {
    double even = 0, odd = 0;
    int i = 0;
    for (; i + 1 < count; i += 2) {
        even = std::max(even, std::fabs(value(i)));
        odd = std::max(odd, std::fabs(value(i + 1)));
    }
    if (i < count) even = std::max(even, std::fabs(value(i)));
    return std::max(even, odd);
}

// The same, bit for bit?
inline bool same_bits(const double* a, const double* b, int count) noexcept {
    std::uint64_t different = 0;
    for (int i = 0; i < count; ++i)
        different |= std::bit_cast<std::uint64_t>(a[i]) ^ std::bit_cast<std::uint64_t>(b[i]);
    return different == 0;
}

// Contact states, one byte each, in memory of whole words that ends in zeros.
constexpr int whole_words(int bytes) noexcept {
    return (bytes + 7) / 8 * 8;
}
inline bool same_states(const unsigned char* a, const unsigned char* b, int bytes) noexcept {
    std::uint64_t different = 0, word_a, word_b;
    for (int i = 0; i < bytes; i += 8) {
        std::memcpy(&word_a, a + i, 8);
        std::memcpy(&word_b, b + i, 8);
        different |= word_a ^ word_b;
    }
    return different == 0;
}
inline void copy_states(const unsigned char* from, int bytes, unsigned char* to) noexcept {
    for (int i = 0; i < bytes; i += 8) std::memcpy(to + i, from + i, 8);
}

inline bool same_bytes(const void* a, const void* b, std::size_t count) noexcept {
    return count == 0 || std::memcmp(a, b, count) == 0;  // of none there may be no address
}

}  // namespace shiftrig::plant::detail
