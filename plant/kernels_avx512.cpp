// Compiled with -mavx512f -mavx512vl and run only where the processor has both.
#include "plant/kernels.h"
#include "plant/math/elementary.h"

#if defined(SHIFTRIG_X86_KERNELS)
#include <immintrin.h>

#include <cstdint>
#include <utility>

namespace shiftrig::plant::detail {
namespace {

struct Eight {
    using Sum = __m512d;
    static constexpr int height = 8;
    __m512d s0 = _mm512_setzero_pd(), s1 = s0, s2 = s0, s3 = s0;

    static void add(__m512d& sum, const double* p, const double* v) noexcept {
        sum = _mm512_fmadd_pd(_mm512_loadu_pd(p), _mm512_set1_pd(*v), sum);
    }
    static void put(const Sum& sum, double* y) noexcept { _mm512_storeu_pd(y, sum); }
    void store(const double* y0, double* y) const noexcept {
        __m512d total = _mm512_add_pd(_mm512_add_pd(s0, s1), _mm512_add_pd(s2, s3));
        if (y0) total = _mm512_add_pd(_mm512_loadu_pd(y0), total);
        _mm512_storeu_pd(y, total);
    }
};

struct Four {
    static constexpr int height = 4;
    __m256d s0 = _mm256_setzero_pd(), s1 = s0, s2 = s0, s3 = s0;

    static void add(__m256d& sum, const double* p, const double* v) noexcept {
        sum = _mm256_fmadd_pd(_mm256_loadu_pd(p), _mm256_broadcast_sd(v), sum);
    }
    void store(const double* y0, double* y) const noexcept {
        __m256d total = _mm256_add_pd(_mm256_add_pd(s0, s1), _mm256_add_pd(s2, s3));
        if (y0) total = _mm256_add_pd(_mm256_loadu_pd(y0), total);
        _mm256_storeu_pd(y, total);
    }
};

constexpr int most_panels = 3;
constexpr int block_panels = 3, block_columns = 8;

constexpr int lanes = 8;

#include "plant/lanes_body.h"

inline bool any(const Marks& marks) noexcept {
    const auto bits = reinterpret_cast<__m512i>(marks);
    return _mm512_test_epi64_mask(bits, bits) != 0;
}
template <typename Join>
inline double joined(const Lanes& v, const Join& join) noexcept {
    const auto four =
        join(__builtin_shufflevector(v, v, 0, 1, 2, 3), __builtin_shufflevector(v, v, 4, 5, 6, 7));
    const auto two =
        join(__builtin_shufflevector(four, four, 0, 1), __builtin_shufflevector(four, four, 2, 3));
    return join(two[0], two[1]);
}

#include "plant/algebra_body.h"
#include "plant/device_loops_body.h"
#include "plant/kernels_body.h"

}  // namespace

Kernel avx512_kernel() {
    return kernel_of(KernelKind::avx512, "avx512");
}

}  // namespace shiftrig::plant::detail
#endif
