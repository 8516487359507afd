// Compiled with -mavx2 -mfma and run only where the processor has both.
#include "plant/kernels.h"

#if defined(SHIFTRIG_X86_KERNELS)
#include <immintrin.h>

namespace shiftrig::plant::detail {

void multiply_avx2(const double* panel, int blocks, int columns, const double* v, const double* y0,
                   double* y) SHIFTRIG_REALTIME {
    for (int b = 0; b < blocks; ++b) {
        const double* p = panel + static_cast<long>(b) * columns * panel_rows;
        __m256d low[4], high[4];
        for (int way = 0; way < 4; ++way) low[way] = high[way] = _mm256_setzero_pd();
        int c = 0;
        for (; c + 4 <= columns; c += 4, p += 4 * panel_rows) {
            for (int way = 0; way < 4; ++way) {
                const __m256d x = _mm256_broadcast_sd(v + c + way);
                low[way] = _mm256_fmadd_pd(_mm256_loadu_pd(p + way * panel_rows), x, low[way]);
                high[way] = _mm256_fmadd_pd(_mm256_loadu_pd(p + way * panel_rows + 4), x, high[way]);
            }
        }
        for (int way = 0; way < 3; ++way) {
            if (c + way >= columns) break;
            const __m256d x = _mm256_broadcast_sd(v + c + way);
            low[way] = _mm256_fmadd_pd(_mm256_loadu_pd(p + way * panel_rows), x, low[way]);
            high[way] = _mm256_fmadd_pd(_mm256_loadu_pd(p + way * panel_rows + 4), x, high[way]);
        }
        __m256d sum_low = _mm256_add_pd(_mm256_add_pd(low[0], low[1]), _mm256_add_pd(low[2], low[3]));
        __m256d sum_high = _mm256_add_pd(_mm256_add_pd(high[0], high[1]), _mm256_add_pd(high[2], high[3]));
        if (y0) {
            sum_low = _mm256_add_pd(_mm256_loadu_pd(y0 + b * panel_rows), sum_low);
            sum_high = _mm256_add_pd(_mm256_loadu_pd(y0 + b * panel_rows + 4), sum_high);
        }
        _mm256_storeu_pd(y + b * panel_rows, sum_low);
        _mm256_storeu_pd(y + b * panel_rows + 4, sum_high);
    }
}

}  // namespace shiftrig::plant::detail
#endif
