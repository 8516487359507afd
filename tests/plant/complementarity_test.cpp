// Lemke's method against what its solutions must satisfy: w − M z = q, w ≥ 0, z ≥ 0, wᵀz = 0.
#include "plant/complementarity.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>
#include <vector>

namespace shiftrig::plant::detail {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Solution {
    bool found = false;
    VectorXd w, z;
};

Solution solve(const MatrixXd& m, const VectorXd& q) {
    const auto n = static_cast<int>(q.size());
    const int columns = lemke_columns(n);
    std::vector<double> tableau(static_cast<std::size_t>(n * columns), 0.);
    std::vector<int> basis(static_cast<std::size_t>(n));
    for (int r = 0; r < n; ++r) {
        double* const row = tableau.data() + r * columns;
        row[r] = 1;
        for (int c = 0; c < n; ++c) row[n + c] = -m(r, c);
        row[columns - 1] = q[r];
    }
    Solution s{.found = solve_complementarity(tableau.data(), basis.data(), n),
               .w = VectorXd::Zero(n),
               .z = VectorXd::Zero(n)};
    for (int r = 0; r < n && s.found; ++r) {
        const int variable = basis[static_cast<std::size_t>(r)];
        const double value = tableau[static_cast<std::size_t>(r * columns + columns - 1)];
        (variable < n ? s.w[variable] : s.z[variable - n]) = value;
    }
    return s;
}

void expect_solved(const MatrixXd& m, const VectorXd& q, const char* what) {
    const Solution s = solve(m, q);
    ASSERT_TRUE(s.found) << what;
    EXPECT_LT((s.w - m * s.z - q).norm(), 1e-9) << what;
    EXPECT_GT(s.w.minCoeff(), -1e-9) << what;
    EXPECT_GT(s.z.minCoeff(), -1e-9) << what;
    EXPECT_LT(std::abs(s.w.dot(s.z)), 1e-9) << what;
}

TEST(Complementarity, NeedsNoPivotWhereNothingIsViolated) {
    const Solution s = solve(MatrixXd::Identity(2, 2), VectorXd::Constant(2, 3));
    ASSERT_TRUE(s.found);
    EXPECT_EQ(s.w, VectorXd::Constant(2, 3));
    EXPECT_EQ(s.z, VectorXd::Zero(2));
}

TEST(Complementarity, SolvesRandomPositiveDefiniteProblems) {
    std::mt19937_64 random(1);
    std::normal_distribution<double> normal;
    for (int i = 0; i < 500; ++i) {
        const int n = 1 + i % 20;
        const MatrixXd a = MatrixXd::NullaryExpr(n, n, [&] { return normal(random); });
        const MatrixXd m = a * a.transpose() / n + 0.1 * MatrixXd::Identity(n, n);
        expect_solved(m, VectorXd::NullaryExpr(n, [&] { return normal(random); }), "definite");
    }
}

// Brakes on fewer masses than there are brakes: W is singular, the split of the torques not unique.
TEST(Complementarity, SolvesFrictionOfMoreDevicesThanMotions) {
    std::mt19937_64 random(2);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> real(0.1, 1);
    for (int i = 0; i < 500; ++i) {
        const int n = 2 + i % 7, motions = 1 + i % 3;
        const MatrixXd c = MatrixXd::NullaryExpr(n, motions, [&] { return normal(random); });
        const MatrixXd w = c * c.transpose();
        const VectorXd load = c * VectorXd::NullaryExpr(motions, [&] { return normal(random); });
        const VectorXd limit = VectorXd::NullaryExpr(n, [&] { return real(random); });
        MatrixXd m = MatrixXd::Zero(2 * n, 2 * n);
        m.topLeftCorner(n, n) = w;
        m.topRightCorner(n, n).setIdentity();
        m.bottomLeftCorner(n, n) = -MatrixXd::Identity(n, n);
        VectorXd q(2 * n);
        q << load - w * limit, 2 * limit;
        expect_solved(m, q, "friction");
    }
}

TEST(Complementarity, SaysWhereThereIsNoSolution) {
    EXPECT_FALSE(solve(MatrixXd::Zero(1, 1), VectorXd::Constant(1, -1)).found);
}

}  // namespace
}  // namespace shiftrig::plant::detail
