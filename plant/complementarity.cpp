#include "plant/complementarity.h"

#include <cmath>

namespace shiftrig::plant::detail {
namespace {

constexpr double nothing = 1e-11;  // of numbers of the order of 1: rounding

void pivot(double* tableau, int size, int row, int column) {
    const int columns = lemke_columns(size);
    double* const chosen = tableau + row * columns;
    const double inverse = 1 / chosen[column];
    for (int c = 0; c < columns; ++c) chosen[c] *= inverse;
    chosen[column] = 1;
    for (int r = 0; r < size; ++r) {
        double* const other = tableau + r * columns;
        const double factor = other[column];
        if (r == row || factor == 0) continue;
        for (int c = 0; c < columns; ++c) other[c] -= factor * chosen[c];
        other[column] = 0;
    }
}

// What a tie is to the values of the rows: rates may be large, where loads are shared out by a little give.
double tie_scale(double rate_a, double rate_b) {
    return std::fmax(1, std::fmax(rate_a, rate_b));
}

// Does row a leave before row b, if a variable enters that takes `rate` of each? Ties are broken by what w would
// give (lexicographically), so that no basis comes back.
bool leaves_before(const double* a, double rate_a, const double* b, double rate_b, int size) {
    const int last = lemke_columns(size) - 1;
    const double difference = a[last] / rate_a - b[last] / rate_b;
    if (std::fabs(difference) * tie_scale(rate_a, rate_b) > nothing) return difference < 0;
    for (int c = 0; c < size; ++c) {
        const double by_column = a[c] / rate_a - b[c] / rate_b;
        if (std::fabs(by_column) > nothing) return by_column < 0;
    }
    return false;
}

}  // namespace

bool solve_complementarity(double* tableau, int* basis, int size, int course) SHIFTRIG_REALTIME {
    const int columns = lemke_columns(size), artificial = 2 * size, last = columns - 1;
    const auto lack = [&](int r) {
        const double* const line = tableau + r * columns;
        return line[last] / line[artificial];
    };
    int row = -1;
    for (int r = 0; r < size; ++r) {
        basis[r] = r;
        double* const line = tableau + r * columns;
        // Any positive numbers do: 1, or others without a pattern.
        double whole;
        line[artificial] =
            -(course == 0 ? 1 : 0.1 + std::modf(0.6180339887498949 * course * (r + 1), &whole));
        if (line[last] < 0 && (row < 0 || lack(r) >= lack(row))) row = r;
    }
    if (row < 0) return true;
    int entering = artificial;
    const int most = 3 * size + 16;  // machines at rest need fewer than `size`
    for (int pivots = 0; pivots < most; ++pivots) {
        pivot(tableau, size, row, entering);
        const int leaving = basis[row];
        basis[row] = entering;
        if (leaving == artificial) return true;
        entering = leaving < size ? leaving + size : leaving - size;  // the leaving one's complement
        row = -1;
        for (int r = 0; r < size; ++r) {
            const double* const line = tableau + r * columns;
            const double rate = line[entering];
            if (rate <= nothing) continue;
            const double* const best = row < 0 ? line : tableau + row * columns;
            const bool sooner = row < 0 || leaves_before(line, rate, best, best[entering], size);
            const bool ends =
                basis[r] == artificial && row >= 0 &&
                (line[last] / rate - best[last] / best[entering]) * tie_scale(1, best[entering]) <= nothing;
            const bool kept =
                row >= 0 && basis[row] == artificial &&
                (best[last] / best[entering] - line[last] / rate) * tie_scale(1, rate) <= nothing;
            if ((sooner && !kept) || ends) row = r;
        }
        if (row < 0) return false;
    }
    return false;
}

}  // namespace shiftrig::plant::detail
