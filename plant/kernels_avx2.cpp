// Compiled with -mavx2 -mfma and run only where the processor has both.
#include "plant/kernels.h"

#if defined(SHIFTRIG_X86_KERNELS)
#include <immintrin.h>

namespace shiftrig::plant::detail {
namespace {

// `count` registers of four rows side by side, `height` rows from one column to the next.
template <int count, int height>
inline void multiply_rows(const double* p, int columns, const double* v, const double* y0, double* y) {
    __m256d sum[count][4];
    for (int b = 0; b < count; ++b) {
        for (int way = 0; way < 4; ++way) sum[b][way] = _mm256_setzero_pd();
    }
    const auto add = [&](int c, int way) {
        const __m256d x = _mm256_broadcast_sd(v + c);
        for (int b = 0; b < count; ++b) {
            sum[b][way] = _mm256_fmadd_pd(_mm256_loadu_pd(p + c * height + 4 * b), x, sum[b][way]);
        }
    };
    int c = 0;
    for (; c + 4 <= columns; c += 4) {
        add(c, 0);
        add(c + 1, 1);
        add(c + 2, 2);
        add(c + 3, 3);
    }
    if (c < columns) add(c, 0);
    if (c + 1 < columns) add(c + 1, 1);
    if (c + 2 < columns) add(c + 2, 2);
    for (int b = 0; b < count; ++b) {
        __m256d total = _mm256_add_pd(_mm256_add_pd(sum[b][0], sum[b][1]), _mm256_add_pd(sum[b][2], sum[b][3]));
        if (y0) total = _mm256_add_pd(_mm256_loadu_pd(y0 + 4 * b), total);
        _mm256_storeu_pd(y + 4 * b, total);
    }
}

}  // namespace

void multiply_avx2(const double* panel, int rows, int columns, const double* v, const double* y0,
                   double* y) SHIFTRIG_REALTIME {
    int r = 0;
    for (; r + panel_rows <= rows; r += panel_rows) {
        multiply_rows<2, 8>(panel + r * columns, columns, v, y0 ? y0 + r : nullptr, y + r);
    }
    if (r < rows) multiply_rows<1, 4>(panel + r * columns, columns, v, y0 ? y0 + r : nullptr, y + r);
}

}  // namespace shiftrig::plant::detail
#endif
