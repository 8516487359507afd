// The product of kernels.h for whatever registers an including file has: that defines `Eight` and `Four`, the running
// sums of a panel of eight and of four rows, then includes this inside its own namespace.
//
// Sums are named s0 … s3 and handed on by value, not counted in an array: the compiler then keeps them in registers from
// the first column to the last. `most_panels` is how many panels' sums its registers hold besides one of four.

// Panels one below the other, summed side by side: enough independent sums to keep the multipliers busy.
template <int... index, typename... Panels>
inline void sum_panels(std::integer_sequence<int, index...>, const double* p, int columns, const double* v,
                       const double* y0, double* y, Panels... sums) noexcept {
    const long size = static_cast<long>(columns) * panel_rows;
    const double* const end = v + columns;
    const double* const whole = v + columns / 4 * 4;
    long at = 0;  // in columns
    for (; v < whole; v += 4, at += 4) {
        (Panels::add(sums.s0, p + index * size + at * Panels::height, v), ...);
        (Panels::add(sums.s1, p + index * size + (at + 1) * Panels::height, v + 1), ...);
        (Panels::add(sums.s2, p + index * size + (at + 2) * Panels::height, v + 2), ...);
        (Panels::add(sums.s3, p + index * size + (at + 3) * Panels::height, v + 3), ...);
    }
    if (v < end) (Panels::add(sums.s0, p + index * size + at * Panels::height, v), ...);
    if (v + 1 < end) (Panels::add(sums.s1, p + index * size + (at + 1) * Panels::height, v + 1), ...);
    if (v + 2 < end) (Panels::add(sums.s2, p + index * size + (at + 2) * Panels::height, v + 2), ...);
    (sums.store(y0 ? y0 + index * panel_rows : nullptr, y + index * panel_rows), ...);
}

template <typename... Panels>
inline void multiply_panels(const double* p, int columns, const double* v, const double* y0,
                            double* y) noexcept {
    sum_panels(std::make_integer_sequence<int, sizeof...(Panels)>{}, p, columns, v, y0, y, Panels{}...);
}

// rows × columns, rows known.
template <int rows>
void product(const double* panel, int, int columns, const double* v, const double* y0,
             double* y) SHIFTRIG_REALTIME {
    constexpr int whole = rows / panel_rows < most_panels ? rows / panel_rows : most_panels;
    constexpr int here = rows < whole * panel_rows + panel_rows ? rows : whole * panel_rows;
    if constexpr (here == 4) multiply_panels<Four>(panel, columns, v, y0, y);
    if constexpr (here == 8) multiply_panels<Eight>(panel, columns, v, y0, y);
    if constexpr (here == 12) multiply_panels<Eight, Four>(panel, columns, v, y0, y);
    if constexpr (here == 16) multiply_panels<Eight, Eight>(panel, columns, v, y0, y);
    if constexpr (here == 20) multiply_panels<Eight, Eight, Four>(panel, columns, v, y0, y);
    if constexpr (here == 24) multiply_panels<Eight, Eight, Eight>(panel, columns, v, y0, y);
    if constexpr (here < rows)
        product<rows - here>(panel + here * columns, 0, columns, v, y0 ? y0 + here : nullptr, y + here);
}

constexpr Multiply parts[] = {product<4>, product<8>, product<12>, product<16>, product<20>, product<24>};

SHIFTRIG_TRUSTED_BEGIN  // the compiler cannot see through a function handed on
    void
    tall_product(const double* panel, int rows, int columns, const double* v, const double* y0,
                 double* y) SHIFTRIG_REALTIME {
    constexpr int most = 4 * short_products;
    int r = 0;
    for (; r + most < rows; r += most)
        product<most>(panel + r * columns, 0, columns, v, y0 ? y0 + r : nullptr, y + r);
    parts[(rows - r) / 4 - 1](panel + r * columns, 0, columns, v, y0 ? y0 + r : nullptr, y + r);
}
SHIFTRIG_TRUSTED_END

template <int rows>
void products(const double* panel, int, int columns, const double* v, int count,
              double* y) SHIFTRIG_REALTIME {
    for (; count > 0; --count, v += rows, y += rows) product<rows>(panel, 0, columns, v, nullptr, y);
}
// All columns by one part of the rows after the other, which the cache then still has.
SHIFTRIG_TRUSTED_BEGIN
void tall_products(const double* panel, int rows, int columns, const double* v, int count,
                   double* y) SHIFTRIG_REALTIME {
    constexpr int most = 4 * short_products;
    for (int r = 0; r < rows; r += most) {
        const int height = rows - r < most ? rows - r : most;
        const Multiply part = parts[height / 4 - 1];
        for (int c = 0; c < count; ++c)
            part(panel + r * columns, height, columns, v + c * rows, nullptr, y + c * rows + r);
    }
}
SHIFTRIG_TRUSTED_END

// Products with many columns: of so many panels below one another and so many columns all sums lie in registers, and what
// is loaded serves several.
template <int panels, int columns>
inline void multiply_block(const double* p, long panel, int depth, const double* v, long stride,
                           double* y) noexcept {
    typename Eight::Sum sum[panels][columns] = {};
    for (int k = 0; k < depth; ++k, p += panel_rows, ++v) {
#pragma GCC unroll 8
        for (int c = 0; c < columns; ++c) {
#pragma GCC unroll 8
            for (int i = 0; i < panels; ++i) Eight::add(sum[i][c], p + i * panel, v + c * stride);
        }
    }
#pragma GCC unroll 8
    for (int c = 0; c < columns; ++c) {
#pragma GCC unroll 8
        for (int i = 0; i < panels; ++i) Eight::put(sum[i][c], y + c * stride + i * panel_rows);
    }
}

// `panels` of them and all columns.
template <int panels>
inline void multiply_blocks(const double* p, int depth, const double* v, int count, long stride,
                            double* y) noexcept {
    const long panel = static_cast<long>(depth) * panel_rows;
    int c = 0;
    for (; c + block_columns <= count; c += block_columns)
        multiply_block<panels, block_columns>(p, panel, depth, v + c * stride, stride, y + c * stride);
    for (; c < count; ++c) multiply_block<panels, 1>(p, panel, depth, v + c * stride, stride, y + c * stride);
}

SHIFTRIG_TRUSTED_BEGIN
void many_products(const double* panel, int rows, int columns, const double* v, int count,
                   double* y) SHIFTRIG_REALTIME {
    constexpr int most = block_panels * panel_rows;
    int r = 0;
    for (; r + most <= rows; r += most)
        multiply_blocks<block_panels>(panel + r * columns, columns, v, count, rows, y + r);
    for (; r + panel_rows <= rows; r += panel_rows)
        multiply_blocks<1>(panel + r * columns, columns, v, count, rows, y + r);
    if (r == rows) return;
    for (int c = 0; c < count; ++c)
        product<4>(panel + r * columns, 4, columns, v + c * rows, nullptr, y + c * rows + r);
}
SHIFTRIG_TRUSTED_END

Kernel kernel_of(KernelKind kind, const char* name) {
    return {kind,
            name,
            {product<4>, product<8>, product<12>, product<16>, product<20>, product<24>, tall_product},
            {products<4>, products<8>, products<12>, products<16>, products<20>, products<24>, tall_products},
            many_products,
            device_loops,
            {combine, place, sweep}};
}
