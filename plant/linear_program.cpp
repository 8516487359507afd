#include "plant/linear_program.h"

#include <algorithm>
#include <cmath>

namespace shiftrig::plant::detail {
namespace {

constexpr double nothing = 1e-11;  // of numbers of the order of 1: rounding

double* row_of(const Program& p, int r) {
    return p.tableau + r * p.columns;
}

void pivot(const Program& p, double* cost, int row, int column) {
    double* const chosen = row_of(p, row);
    const double inverse = 1 / chosen[column];
    for (int c = 0; c < p.columns; ++c) chosen[c] *= inverse;
    chosen[column] = 1;
    const auto clear = [&](double* other) {
        const double factor = other[column];
        if (factor == 0) return;
        for (int c = 0; c < p.columns; ++c) other[c] -= factor * chosen[c];
        other[column] = 0;
    };
    for (int r = 0; r < p.rows; ++r) {
        if (r != row) clear(row_of(p, r));
    }
    clear(cost);
    p.basis[row] = column;
}

// Lets columns of negative cost enter until there is none: the first of them, and of the rows that tie the one of the first
// variable, so that no basis comes back. False: not within a bounded number of pivots.
bool lower_cost(const Program& p, double* cost) {
    const int last = p.columns - 1, most = 8 * (p.rows + 4);
    for (int pivots = 0; pivots < most; ++pivots) {
        int entering = 0;
        while (entering < last && !(p.enters[entering] && cost[entering] < -nothing)) ++entering;
        if (entering == last) return true;
        int row = -1;
        double least = 0;
        for (int r = 0; r < p.rows; ++r) {
            const double* const line = row_of(p, r);
            if (line[entering] <= nothing) continue;
            const double ratio = std::fmax(line[last], 0.) / line[entering];
            if (row >= 0 && (ratio > least || (ratio == least && p.basis[r] > p.basis[row]))) continue;
            row = r;
            least = ratio;
        }
        if (row < 0) return true;  // as large as one likes
        pivot(p, cost, row, entering);
    }
    return false;
}

}  // namespace

bool solve_program(Program& p, int objective) SHIFTRIG_REALTIME {
    const int last = p.columns - 1;
    double cost[most_program_columns] = {};
    // First, what rows without a beginning lack.
    for (int r = 0; r < p.rows; ++r) {
        double* const line = row_of(p, r);
        if (line[last] < 0) {
            for (int c = 0; c < p.columns; ++c) line[c] = -line[c];
            p.basis[r] = -1;
        }
        if (p.basis[r] >= 0) continue;
        for (int c = 0; c < p.columns; ++c) cost[c] -= line[c];
    }
    double size = 1;
    for (int r = 0; r < p.rows; ++r) size = std::fmax(size, row_of(p, r)[last]);
    if (!lower_cost(p, cost) || -cost[last] > 1e-9 * size) return false;
    for (int r = 0; r < p.rows; ++r) {
        if (p.basis[r] >= 0) continue;
        double* const line = row_of(p, r);
        line[last] = 0;
        int column = -1;
        for (int c = 0; c < last; ++c) {
            if (p.enters[c] && std::fabs(line[c]) > (column < 0 ? 1e-9 : std::fabs(line[column]))) column = c;
        }
        if (column >= 0) pivot(p, cost, r, column);
    }
    std::fill(cost, cost + p.columns, 0.);
    cost[objective] = -1;
    for (int r = 0; r < p.rows; ++r) {
        if (p.basis[r] != objective) continue;
        const double* const line = row_of(p, r);
        for (int c = 0; c < p.columns; ++c) cost[c] += line[c];
        cost[objective] = 0;
    }
    return lower_cost(p, cost);
}

}  // namespace shiftrig::plant::detail
