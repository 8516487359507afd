// The little dense algebra that building a mode needs: column-major, no allocation, fixed order of
// operations so that bits do not depend on who calls.
#pragma once

#include <cmath>
#include <utility>

#include "plant/realtime.h"

namespace shiftrig::plant::detail {

inline double dot(const double* a, const double* b, int n) SHIFTRIG_REALTIME {
    double sum = 0;
    for (int i = 0; i < n; ++i) sum += a[i] * b[i];
    return sum;
}

inline void add_scaled(double* y, double factor, const double* x, int n) SHIFTRIG_REALTIME {
    for (int i = 0; i < n; ++i) y[i] += factor * x[i];
}

// Solves A X = B in place of B by Gaussian elimination with partial pivoting; A is destroyed. A pivot of
// zero leaves its unknowns zero instead of dividing.
inline void solve(double* a, int n, double* b, int columns) SHIFTRIG_REALTIME {
    for (int k = 0; k < n; ++k) {
        int pivot = k;
        for (int i = k + 1; i < n; ++i) {
            if (std::fabs(a[k * n + i]) > std::fabs(a[k * n + pivot])) pivot = i;
        }
        if (pivot != k) {
            for (int j = 0; j < n; ++j) std::swap(a[j * n + k], a[j * n + pivot]);
            for (int j = 0; j < columns; ++j) std::swap(b[j * n + k], b[j * n + pivot]);
        }
        const double diagonal = a[k * n + k];
        if (diagonal == 0) continue;
        for (int i = k + 1; i < n; ++i) {
            const double factor = a[k * n + i] / diagonal;
            if (factor == 0) continue;
            a[k * n + i] = 0;
            for (int j = k + 1; j < n; ++j) a[j * n + i] -= factor * a[j * n + k];
            for (int j = 0; j < columns; ++j) b[j * n + i] -= factor * b[j * n + k];
        }
    }
    for (int j = 0; j < columns; ++j) {
        double* x = b + j * n;
        for (int k = n - 1; k >= 0; --k) {
            const double diagonal = a[k * n + k];
            x[k] = diagonal == 0 ? 0 : x[k] / diagonal;
            for (int i = 0; i < k; ++i) x[i] -= a[k * n + i] * x[k];
        }
    }
}

}  // namespace shiftrig::plant::detail
