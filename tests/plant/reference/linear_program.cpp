#include "tests/plant/reference/linear_program.h"

#include <utility>
#include <vector>

namespace shiftrig::reference {
namespace {

constexpr double nothing = 1e-11;

// Rows: basic variables as b − (the others), then the cost. One column per variable outside the basis, then b.
struct Tableau {
    Eigen::MatrixXd t;
    std::vector<int> basic, outside;

    void pivot(Eigen::Index row, Eigen::Index column) {
        const double inverse = 1 / t(row, column);
        const Eigen::VectorXd factors = t.col(column);
        t.row(row) *= inverse;
        for (Eigen::Index i = 0; i < t.rows(); ++i) {
            if (i == row) continue;
            t.row(i) -= factors[i] * t.row(row);
            t(i, column) = -factors[i] * inverse;
        }
        t(row, column) = inverse;
        std::swap(basic[static_cast<std::size_t>(row)], outside[static_cast<std::size_t>(column)]);
    }

    // Bland's rule, so that it ends. `cost_row` may be any row below those of the basis.
    bool minimise(Eigen::Index cost_row) {
        const Eigen::Index last = t.cols() - 1;
        const auto rows = static_cast<Eigen::Index>(basic.size());
        for (int pivots = 0; pivots < 2000; ++pivots) {
            Eigen::Index enters = -1, leaves = -1;
            for (Eigen::Index j = 0; j < last; ++j) {
                if (outside[static_cast<std::size_t>(j)] == -2 || t(cost_row, j) >= -nothing) continue;
                if (enters < 0 ||
                    outside[static_cast<std::size_t>(j)] < outside[static_cast<std::size_t>(enters)])
                    enters = j;
            }
            if (enters < 0) return true;
            double least = 0;
            for (Eigen::Index i = 0; i < rows; ++i) {
                if (t(i, enters) <= nothing) continue;
                const double ratio = t(i, last) / t(i, enters);
                const bool tie = leaves >= 0 && ratio < least + 1e-14 && ratio > least - 1e-14;
                if (leaves < 0 || (!tie && ratio < least) ||
                    (tie && basic[static_cast<std::size_t>(i)] < basic[static_cast<std::size_t>(leaves)])) {
                    leaves = i;
                    least = ratio;
                }
            }
            if (leaves < 0) return false;
            pivot(leaves, enters);
        }
        return false;
    }
};

}  // namespace

bool linear_program(const Eigen::MatrixXd& a, const Eigen::VectorXd& b, const Eigen::VectorXd& cost,
                    Eigen::VectorXd& x) {
    const Eigen::Index m = a.rows(), n = a.cols();
    // Unknowns 0…n−1, slacks n…n+m−1, and −1: what all right-hand sides are raised by until something fits.
    Tableau s;
    s.t = Eigen::MatrixXd::Zero(m + 2, n + 2);
    s.t.topLeftCorner(m, n) = a;
    s.t.block(0, n, m, 1).setConstant(-1);
    s.t.block(0, n + 1, m, 1) = b;
    s.t.row(m).head(n) = cost.transpose();
    s.t(m + 1, n) = 1;
    for (Eigen::Index j = 0; j < n; ++j) s.outside.push_back(static_cast<int>(j));
    s.outside.push_back(-1);
    for (Eigen::Index i = 0; i < m; ++i) s.basic.push_back(static_cast<int>(n + i));
    Eigen::Index worst = 0;
    for (Eigen::Index i = 1; i < m; ++i)
        if (b[i] < b[worst]) worst = i;
    if (m > 0 && b[worst] < 0) {
        s.pivot(worst, n);
        if (!s.minimise(m + 1) || s.t(m + 1, n + 1) < -1e-10) return false;
        for (Eigen::Index i = 0; i < m; ++i) {
            if (s.basic[static_cast<std::size_t>(i)] != -1) continue;
            Eigen::Index largest = 0;
            for (Eigen::Index j = 1; j <= n; ++j)
                if (std::abs(s.t(i, j)) > std::abs(s.t(i, largest))) largest = j;
            s.pivot(i, largest);
        }
    }
    for (int& name : s.outside)
        if (name == -1) name = -2;  // never again
    if (!s.minimise(m)) return false;
    x = Eigen::VectorXd::Zero(n);
    for (Eigen::Index i = 0; i < m; ++i) {
        const int name = s.basic[static_cast<std::size_t>(i)];
        if (name >= 0 && name < n) x[name] = s.t(i, n + 1);
    }
    return true;
}

}  // namespace shiftrig::reference
