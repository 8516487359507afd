// Compiled with -mavx2 -mfma and run only where the processor has both.
#include "plant/kernels.h"
#include "plant/math/elementary.h"

#if defined(SHIFTRIG_X86_KERNELS)
#include <immintrin.h>

#include <cstdint>
#include <utility>

namespace shiftrig::plant::detail {
namespace {

inline __m256d total_of(__m256d s0, __m256d s1, __m256d s2, __m256d s3) noexcept {
    return _mm256_add_pd(_mm256_add_pd(s0, s1), _mm256_add_pd(s2, s3));
}

// Two registers: the upper and the lower four rows.
struct Eight {
    struct Sum {
        __m256d upper = _mm256_setzero_pd(), lower = upper;
    };
    static constexpr int height = 8;
    Sum s0, s1, s2, s3;

    static void add(Sum& sum, const double* p, const double* v) noexcept {
        const __m256d x = _mm256_broadcast_sd(v);
        sum.upper = _mm256_fmadd_pd(_mm256_loadu_pd(p), x, sum.upper);
        sum.lower = _mm256_fmadd_pd(_mm256_loadu_pd(p + 4), x, sum.lower);
    }
    static void put(const Sum& sum, double* y) noexcept {
        _mm256_storeu_pd(y, sum.upper);
        _mm256_storeu_pd(y + 4, sum.lower);
    }
    void store(const double* y0, double* y) const noexcept {
        __m256d upper = total_of(s0.upper, s1.upper, s2.upper, s3.upper);
        __m256d lower = total_of(s0.lower, s1.lower, s2.lower, s3.lower);
        if (y0) {
            upper = _mm256_add_pd(_mm256_loadu_pd(y0), upper);
            lower = _mm256_add_pd(_mm256_loadu_pd(y0 + 4), lower);
        }
        _mm256_storeu_pd(y, upper);
        _mm256_storeu_pd(y + 4, lower);
    }
};

struct Four {
    static constexpr int height = 4;
    __m256d s0 = _mm256_setzero_pd(), s1 = s0, s2 = s0, s3 = s0;

    static void add(__m256d& sum, const double* p, const double* v) noexcept {
        sum = _mm256_fmadd_pd(_mm256_loadu_pd(p), _mm256_broadcast_sd(v), sum);
    }
    void store(const double* y0, double* y) const noexcept {
        __m256d total = total_of(s0, s1, s2, s3);
        if (y0) total = _mm256_add_pd(_mm256_loadu_pd(y0), total);
        _mm256_storeu_pd(y, total);
    }
};

constexpr int most_panels = 1;
constexpr int block_panels = 1, block_columns = 6;

constexpr int lanes = 4;

#include "plant/lanes_body.h"

inline bool any(const Marks& marks) noexcept {
    const auto bits = reinterpret_cast<__m256i>(marks);
    return _mm256_testz_si256(bits, bits) == 0;
}
template <typename Join>
inline double joined(const Lanes& v, const Join& join) noexcept {
    const auto two = join(__builtin_shufflevector(v, v, 0, 1), __builtin_shufflevector(v, v, 2, 3));
    return join(two[0], two[1]);
}

#include "plant/algebra_body.h"
#include "plant/device_loops_body.h"
#include "plant/kernels_body.h"

}  // namespace

Kernel avx2_kernel() {
    return kernel_of(KernelKind::avx2, "avx2");
}

}  // namespace shiftrig::plant::detail
#endif
