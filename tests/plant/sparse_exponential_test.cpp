// Exponentials from the few entries of L, in every kernel that this processor runs, against their power series in long double.
#include "plant/sparse_exponential.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "tests/plant/kernel_kinds.h"

namespace shiftrig::plant::detail {
namespace {

std::size_t at(int i) {
    return static_cast<std::size_t>(i);
}

// Speeds of a chain of masses, then twists, in energy variables, damped; `far`: one twist also acts far away, on that alone.
std::vector<double> chain(int masses, bool far) {
    std::mt19937_64 random{11};
    std::uniform_real_distribution<double> draw(0.2, 1);
    const int n = 2 * masses - 1, stride = padded(n);
    std::vector<double> l(at(stride * n), 0.);
    for (int e = 0; e + 1 < masses; ++e) {
        const int twist = masses + e;
        for (int end = 0; end < 2; ++end) {
            const double pull = (end == 0 ? -1 : 1) * draw(random);
            l[at(twist * stride + e + end)] = pull;
            l[at((e + end) * stride + twist)] = -pull;
            l[at((e + end) * stride + e + end)] -= 0.1 * draw(random);
        }
    }
    if (far) l[at(masses * stride + masses - 1)] = 0.5;
    return l;
}

double norm_of(const std::vector<double>& l, int n) {
    double norm = 0;
    for (int c = 0; c < n; ++c) {
        double sum = 0;
        for (int i = 0; i < n; ++i) sum += std::fabs(l[at(c * padded(n) + i)]);
        norm = std::max(norm, sum);
    }
    return norm;
}

// φ_k(scale·L) times the columns, φ_0 the exponential.
std::vector<long double> series(const std::vector<double>& l, int n, double scale, int k,
                                const std::vector<double>& columns) {
    const int stride = padded(n), count = static_cast<int>(columns.size()) / stride;
    std::vector<long double> term(columns.begin(), columns.end()), sum;
    for (int i = 2; i <= k; ++i) {
        for (long double& t : term) t /= i;
    }
    sum = term;
    for (int power = 1; power < 60; ++power) {
        std::vector<long double> next(term.size(), 0.L);
        for (int c = 0; c < count; ++c) {
            for (int j = 0; j < n; ++j) {
                for (int i = 0; i < n; ++i) {
                    next[at(c * stride + i)] += static_cast<long double>(l[at(j * stride + i)]) * scale *
                                                term[at(c * stride + j)] / (power + k);
                }
            }
        }
        term = next;
        for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += term[i];
    }
    return sum;
}

struct Listed {
    Listed(const std::vector<double>& matrix, int n)
        : integers(at(SparseRates::integers(n))), values(at(SparseRates::most_entries(n))) {
        const int most = SparseRates::most_entries(n);
        rates.column = integers.data();
        rates.row = rates.column + most;
        rates.row_begin = rates.row + most;
        rates.column_begin = rates.row_begin + n + 1;
        rates.value = values.data();
        list_entries(matrix.data(), n, padded(n), rates);
    }
    std::vector<int> integers;
    std::vector<double> values;
    SparseRates rates;
};

class SparseExponentialOf : public testing::TestWithParam<KernelKind> {};

INSTANTIATE_TEST_SUITE_P(Kernels, SparseExponentialOf, testing::ValuesIn(offered_kernels()), kernel_name);

TEST_P(SparseExponentialOf, IsThePowerSeriesToRounding) {
    const Kernel kernel = choose_kernel(GetParam());
    for (const bool far : {false, true}) {
        for (const double norm : {1e-3, 0.4, largest_sparse_norm}) {
            const int masses = 29, n = 2 * masses - 1, stride = padded(n), forces = 19;
            const std::vector<double> l = chain(masses, far);
            std::vector<double> force(at(stride * forces), 0.), identity(at(stride * n), 0.);
            for (int k = 0; k < forces; ++k) force[at(k * stride + k % masses)] = 1 + k;
            for (int i = 0; i < n; ++i) identity[at(i * stride + i)] = 1;
            Listed listed(l, n);
            ASSERT_GT(listed.rates.entries, 0);
            const double scale = norm / norm_of(l, n), nan = std::nan("");
            std::vector<double> exponential(at(stride * n), nan), acting(at(3 * stride * forces), nan);
            std::vector<double> workspace(at(sparse_workspace_doubles(n)), nan);
            std::vector<int> integers(at(sparse_workspace_integers(n)), -1);
            sparse_exponential(kernel, listed.rates, scale, norm, force.data(), forces, stride,
                               exponential.data(), acting.data(), workspace.data(), integers.data());
            const auto compare = [&](const double* found, const std::vector<long double>& right,
                                     double size) {
                for (std::size_t i = 0; i < right.size(); ++i)
                    ASSERT_LE(std::fabs(static_cast<double>(found[i] - right[i])), 4e-15 * size) << norm << i;
            };
            compare(exponential.data(), series(l, n, scale, 0, identity), 1);
            for (int k = 1; k <= 3; ++k)
                compare(acting.data() + (k - 1) * stride * forces, series(l, n, scale, k, force), forces);
        }
    }
}

TEST_P(SparseExponentialOf, LeavesWhatNothingMovesExactlyAsItIs) {
    const Kernel kernel = choose_kernel(GetParam());
    const int masses = 20, n = 2 * masses - 1, stride = padded(n);
    std::vector<double> l = chain(masses, false);
    for (int c = 0; c < n; ++c) l[at(c * stride + 7)] = 0;
    Listed listed(l, n);
    std::vector<double> exponential(at(stride * n));
    std::vector<double> workspace(at(sparse_workspace_doubles(n)));
    std::vector<int> integers(at(sparse_workspace_integers(n)));
    sparse_exponential(kernel, listed.rates, 0.3, 1, nullptr, 0, stride, exponential.data(), nullptr,
                       workspace.data(), integers.data());
    for (int c = 0; c < n; ++c) EXPECT_EQ(exponential[at(c * stride + 7)], c == 7 ? 1 : 0) << c;
}

TEST_P(SparseExponentialOf, ManyProductsAreEachProductToRounding) {
    const Kernel kernel = choose_kernel(GetParam());
    std::mt19937_64 random{3};
    std::uniform_real_distribution<double> draw(-1, 1);
    for (int n = 4; n <= 68; n += 4) {
        for (const int count : {1, 7, 8, 21}) {
            std::vector<double> matrix(at(n * n)), panels(at(n * n)), v(at(n * count));
            for (auto* numbers : {&matrix, &v}) {
                for (double& number : *numbers) number = draw(random);
            }
            to_panels(matrix.data(), n, n, panels.data());
            std::vector<double> many(at(n * count), std::nan("")), each = many;
            kernel.many(panels.data(), n, n, v.data(), count, many.data());
            kernel.multiply_each(panels.data(), n, n, v.data(), count, each.data());
            for (std::size_t i = 0; i < each.size(); ++i) ASSERT_NEAR(many[i], each[i], 2e-14) << n << count;
        }
    }
}

TEST(SparseRates, KeepsNoListOfSmallOrFullMatrices) {
    const int n = 40;
    EXPECT_EQ(Listed(std::vector<double>(at(n * n), 1.), n).rates.entries, 0);
    EXPECT_EQ(SparseRates::most_entries(SparseRates::smallest - 1), 0);
}

}  // namespace
}  // namespace shiftrig::plant::detail
