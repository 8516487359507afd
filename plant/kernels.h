// The one inner loop of a step: a tall product y = y0 + P v with P stored in panels of eight rows (the last one
// of four, if that is enough), so that a panel is a vector register (AVX-512) or two (AVX2). Which implementation runs is chosen when a
// model is built; all sum in the same order, but those with fused multiply-add round once where the
// portable one rounds twice, so bits depend on the kernel.
//
// Columns are dealt to four running sums by c % 4, added at the end as (s0 + s1) + (s2 + s3).
#pragma once

#include <vector>

#include "plant/device_loops.h"
#include "plant/plant.h"

namespace shiftrig::plant::detail {

constexpr int panel_rows = 8;
constexpr int padded(int rows) noexcept {
    return (rows + 3) / 4 * 4;
}
constexpr int whole_panels(int rows) noexcept {
    return (rows + panel_rows - 1) / panel_rows * panel_rows;
}

// Memory of doubles that begins on a cache line: a panel's rows then lie in one line each, and a load of eight does
// not cost two.
struct alignas(64) CacheLine {
    double value[panel_rows];
};
using AlignedDoubles = std::vector<CacheLine>;
inline AlignedDoubles aligned_doubles(std::size_t count) {
    return AlignedDoubles((count + panel_rows - 1) / panel_rows);
}
// Doubles that a panel takes.
constexpr int panel_size(int rows, int columns) noexcept {
    return padded(rows) * columns;
}

// Where element (r, c) of a matrix of `rows` (padded) rows stands.
constexpr int panel_index(int rows, int columns, int r, int c) noexcept {
    const int first = r / panel_rows * panel_rows;
    const int height = rows - first < panel_rows ? rows - first : panel_rows;
    return first * columns + c * height + (r - first);
}

// y[0 … rows) = y0 + P v, rows a multiple of four; y0 = 0 where null. y may be y0, but must not overlap v.
using Multiply = void (*)(const double* panel, int rows, int columns, const double* v, const double* y0,
                          double* y) SHIFTRIG_REALTIME;

// The same of so many columns v, each and its product `rows` doubles behind the one before.
using MultiplyEach = void (*)(const double* panel, int rows, int columns, const double* v, int count,
                              double* y) SHIFTRIG_REALTIME;

// One of up to four that are summed.
struct Term {
    double factor = 0;
    const double* of = nullptr;
};

// Where columns of a block go in a matrix that is stored in panels, and what their rows and columns are multiplied with.
struct Placing {
    int rows = 0, width = 0;  // of the whole matrix
    int top = 0, block_rows = 0;
    int first_column = 0, columns = 0;
    const double* row_scale = nullptr;     // per row of the block
    const double* column_scale = nullptr;  // per column; null: 1
};

// to_i = share·start_i + factor·Σ_j z_ij from_j for the rows `order[0 … count)` of stripes, z by rows (sparse_exponential.h).
constexpr int stripe_width = 16;
struct Sweep {
    const int *row_begin = nullptr, *column = nullptr;
    const double* value = nullptr;
    const int* order = nullptr;
    int count = 0;
    double factor = 0, share = 0;
};

// For building operators.
struct AlgebraLoops {
    // The first `count` numbers of Σ factor · of.
    void (*combine)(const Term* term, int terms, int count, double* sum) SHIFTRIG_REALTIME = nullptr;
    // Of a source with block_rows rows, column after column.
    void (*place)(const Placing& placing, const double* source, double factor,
                  double* panels) SHIFTRIG_REALTIME = nullptr;
    void (*sweep)(const Sweep& sweep, const double* from, const double* start,
                  double* to) SHIFTRIG_REALTIME = nullptr;
};

// One implementation for each of the heights 4, 8, … 24, so that none has to ask, and one for all taller products.
constexpr int short_products = 6;
struct Kernel {
    KernelKind kind{};
    const char* name = "";
    Multiply products[short_products + 1] = {};  // [rows / 4 − 1], the taller ones last
    MultiplyEach multiples[short_products + 1] = {};
    MultiplyEach many = nullptr;  // for large matrices; may sum in another order
    DeviceLoops loops;
    AlgebraLoops algebra;

    void multiply(const double* panel, int rows, int columns, const double* v, const double* y0,
                  double* y) const SHIFTRIG_REALTIME {
        if (rows > 0) products[by_height(rows)](panel, rows, columns, v, y0, y);
    }
    void multiply_each(const double* panel, int rows, int columns, const double* v, int count,
                       double* y) const SHIFTRIG_REALTIME {
        if (rows > 0) multiples[by_height(rows)](panel, rows, columns, v, count, y);
    }

  private:
    static int by_height(int rows) noexcept {
        return (rows < 4 * short_products ? rows : 4 * (short_products + 1)) / 4 - 1;
    }
};

// The best kernel this processor runs for `automatic`, otherwise the one asked for. Throws ModelError if
// the processor or the build lacks it.
Kernel choose_kernel(KernelKind kind);

Kernel portable_kernel();
Kernel avx2_kernel();
Kernel avx512_kernel();

// Column-major matrix (leading dimension padded(rows)) into panels.
void to_panels(const double* matrix, int rows, int columns, double* panel) SHIFTRIG_REALTIME;

}  // namespace shiftrig::plant::detail
