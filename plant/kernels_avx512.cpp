// Compiled with -mavx512f -mavx512vl and run only where the processor has both.
#include "plant/kernels.h"

#if defined(SHIFTRIG_X86_KERNELS)
#include <immintrin.h>

namespace shiftrig::plant::detail {
namespace {

// `count` panels of eight rows and, with `tail`, the panel of four behind them: enough independent sums to
// keep the multipliers busy. The sums are those of every other kernel.
template <int count, bool tail>
inline void multiply_panels(const double* p, int columns, const double* v, const double* y0, double* y) {
    const long size = static_cast<long>(columns) * panel_rows;
    const double* last = p + count * size;
    __m512d sum[count > 0 ? count : 1][4];
    __m256d rest[4];
    for (int way = 0; way < 4; ++way) {
        for (int b = 0; b < count; ++b) sum[b][way] = _mm512_setzero_pd();
        if (tail) rest[way] = _mm256_setzero_pd();
    }
    const auto add = [&](int c, int way) {
        const __m512d x = _mm512_set1_pd(v[c]);
        for (int b = 0; b < count; ++b) {
            sum[b][way] = _mm512_fmadd_pd(_mm512_loadu_pd(p + b * size + c * panel_rows), x, sum[b][way]);
        }
        if (tail) rest[way] = _mm256_fmadd_pd(_mm256_loadu_pd(last + c * 4), _mm256_set1_pd(v[c]), rest[way]);
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
        __m512d total = _mm512_add_pd(_mm512_add_pd(sum[b][0], sum[b][1]), _mm512_add_pd(sum[b][2], sum[b][3]));
        if (y0) total = _mm512_add_pd(_mm512_loadu_pd(y0 + b * panel_rows), total);
        _mm512_storeu_pd(y + b * panel_rows, total);
    }
    if (tail) {
        __m256d total = _mm256_add_pd(_mm256_add_pd(rest[0], rest[1]), _mm256_add_pd(rest[2], rest[3]));
        if (y0) total = _mm256_add_pd(_mm256_loadu_pd(y0 + count * panel_rows), total);
        _mm256_storeu_pd(y + count * panel_rows, total);
    }
}

}  // namespace

SHIFTRIG_TRUSTED_BEGIN  // the compiler cannot see through a function handed on
void multiply_avx512(const double* panel, int rows, int columns, const double* v, const double* y0,
                     double* y) SHIFTRIG_REALTIME {
    int r = 0;
    const auto at = [&](auto&& product) { product(panel + r * columns, columns, v, y0 ? y0 + r : nullptr, y + r); };
    for (; r + 24 <= rows; r += 2 * panel_rows) at(multiply_panels<2, false>);
    switch (rows - r) {
        case 20: return at(multiply_panels<2, true>);
        case 16: return at(multiply_panels<2, false>);
        case 12: return at(multiply_panels<1, true>);
        case 8: return at(multiply_panels<1, false>);
        case 4: return at(multiply_panels<0, true>);
        default: return;
    }
}
SHIFTRIG_TRUSTED_END

}  // namespace shiftrig::plant::detail
#endif
