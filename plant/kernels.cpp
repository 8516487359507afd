#include "plant/kernels.h"

#include <cstdint>
#include <type_traits>

#include "plant/math/elementary.h"

namespace shiftrig::plant::detail {
namespace {

template <int height>
void multiply_panel(const double* p, int columns, const double* v, const double* y0, double* y) {
    double sum[4][height] = {};
    int c = 0;
    for (; c + 4 <= columns; c += 4) {
        for (int way = 0; way < 4; ++way) {
            for (int r = 0; r < height; ++r) sum[way][r] += p[(c + way) * height + r] * v[c + way];
        }
    }
    for (int way = 0; c < columns; ++c, ++way) {
        for (int r = 0; r < height; ++r) sum[way][r] += p[c * height + r] * v[c];
    }
    for (int r = 0; r < height; ++r) {
        const double total = (sum[0][r] + sum[1][r]) + (sum[2][r] + sum[3][r]);
        y[r] = y0 ? y0[r] + total : total;
    }
}

void multiply_portable(const double* panel, int rows, int columns, const double* v, const double* y0,
                       double* y) SHIFTRIG_REALTIME {
    int r = 0;
    for (; r + panel_rows <= rows; r += panel_rows) {
        multiply_panel<panel_rows>(panel + r * columns, columns, v, y0 ? y0 + r : nullptr, y + r);
    }
    if (r < rows) multiply_panel<4>(panel + r * columns, columns, v, y0 ? y0 + r : nullptr, y + r);
}

void multiply_each_portable(const double* panel, int rows, int columns, const double* v, int count,
                            double* y) SHIFTRIG_REALTIME {
    for (; count > 0; --count, v += rows, y += rows) multiply_portable(panel, rows, columns, v, nullptr, y);
}

constexpr int lanes = 2;

#include "plant/lanes_body.h"

inline bool any(const Marks& marks) noexcept {
    return (marks[0] | marks[1]) != 0;
}
template <typename Join>
inline double joined(const Lanes& v, const Join& join) noexcept {
    return join(v[0], v[1]);
}

#include "plant/algebra_body.h"
#include "plant/device_loops_body.h"

}  // namespace

Kernel portable_kernel() {
    Kernel kernel{KernelKind::portable,   "portable", {}, {}, multiply_each_portable, device_loops,
                  {combine, place, sweep}};
    for (Multiply& product : kernel.products) product = multiply_portable;
    for (MultiplyEach& products : kernel.multiples) products = multiply_each_portable;
    return kernel;
}

void to_panels(const double* matrix, int rows, int columns, double* panel) SHIFTRIG_REALTIME {
    const int stride = padded(rows), whole = stride / panel_rows * panel_rows;
    const auto copy = [&](int first, auto height) {
        const double* from = matrix + first;
        for (int c = 0; c < columns; ++c, from += stride, panel += height) {
            for (int r = 0; r < height; ++r) panel[r] = from[r];
        }
    };
    for (int first = 0; first < whole; first += panel_rows)
        copy(first, std::integral_constant<int, panel_rows>{});
    if (whole < stride) copy(whole, std::integral_constant<int, 4>{});
}

Kernel choose_kernel(KernelKind kind) {
#if defined(SHIFTRIG_X86_KERNELS)
    const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    const bool avx512 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl");
    if (avx512 && (kind == KernelKind::avx512 || kind == KernelKind::automatic)) {
        return avx512_kernel();
    }
    if (avx2 && (kind == KernelKind::avx2 || kind == KernelKind::automatic)) {
        return avx2_kernel();
    }
#endif
    if (kind == KernelKind::avx2 || kind == KernelKind::avx512) {
        throw ModelError("kernel", kind == KernelKind::avx2 ? "avx2" : "avx512", "",
                         "is not offered by this processor");
    }
    return portable_kernel();
}

}  // namespace shiftrig::plant::detail
