#include "plant/sparse_exponential.h"

#include <algorithm>

namespace shiftrig::plant::detail {
namespace {

constexpr int width = stripe_width;
constexpr int most_degrees = 40;

// The least degree d at which the rest of the sum, below norm^(d+1)/(d+1)!, is no more than rounding.
int degree_for(double norm) {
    double rest = 1;
    for (int d = 0; d < most_degrees; ++d) {
        rest *= norm / (d + 1);
        if (rest < 1e-17) return std::max(d, 1);
    }
    return most_degrees;
}

// Which rows a stripe has reached after so many products with Z, in the order in which it reaches them.
struct Reach {
    int* order;   // rows
    int* counts;  // per number of products
    int* marks;   // rows
    int count = 0;

    void begin(int rows) {
        std::fill(marks, marks + rows, 0);
        count = 0;
    }
    void add(int row) {
        if (marks[row]) return;
        marks[row] = 1;
        order[count++] = row;
    }
    void spread(const SparseRates& rates, int products) {
        counts[0] = count;
        for (int k = 1, from = 0; k <= products; ++k) {
            const int to = count;
            for (int i = from; i < to; ++i) {
                const int c = order[i];
                for (int e = rates.column_begin[c]; e < rates.column_begin[c + 1]; ++e) add(rates.row[e]);
            }
            from = to;
            counts[k] = count;
        }
    }
};

struct Stripes {
    const Kernel& kernel;
    const SparseRates& rates;
    double scale;
    int degree;
    double *start, *one, *two;
    Reach reach;

    // factor·Z·from + share·start into `to`, in the rows reached by so many products
    void sweep(int products, double factor, double share, const double* from, double* to) const {
        kernel.algebra.sweep({.row_begin = rates.row_begin,
                              .column = rates.column,
                              .value = rates.value,
                              .order = reach.order,
                              .count = reach.counts[products],
                              .factor = factor * scale,
                              .share = share},
                             from, start, to);
    }
    // The sum of that degree whose last term is divided by degree + offset, and the memory that is then free.
    double* sum(int offset, double*& free) {
        std::copy(start, start + rates.rows * width, one);
        std::fill(two, two + rates.rows * width, 0.);
        double *from = one, *to = two;
        for (int k = degree; k > 0; --k) {
            sweep(degree - k + 1, 1. / (k + offset), 1, from, to);
            std::swap(from, to);
        }
        free = to;
        return from;
    }
    // So many columns of a stripe into a matrix, times the factor.
    void store(const double* stripe, int columns, double factor, int stride, double* matrix) const {
        for (int c = 0; c < columns; ++c) {
            double* const column = matrix + c * stride;
            for (int i = 0; i < rates.rows; ++i) column[i] = factor * stripe[i * width + c];
            for (int i = rates.rows; i < stride; ++i) column[i] = 0;
        }
    }
};

}  // namespace

void list_entries(const double* matrix, int rows, int stride, SparseRates& sparse) SHIFTRIG_REALTIME {
    sparse.rows = rows;
    sparse.entries = 0;
    if (rows < SparseRates::smallest) return;
    const int most = SparseRates::most_entries(rows);
    int* const begin = sparse.row_begin;
    std::fill(begin, begin + rows + 1, 0);
    int count = 0;
    for (int c = 0; c < rows; ++c) {
        sparse.column_begin[c] = count;
        for (int i = 0; i < rows; ++i) {
            if (matrix[c * stride + i] == 0) continue;
            if (count == most) return;
            sparse.row[count++] = i;
            ++begin[i + 1];
        }
    }
    sparse.column_begin[rows] = sparse.entries = count;
    for (int i = 0; i < rows; ++i) begin[i + 1] += begin[i];
    // begin[i] runs through its row, to where the next one begins; shifted back afterwards.
    for (int c = 0; c < rows; ++c) {
        for (int e = sparse.column_begin[c]; e < sparse.column_begin[c + 1]; ++e) {
            const int to = begin[sparse.row[e]]++;
            sparse.column[to] = c;
            sparse.value[to] = matrix[c * stride + sparse.row[e]];
        }
    }
    for (int i = rows; i > 0; --i) begin[i] = begin[i - 1];
    begin[0] = 0;
}

int sparse_workspace_doubles(int rows) noexcept {
    return rows < SparseRates::smallest ? 0 : 3 * rows * width;
}

int sparse_workspace_integers(int rows) noexcept {
    return rows < SparseRates::smallest ? 0 : 2 * rows + most_degrees + 3;
}

void sparse_exponential(const Kernel& kernel, const SparseRates& rates, double scale, double norm,
                        const double* forces, int force_count, int stride, double* exponential,
                        double* acting, double* workspace, int* integers) SHIFTRIG_REALTIME {
    const int n = rates.rows, size = n * width;
    double* const start = workspace;
    Stripes stripes{kernel,
                    rates,
                    scale,
                    degree_for(norm),
                    start,
                    start + size,
                    start + 2 * size,
                    {integers, integers + 2 * n, integers + n}};
    double* free = nullptr;
    for (int first = 0; first < n; first += width) {
        const int columns = std::min(width, n - first);
        std::fill(start, start + size, 0.);
        stripes.reach.begin(n);
        for (int c = 0; c < columns; ++c) {
            start[(first + c) * width + c] = 1;
            stripes.reach.add(first + c);
        }
        stripes.reach.spread(rates, stripes.degree);
        stripes.store(stripes.sum(0, free), columns, 1, stride, exponential + first * stride);
    }
    for (int first = 0; first < force_count; first += width) {
        const int columns = std::min(width, force_count - first);
        std::fill(start, start + size, 0.);
        stripes.reach.begin(n);
        for (int c = 0; c < columns; ++c) {
            for (int i = 0; i < n; ++i) {
                const double force = forces[(first + c) * stride + i];
                start[i * width + c] = force;
                if (force != 0) stripes.reach.add(i);
            }
        }
        const int last = stripes.degree + 2;
        stripes.reach.spread(rates, last);
        double* const three = stripes.sum(3, free);  // 6 φ_3
        const auto keep = [&](const double* stripe, int k, double factor) {
            stripes.store(stripe, columns, factor, stride, acting + ((k - 1) * force_count + first) * stride);
        };
        keep(three, 3, 1. / 6);
        stripes.sweep(last - 1, 1. / 6, 0.5, three, free);
        keep(free, 2, 1);
        stripes.sweep(last, 1, 1, free, three);
        keep(three, 1, 1);
    }
}

}  // namespace shiftrig::plant::detail
