// e^Z and φ_k(Z) S̃ for the rates of a large machine, whose L is almost empty: a shaft turns and is turned by what is rigid
// with its two ends, and by nothing else. Their Taylor sums by Horner's rule,
//
//   e^Z = I + Z (I + Z/2 (I + Z/3 (…))),   3! φ_3(Z) S̃ = S̃ + Z/4 (S̃ + Z/5 (…)),   φ_k = Z φ_(k+1) + I/k!,
//
// then cost a few numbers of L per row, degree and column, where a product of matrices costs a whole row; so the sum goes far
// enough for ‖Z‖ = 2, and two halvings less have to be undone by products. Columns are taken in stripes of sixteen, which
// the first-level cache holds. Of a stripe only the rows are worked on that its columns have reached so far.
#pragma once

#include "plant/kernels.h"

namespace shiftrig::plant::detail {

// A square matrix by what in it is not zero: by rows, and the pattern by columns. None: no such form.
struct SparseRates {
    static constexpr int smallest = 24, fullest = 16;  // rows that pay; entries per row, on average
    int rows = 0, entries = 0;
    int* row_begin = nullptr;     // rows + 1
    int* column = nullptr;        // per entry, row by row
    double* value = nullptr;      // per entry, row by row
    int* column_begin = nullptr;  // rows + 1
    int* row = nullptr;           // per entry, column by column

    static constexpr int most_entries(int rows) noexcept { return rows < smallest ? 0 : fullest * rows; }
    static constexpr int integers(int rows) noexcept {
        return rows < smallest ? 0 : 2 * (rows + 1) + 2 * most_entries(rows);
    }
};

// From a matrix of as many columns with `stride` rows each, into the memory of `sparse`.
void list_entries(const double* matrix, int rows, int stride, SparseRates& sparse) SHIFTRIG_REALTIME;

// Beyond this norm of Z its exponential takes halvings.
constexpr double largest_sparse_norm = 2;

int sparse_workspace_doubles(int rows) noexcept;
int sparse_workspace_integers(int rows) noexcept;

// e^Z, and φ_1 S̃, φ_2 S̃, φ_3 S̃ side by side, of Z = scale·L with ‖Z‖₁ ≤ norm; S̃ and what is made have `stride` rows.
void sparse_exponential(const Kernel& kernel, const SparseRates& rates, double scale, double norm,
                        const double* forces, int force_count, int stride, double* exponential,
                        double* acting, double* workspace, int* integers) SHIFTRIG_REALTIME;

}  // namespace shiftrig::plant::detail
