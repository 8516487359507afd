#include "plant/kernels.h"

namespace shiftrig::plant::detail {

void multiply_portable(const double* panel, int blocks, int columns, const double* v, const double* y0,
                       double* y) SHIFTRIG_REALTIME {
    for (int b = 0; b < blocks; ++b) {
        const double* p = panel + static_cast<long>(b) * columns * panel_rows;
        double sum[4][panel_rows] = {};
        int c = 0;
        for (; c + 4 <= columns; c += 4) {
            for (int way = 0; way < 4; ++way) {
                for (int r = 0; r < panel_rows; ++r) sum[way][r] += p[(c + way) * panel_rows + r] * v[c + way];
            }
        }
        for (int way = 0; c < columns; ++c, ++way) {
            for (int r = 0; r < panel_rows; ++r) sum[way][r] += p[c * panel_rows + r] * v[c];
        }
        for (int r = 0; r < panel_rows; ++r) {
            const double total = (sum[0][r] + sum[1][r]) + (sum[2][r] + sum[3][r]);
            y[b * panel_rows + r] = y0 ? y0[b * panel_rows + r] + total : total;
        }
    }
}

void to_panels(const double* matrix, int rows, int columns, double* panel) SHIFTRIG_REALTIME {
    const int stride = padded(rows);
    for (int b = 0; b < stride / panel_rows; ++b) {
        for (int c = 0; c < columns; ++c) {
            const double* from = matrix + c * stride + b * panel_rows;
            for (int r = 0; r < panel_rows; ++r) *panel++ = from[r];
        }
    }
}

Kernel choose_kernel(KernelKind kind) {
    const Kernel portable{KernelKind::portable, "portable", multiply_portable};
#if defined(SHIFTRIG_X86_KERNELS)
    const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    const bool avx512 = __builtin_cpu_supports("avx512f");
    if (avx512 && (kind == KernelKind::avx512 || kind == KernelKind::automatic)) {
        return {KernelKind::avx512, "avx512", multiply_avx512};
    }
    if (avx2 && (kind == KernelKind::avx2 || kind == KernelKind::automatic)) {
        return {KernelKind::avx2, "avx2", multiply_avx2};
    }
#endif
    if (kind == KernelKind::avx2 || kind == KernelKind::avx512) {
        throw ModelError("kernel", kind == KernelKind::avx2 ? "avx2" : "avx512", "",
                         "is not offered by this processor");
    }
    return portable;
}

}  // namespace shiftrig::plant::detail
