// Elementary functions whose bits do not depend on the machine: only IEEE additions, multiplications,
// divisions and square roots in a fixed order, no call of the C library (which picks its variant by
// processor). Compile with contraction off.
//
//   exp     range reduction x = k ln 2 + r, |r| ≤ ln 2 / 2, Taylor polynomial of degree 13
//   log     x = 2^k (1 + f), s = f/(2 + f), log(1 + f) = 2 artanh s as a series in s² up to s²³
//   sin/cos x = k π/2 + r with π/2 in three parts, Taylor polynomials on |r| ≤ π/4
//   power   exp(y log x) for x > 0: the relative error grows with |y log x|
//
// Errors against long double (tests/plant/elementary_test.cpp): exp and log below 1 ulp, sin and cos below
// 1 ulp for |x| ≤ 1e5; beyond 1e6 the argument reduction of sin and cos loses digits gradually.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace shiftrig::plant {

inline constexpr double pi = 3.14159265358979323846;

namespace detail {

// 2^k for −1022 ≤ k ≤ 1023.
inline double power_of_two(std::int64_t k) noexcept {
    return std::bit_cast<double>(static_cast<std::uint64_t>(k + 1023) << 52);
}

// Nearest integer of |x| < 2^51, ties to even.
inline constexpr double nearest_shift = 0x1.8p52;
inline double nearest(double x) noexcept {
    return (x + nearest_shift) - nearest_shift;
}

// e^x / 2^k for k = nearest(x / ln 2), of a number or of a register of them.
inline constexpr double exp_inverse_ln2 = 0x1.71547652b82fep0;
template <typename Number>
inline Number exp_remainder(const Number& x, const Number& k) noexcept {
    constexpr double ln2_high = 0x1.62e42fefa38p-1;   // 41 bits: k·ln2_high is exact for |k| < 2^11
    constexpr double ln2_low = 0x1.ef35793c7673p-45;  // the next 53
    const Number high = x - k * ln2_high;
    const Number low = k * ln2_low;
    const Number r = high - low;
    const Number r2 = r * r, r4 = r2 * r2;
    const Number p0 = (1.0 / 2 + r * (1.0 / 6)) + r2 * (1.0 / 24 + r * (1.0 / 120));
    const Number p1 = (1.0 / 720 + r * (1.0 / 5040)) + r2 * (1.0 / 40320 + r * (1.0 / 362880));
    const Number p2 =
        (1.0 / 3628800 + r * (1.0 / 39916800)) + r2 * (1.0 / 479001600 + r * (1.0 / 6227020800.0));
    const Number p = p0 + r4 * (p1 + r4 * p2);
    return 1.0 + (high - (low - r2 * p));
}

}  // namespace detail

inline double exp(double x) noexcept {
    if (!(x < 709.79)) return x != x ? x : std::numeric_limits<double>::infinity();
    if (x < -745.2) return 0;
    const double k = detail::nearest(x * detail::exp_inverse_ln2);
    const double e = detail::exp_remainder(x, k);
    const auto n = static_cast<std::int64_t>(k);
    if (n >= -1021 && n <= 1022) return e * detail::power_of_two(n);
    const std::int64_t half = n / 2;  // near overflow, or a subnormal result
    return e * detail::power_of_two(half) * detail::power_of_two(n - half);
}

