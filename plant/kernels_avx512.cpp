// Compiled with -mavx512f and run only where the processor has it.
#include "plant/kernels.h"

#if defined(SHIFTRIG_X86_KERNELS)
#include <immintrin.h>

namespace shiftrig::plant::detail {
namespace {

// `count` row blocks side by side keep enough independent sums in flight.
template <int count>
inline void multiply_blocks(const double* panel, long block_size, int columns, const double* v,
                            const double* y0, double* y) {
    __m512d sum[count][4];
    for (int b = 0; b < count; ++b) {
        for (int way = 0; way < 4; ++way) sum[b][way] = _mm512_setzero_pd();
    }
    int c = 0;
    for (; c + 4 <= columns; c += 4, panel += 4 * panel_rows) {
        for (int way = 0; way < 4; ++way) {
            const __m512d x = _mm512_set1_pd(v[c + way]);
            for (int b = 0; b < count; ++b) {
                const __m512d p = _mm512_loadu_pd(panel + b * block_size + way * panel_rows);
                sum[b][way] = _mm512_fmadd_pd(p, x, sum[b][way]);
            }
        }
    }
    for (int way = 0; way < 3; ++way) {
        if (c + way >= columns) break;
        const __m512d x = _mm512_set1_pd(v[c + way]);
        for (int b = 0; b < count; ++b) {
            const __m512d p = _mm512_loadu_pd(panel + b * block_size + way * panel_rows);
            sum[b][way] = _mm512_fmadd_pd(p, x, sum[b][way]);
        }
    }
    for (int b = 0; b < count; ++b) {
        __m512d total = _mm512_add_pd(_mm512_add_pd(sum[b][0], sum[b][1]), _mm512_add_pd(sum[b][2], sum[b][3]));
        if (y0) total = _mm512_add_pd(_mm512_loadu_pd(y0 + b * panel_rows), total);
        _mm512_storeu_pd(y + b * panel_rows, total);
    }
}

}  // namespace

void multiply_avx512(const double* panel, int blocks, int columns, const double* v, const double* y0,
                     double* y) SHIFTRIG_REALTIME {
    const long block_size = static_cast<long>(columns) * panel_rows;
    int b = 0;
    for (; b + 2 <= blocks; b += 2) {
        multiply_blocks<2>(panel + b * block_size, block_size, columns, v, y0 ? y0 + b * panel_rows : nullptr,
                           y + b * panel_rows);
    }
    if (b < blocks) {
        multiply_blocks<1>(panel + b * block_size, block_size, columns, v, y0 ? y0 + b * panel_rows : nullptr,
                           y + b * panel_rows);
    }
}

}  // namespace shiftrig::plant::detail
#endif
