// Exponential operators of one mode for a step of length h, after [Cox]:
//
//   P = e^(hL),  Q_k = h φ_k(hL) S̃,  φ_0 = e^Z,  φ_(k+1) = (φ_k − I/k!)/Z
//
// by scaling and squaring: Z = (h/2) L / 2^s small, φ_3 by its Taylor series, the others from it, then
// s doublings to h/2 (P_h, Q_h) and one more to h. All in the coordinates q of the mode, scaled with the roots of
// their energies (reduced inertia, stiffness), so that ‖hL‖ is about h ω_max: stiff shafts on light masses would
// otherwise cost needless doublings.
#include <algorithm>
#include <cmath>
#include <utility>

#include "plant/dense.h"
#include "plant/modes.h"

namespace shiftrig::plant::detail {
namespace {

constexpr int taylor_degree = 11;

// Square matrices of one size and their products through the model's kernel.
struct Algebra {
    const Kernel& kernel;
    int n;           // rows and columns
    int stride;      // padded rows
    double* panels;  // stride × stride

    int size() const noexcept { return stride * n; }
    // c (columns wide) = a b
    void multiply(const double* a, const double* b, int columns, double* c) const {
        to_panels(a, n, n, panels);
        for (int j = 0; j < columns; ++j) {
            kernel.multiply(panels, stride, n, b + j * stride, nullptr, c + j * stride);
        }
    }
    void add_identity(double* a, double factor) const {
        for (int j = 0; j < n; ++j) a[j * stride + j] += factor;
    }
};

double norm1(const double* a, int n, int stride) {
    double norm = 0;
    for (int j = 0; j < n; ++j) {
        double sum = 0;
        for (int i = 0; i < n; ++i) sum += std::fabs(a[j * stride + i]);
        norm = std::max(norm, sum);
    }
    return norm;
}

}  // namespace

StepOperators build_step_operators(const ModelData& m, const Mode& mode, double length, double* memory,
                                   double* workspace) SHIFTRIG_REALTIME {
    const int n = mode.order, stride = padded(n), size = stride * n, columns = n + m.forces;
    StepOperators operators;
    operators.length = length;
    operators.from_begin = memory;
    operators.from_half = operators.from_begin + whole_panels(3 * stride * columns);
    operators.from_late = operators.from_half + whole_panels(2 * stride * m.forces);
    operators.middle = operators.from_late + whole_panels(stride * m.forces);

    double* next = workspace;
    const auto take = [&](int doubles) { return std::exchange(next, next + doubles); };
    const Algebra algebra{m.kernel, n, stride, take(stride * stride)};
    double* z = take(size);
    double* z2 = take(size);
    double* z3 = take(size);
    double* z4 = take(size);
    double* phi = take(4 * size);  // φ_0, φ_1, φ_2, φ_3 side by side
    double* product = take(4 * size + stride * m.forces);
    double *phi0 = phi, *phi1 = phi + size, *phi2 = phi + 2 * size, *phi3 = phi + 3 * size;
    double* sigma = take(2 * stride);
    double* force = take(stride * m.forces);  // Σ S̃

    // L and S̃ in energy variables.
    for (int i = 0; i < n; ++i) {
        double energy = 0;
        for (int j = 0; j < m.masses; ++j) {
            const double ratio = mode.view[panel_index(padded(m.seen), n, m.power_rows + j, i)];
            energy += m.structure.inertia[static_cast<std::size_t>(j)] * ratio * ratio;
        }
        const int twist = mode.coordinates[i] - m.masses;
        sigma[i] =
            std::sqrt(twist < 0 ? energy : m.structure.shafts[static_cast<std::size_t>(twist)].stiffness);
    }
    const auto rate = [&](int i, int c) {  // [L S̃](i, c)
        return mode.rates[panel_index(m.states_padded, columns, mode.coordinates[i], c)];
    };
    std::fill(z, z + size, 0.);
    std::fill(force, force + stride * m.forces, 0.);
    for (int j = 0; j < n; ++j) {
        for (int i = 0; i < n; ++i) z[j * stride + i] = 0.5 * length * rate(i, j) * sigma[i] / sigma[j];
    }
    for (int k = 0; k < m.forces; ++k) {
        for (int i = 0; i < n; ++i) force[k * stride + i] = rate(i, n + k) * sigma[i];
    }
    double scale = 1;
    for (double norm = norm1(z, n, stride); norm * scale > 0.5 && operators.halvings < 60;
         ++operators.halvings)
        scale *= 0.5;
    for (int i = 0; i < size; ++i) z[i] *= scale;

    // φ_3 = Σ Z^k/(k + 3)! in three groups of four powers.
    double coefficient[taylor_degree + 1];
    coefficient[0] = 1. / 6;
    for (int k = 1; k <= taylor_degree; ++k) coefficient[k] = coefficient[k - 1] / (k + 3);
    algebra.multiply(z, z, n, z2);
    algebra.multiply(z2, z, n, z3);
    algebra.multiply(z2, z2, n, z4);
    const auto group = [&](int k, double* sum) {  // sum += c_k + c_(k+1) Z + c_(k+2) Z² + c_(k+3) Z³
        for (int i = 0; i < size; ++i) {
            sum[i] += coefficient[k + 1] * z[i] + coefficient[k + 2] * z2[i] + coefficient[k + 3] * z3[i];
        }
        algebra.add_identity(sum, coefficient[k]);
    };
    std::fill(product, product + size, 0.);
    group(8, product);
    algebra.multiply(z4, product, n, phi3);
    group(4, phi3);
    algebra.multiply(z4, phi3, n, product);
    group(0, product);
    std::copy(product, product + size, phi3);
    algebra.multiply(z, phi3, n, phi2);
    algebra.add_identity(phi2, 0.5);
    algebra.multiply(z, phi2, n, phi1);
    algebra.add_identity(phi1, 1);
    algebra.multiply(z, phi1, n, phi0);
    algebra.add_identity(phi0, 1);

    const auto double_step = [&] {
        algebra.multiply(phi0, phi, 4 * n, product);
        for (int i = 0; i < size; ++i) {
            phi3[i] = (product[3 * size + i] + phi3[i] + phi2[i] + 0.5 * phi1[i]) / 8;
            phi2[i] = (product[2 * size + i] + phi2[i] + phi1[i]) / 4;
            phi1[i] = (product[size + i] + phi1[i]) / 2;
            phi0[i] = product[i];
        }
    };
    // Writes one column of a block back in physical variables.
    const auto put = [&](double* panels, int blocks, int block, int width, int c, const double* scaled,
                         double factor) {
        constexpr int four = 4;  // rows that lie side by side in any panel; blocks are whole fours
        for (int first = 0; first < stride; first += four) {
            double* const at = panels + panel_index(blocks * stride, width, block * stride + first, c);
            for (int i = first; i < first + four; ++i)
                at[i - first] = i < n ? factor * scaled[i] / sigma[i] : 0;
        }
    };
    const auto put_transition = [&](int block) {
        for (int j = 0; j < n; ++j)
            put(operators.from_begin, 3, block, columns, j, phi0 + j * stride, sigma[j]);
    };

    for (int k = 0; k < operators.halvings; ++k) double_step();
    put_transition(0);
    algebra.multiply(phi1, force, m.forces, product);
    for (int k = 0; k < m.forces; ++k) {
        put(operators.from_begin, 3, 0, columns, n + k, product + k * stride, 0.5 * length);
    }
    double* q1 = take(stride * m.forces);
    double* q2 = take(stride * m.forces);
    double* q3 = take(stride * m.forces);
    double* sum = sigma + stride;
    algebra.multiply(phi2, force, m.forces, q2);
    algebra.multiply(phi3, force, m.forces, q3);
    for (int k = 0; k < m.forces; ++k) {
        const double *b = q2 + k * stride, *c = q3 + k * stride;
        for (int i = 0; i < n; ++i) sum[i] = 2 * b[i] - 2 * c[i];
        put(operators.middle, 1, 0, 2 * m.forces, k, sum, 0.5 * length);
        for (int i = 0; i < n; ++i) sum[i] = c[i] - 0.5 * b[i];
        put(operators.middle, 1, 0, 2 * m.forces, m.forces + k, sum, 0.5 * length);
    }

    double_step();
    put_transition(1);
    put_transition(2);
    algebra.multiply(phi1, force, m.forces, q1);
    algebra.multiply(phi2, force, m.forces, q2);
    algebra.multiply(phi3, force, m.forces, q3);
    for (int k = 0; k < m.forces; ++k) {
        const double *a = q1 + k * stride, *b = q2 + k * stride, *c = q3 + k * stride;
        put(operators.from_begin, 3, 1, columns, n + k, a, -length);
        put(operators.from_half, 2, 0, m.forces, k, a, 2 * length);
        for (int i = 0; i < n; ++i) sum[i] = a[i] - 3 * b[i] + 4 * c[i];
        put(operators.from_begin, 3, 2, columns, n + k, sum, length);
        for (int i = 0; i < n; ++i) sum[i] = 4 * b[i] - 8 * c[i];
        put(operators.from_half, 2, 1, m.forces, k, sum, length);
        for (int i = 0; i < n; ++i) sum[i] = 4 * c[i] - b[i];
        put(operators.from_late, 1, 0, m.forces, k, sum, length);
    }
    for (int i = 0; i < n; ++i) {
        if (mode.coordinates[i] >= m.masses) continue;
        double reach = 0;
        for (int k = 0; k < m.forces; ++k)
            reach += std::fabs(operators.from_late[panel_index(stride, m.forces, i, k)]);
        operators.late_reach = std::max(operators.late_reach, reach);
    }
    return operators;
}

}  // namespace shiftrig::plant::detail
