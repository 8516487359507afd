// Exponential operators of one mode for a step of length h, after [Cox]:
//
//   P = e^(hL),  Q_k = h φ_k(hL) S̃,  φ_0 = e^Z,  φ_(k+1) = (φ_k − I/k!)/Z
//
// by scaling and squaring: Z = (h/2) L / 2^s small, φ_3 by its Taylor series, the others from it, then
// s doublings to h/2 (P_h, Q_h) and one more to h. All in the coordinates q of the mode, scaled with the roots of
// their energies (reduced inertia, stiffness), so that ‖hL‖ is about h ω_max: stiff shafts on light masses would
// otherwise cost needless doublings. The roots are taken to the next power of two, which rounds nothing: what P leaves as
// it is stays so over 10⁸ steps.
#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <utility>

#include "plant/ledger.h"
#include "plant/modes.h"

namespace shiftrig::plant::detail {
namespace {

constexpr int taylor_degree = 11;

// Square matrices of one size, and their products and sums through the model's kernel. Rows beyond the last are zero.
struct Algebra {
    const Kernel& kernel;
    int n;           // rows and columns
    int stride;      // padded rows
    double* panels;  // stride × stride

    int size() const noexcept { return stride * n; }
    void take(const double* a) const { to_panels(a, n, n, panels); }
    // c (columns wide) = a b, with the matrix a that was taken last
    void times(const double* b, int columns, double* c) const {
        if (n < SparseRates::smallest) {
            kernel.multiply_each(panels, stride, n, b, columns, c);
        } else {
            kernel.many(panels, stride, n, b, columns, c);
        }
    }
    void multiply(const double* a, const double* b, int columns, double* c) const {
        take(a);
        times(b, columns, c);
    }
    void combine(std::initializer_list<Term> terms, int count, double* sum) const {
        kernel.algebra.combine(terms.begin(), static_cast<int>(terms.size()), count, sum);
    }
    void add_identity(double* a, double factor) const {
        for (int j = 0; j < n; ++j) a[j * stride + j] += factor;
    }
};

// φ_0 … φ_3 of Z side by side; `work` is four matrices more.
void sum_series(const Algebra& algebra, const double* z, double* work, double* phi) {
    const int n = algebra.n, size = algebra.size();
    double *const z2 = work, *const z3 = z2 + size, *const z4 = z3 + size, *const product = z4 + size;
    double *const phi0 = phi, *const phi1 = phi0 + size, *const phi2 = phi1 + size, *const phi3 = phi2 + size;

    // φ_3 = Σ Z^k/(k + 3)! in three groups of four powers.
    double coefficient[taylor_degree + 1];
    coefficient[0] = 1. / 6;
    for (int k = 1; k <= taylor_degree; ++k) coefficient[k] = coefficient[k - 1] / (k + 3);
    algebra.multiply(z, z, n, z2);
    algebra.multiply(z2, z, n, z3);
    algebra.multiply(z2, z2, n, z4);
    const auto add_group = [&](const double* c, double* to) {
        algebra.combine({{c[1], z}, {c[2], z2}, {c[3], z3}, {1, to}}, size, to);
        algebra.add_identity(to, c[0]);
    };
    std::fill(product, product + size, 0.);
    add_group(coefficient + 8, product);
    algebra.multiply(z4, product, n, phi2);
    add_group(coefficient + 4, phi2);
    algebra.multiply(z4, phi2, n, phi3);
    add_group(coefficient, phi3);

    const auto below = [&](const double* upper, double at_zero,
                           double* lower) {  // φ_(k−1) = Z φ_k + I/(k − 1)!
        algebra.multiply(z, upper, n, lower);
        algebra.add_identity(lower, at_zero);
    };
    below(phi3, 0.5, phi2);
    below(phi2, 1, phi1);
    below(phi1, 1, phi0);
}

// φ_1, φ_2, φ_3, side by side, from one length to twice that; `made`: φ_0 times each. What all are multiplied with from the
// right does not matter.
void double_length(const Algebra& algebra, const double* made, int count, double* phi) {
    double *const one = phi, *const two = one + count, *const three = two + count;
    algebra.combine({{1. / 8, made + 2 * count}, {1. / 8, three}, {1. / 8, two}, {1. / 16, one}}, count,
                    three);
    algebra.combine({{1. / 4, made + count}, {1. / 4, two}, {1. / 4, one}}, count, two);
    algebra.combine({{1. / 2, made}, {1. / 2, one}}, count, one);
}

}  // namespace

void scale_rates(const ModelData& m, Mode& mode) SHIFTRIG_REALTIME {
    const int n = mode.order, stride = padded(n), columns = n + m.forces;
    double *const root = mode.energy_root, *const inverse = root + stride, *const scaled = mode.scaled_rates;
    std::fill(root, root + 2 * stride, 0.);
    std::fill(scaled, scaled + stride * columns, 0.);
    for (int i = 0; i < n; ++i) {
        double energy = 0;
        for (int j = 0; j < m.masses; ++j) {
            const double ratio = mode.view[panel_index(padded(m.seen), n, m.power_rows + j, i)];
            energy += m.structure.inertia[static_cast<std::size_t>(j)] * ratio * ratio;
        }
        const int twist = mode.coordinates[i] - m.masses;
        if (twist >= 0) energy = m.structure.shafts[static_cast<std::size_t>(twist)].stiffness;
        int exponent = 0;
        std::frexp(energy, &exponent);
        root[i] = std::ldexp(1, exponent / 2);
        inverse[i] = 1 / root[i];
    }
    mode.rate_norm = 0;
    for (int c = 0; c < columns; ++c) {
        double* const column = scaled + c * stride;
        const double divisor = c < n ? inverse[c] : 1;
        double sum = 0;
        for (int i = 0; i < n; ++i) {
            column[i] =
                mode.rates[panel_index(m.states_padded, columns, mode.coordinates[i], c)] * root[i] * divisor;
            sum += std::fabs(column[i]);
        }
        if (c < n) mode.rate_norm = std::max(mode.rate_norm, sum);
    }
    list_entries(scaled, n, stride, mode.sparse_rates);
}

// `end_alone`: nobody asks for what is given to the coordinates half way and at the late stage.
static StepOperators build(const ModelData& m, const Mode& mode, double length, bool end_alone,
                           double* memory, double* workspace, int* integers) SHIFTRIG_REALTIME {
    const int n = mode.order, stride = padded(n), size = stride * n, columns = n + m.forces;
    const int force_size = stride * m.forces;
    StepOperators operators;
    operators.length = length;
    operators.from_begin = memory;
    operators.from_half = operators.from_begin + whole_panels(3 * stride * columns);
    operators.from_late = operators.from_half + whole_panels(2 * force_size);
    operators.middle = operators.from_late + whole_panels(force_size);

    double* next = workspace;
    const auto take = [&next](int doubles) { return std::exchange(next, next + whole_panels(doubles)); };
    const Algebra algebra{m.kernel, n, stride, take(stride * stride)};
    double* const z = take(size);
    double* const phi = take(4 * size);
    double *const phi0 = phi, *const others = phi + size;
    double* const product = take(std::max(4 * size, 3 * force_size));
    double* const acting = take(3 * force_size);  // φ_1 S̃, φ_2 S̃, φ_3 S̃ side by side
    double *const a1 = acting, *const a2 = a1 + force_size, *const a3 = a2 + force_size;
    double* const sum = take(force_size);

    const double* const force = mode.scaled_rates + size;
    double scale = 0.5 * length;
    while (mode.rate_norm * scale > 0.5 && operators.halvings < 60) {
        scale *= 0.5;
        ++operators.halvings;
    }
    const bool sparse = mode.sparse_rates.entries > 0;
    const bool at_once = end_alone && sparse && length * mode.rate_norm <= largest_sparse_norm;
    if (sparse) {
        int doublings = at_once ? 0 : operators.halvings;
        if (at_once) scale = length;
        for (; doublings > 0 && 2 * scale * mode.rate_norm <= largest_sparse_norm; --doublings) scale *= 2;
        sparse_exponential(m.kernel, mode.sparse_rates, scale, scale * mode.rate_norm, force, m.forces,
                           stride, phi0, acting, next, integers);
        for (; doublings > 0; --doublings) {
            algebra.take(phi0);
            algebra.times(acting, 3 * m.forces, product);
            double_length(algebra, product, force_size, acting);
            algebra.times(phi0, n, product);
            std::copy(product, product + size, phi0);
        }
    } else {
        algebra.combine({{scale, mode.scaled_rates}}, size, z);
        sum_series(algebra, z, product, phi);
        for (int k = 0; k < operators.halvings; ++k) {
            algebra.multiply(phi0, phi, 4 * n, product);
            double_length(algebra, product + size, size, others);
            std::copy(product, product + size, phi0);
        }
        for (int k = 0; k < 3; ++k)
            algebra.multiply(others + k * size, force, m.forces, acting + k * force_size);
    }

    // Into a block of an operator so many blocks high, from this column on, back in physical variables.
    const auto place = [&](double* panels, int blocks, int block, int width, int column, const double* source,
                           int count, double factor, const double* column_scale = nullptr) {
        m.kernel.algebra.place({.rows = blocks * stride,
                                .width = width,
                                .top = block * stride,
                                .block_rows = stride,
                                .first_column = column,
                                .columns = count,
                                .row_scale = mode.energy_root + stride,
                                .column_scale = column_scale},
                               source, factor, panels);
    };
    const auto place_transition = [&](int block, const double* transition) {
        place(operators.from_begin, 3, block, columns, 0, transition, n, 1, mode.energy_root);
    };
    const auto place_forces = [&](int block, const double* source, double factor) {
        place(operators.from_begin, 3, block, columns, n, source, m.forces, factor);
    };

    if (!at_once) {  // half the length, then the whole of it
        place_transition(0, phi0);
        place_forces(0, a1, 0.5 * length);
        algebra.combine({{2, a2}, {-2, a3}}, force_size, sum);
        place(operators.middle, 1, 0, 2 * m.forces, 0, sum, m.forces, 0.5 * length);
        algebra.combine({{1, a3}, {-0.5, a2}}, force_size, sum);
        place(operators.middle, 1, 0, 2 * m.forces, m.forces, sum, m.forces, 0.5 * length);

        algebra.take(phi0);
        algebra.times(acting, 3 * m.forces, product);
        double_length(algebra, product, force_size, acting);
        algebra.times(phi0, n, product);
        place_transition(1, product);
    }
    place_transition(2, at_once ? phi0 : product);
    place_forces(1, a1, -length);
    place(operators.from_half, 2, 0, m.forces, 0, a1, m.forces, 2 * length);
    algebra.combine({{1, a1}, {-3, a2}, {4, a3}}, force_size, sum);
    place_forces(2, sum, length);
    algebra.combine({{4, a2}, {-8, a3}}, force_size, sum);
    place(operators.from_half, 2, 1, m.forces, 0, sum, m.forces, length);
    algebra.combine({{4, a3}, {-1, a2}}, force_size, sum);
    place(operators.from_late, 1, 0, m.forces, 0, sum, m.forces, length);

    double* const reach = product;
    std::fill(reach, reach + stride, 0.);
    for (int k = 0; k < m.forces; ++k) {
        for (int i = 0; i < stride; ++i) reach[i] += std::fabs(sum[k * stride + i]);
    }
    for (int i = 0; i < n; ++i) {
        if (mode.coordinates[i] < m.masses)
            operators.late_reach = std::max(operators.late_reach, reach[i] * length / mode.energy_root[i]);
    }
    return operators;
}

StepOperators build_step_operators(const ModelData& m, const Mode& mode, double length, double* memory,
                                   double* workspace, int* integers) SHIFTRIG_REALTIME {
    return build(m, mode, length, false, memory, workspace, integers);
}

StepOperators build_ledger_operators(const ModelData& m, const Mode& mode, double length, double* memory,
                                     double* workspace, int* integers) SHIFTRIG_REALTIME {
    return build(m, mode, length, true, memory, workspace, integers);
}

}  // namespace shiftrig::plant::detail