// log(0) = −∞, log of a negative number = NaN.
inline double log(double x) noexcept {
    if (!(x > 0))
        return x == 0 ? -std::numeric_limits<double>::infinity() : std::numeric_limits<double>::quiet_NaN();
    if (x == std::numeric_limits<double>::infinity()) return x;
    double k = 0;
    if (x < 0x1p-1022) {
        x *= 0x1p54;
        k = -54;
    }
    auto bits = std::bit_cast<std::uint64_t>(x);
    k += static_cast<double>(static_cast<std::int64_t>(bits >> 52) - 1023);
    bits = (bits & 0x000fffffffffffffull) | 0x3ff0000000000000ull;
    double m = std::bit_cast<double>(bits);  // [1, 2)
    if (m > 1.41421356237309504880) {
        m *= 0.5;
        k += 1;
    }
    constexpr double ln2_high = 0x1.62e42fefa38p-1;
    constexpr double ln2_low = 0x1.ef35793c7673p-45;
    const double f = m - 1;  // exact
    const double s = f / (2 + f);
    const double z = s * s;
    const double rest =
        z * (2.0 / 3 +
             z * (2.0 / 5 +
                  z * (2.0 / 7 +
                       z * (2.0 / 9 +
                            z * (2.0 / 11 +
                                 z * (2.0 / 13 +
                                      z * (2.0 / 15 +
                                           z * (2.0 / 17 +
                                                z * (2.0 / 19 + z * (2.0 / 21 + z * (2.0 / 23)))))))))));
    // 2 artanh s = f − f²/2 + s (f²/2 + rest): the large term f is exact.
    const double half_square = 0.5 * f * f;
    return k * ln2_high + (f - (half_square - (s * (half_square + rest) + k * ln2_low)));
}

// x^y for x > 0.
inline double power(double x, double y) noexcept {
    return exp(y * log(x));
}

namespace detail {

struct QuarterTurns {
    double r;        // |r| ≤ π/4 (and a little)
    double tail;     // what rounding r lost
    std::int64_t k;  // x = k π/2 + r + tail
};

inline QuarterTurns quarter_turns(double x) noexcept {
    constexpr double part1 = 0x1.921fb544p0;  // π/2 in three parts of 33, 33 and 53 bits
    constexpr double part2 = 0x1.0b4611a6p-34;
    constexpr double part3 = 0x1.3198a2e037073p-69;
    const double k = nearest(x * 0x1.45f306dc9c883p-1);
    const double a = x - k * part1;
    const double b = k * part2;
    const double r1 = a - b;
    const double lost = (a - r1) - b;
    const double tail = lost - k * part3;
    const double r = r1 + tail;
    return {r, (r1 - r) + tail, static_cast<std::int64_t>(k)};
}

inline double sine_polynomial(double r, double tail) noexcept {
    const double z = r * r;
    const double p =
        -1.0 / 6 +
        z * (1.0 / 120 +
             z * (-1.0 / 5040 +
                  z * (1.0 / 362880 + z * (-1.0 / 39916800 +
                                           z * (1.0 / 6227020800.0 + z * (-1.0 / 1307674368000.0 +
                                                                          z * (1.0 / 355687428096000.0)))))));
    return r + (tail * (1 - 0.5 * z) + r * z * p);
}

inline double cosine_polynomial(double r, double tail) noexcept {
    const double z = r * r;
    const double p =
        1.0 / 24 +
        z * (-1.0 / 720 +
             z * (1.0 / 40320 +
                  z * (-1.0 / 3628800 +
                       z * (1.0 / 479001600.0 + z * (-1.0 / 87178291200.0 + z * (1.0 / 20922789888000.0))))));
    const double h = 0.5 * z;
    const double w = 1 - h;
    return w + (((1 - w) - h) + (z * z * p - r * tail));
}

}  // namespace detail

inline double sin(double x) noexcept {
    if (!(std::fabs(x) < 1e15)) return std::numeric_limits<double>::quiet_NaN();
    const detail::QuarterTurns q = detail::quarter_turns(x);
    const double value =
        (q.k & 1) ? detail::cosine_polynomial(q.r, q.tail) : detail::sine_polynomial(q.r, q.tail);
    return (q.k & 2) ? -value : value;
}

inline double cos(double x) noexcept {
    if (!(std::fabs(x) < 1e15)) return std::numeric_limits<double>::quiet_NaN();
    const detail::QuarterTurns q = detail::quarter_turns(x);
    const double value =
        (q.k & 1) ? detail::sine_polynomial(q.r, q.tail) : detail::cosine_polynomial(q.r, q.tail);
    return ((q.k + 1) & 2) ? -value : value;
}

}  // namespace shiftrig::plant
