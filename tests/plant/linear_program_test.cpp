// The simplex method against programs whose answers are known, and against every corner of random ones.
#include "plant/linear_program.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <random>
#include <vector>

namespace shiftrig::plant::detail {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Answer {
    bool found = false;
    VectorXd x;
};

// A x ≤ q for the first `bounded` rows, A x = q for the others, x ≥ 0; x[objective] as large as can be.
Answer solve(const MatrixXd& a, const VectorXd& q, int bounded, int objective) {
    const int rows = static_cast<int>(a.rows()), unknowns = static_cast<int>(a.cols());
    const int columns = unknowns + rows + 1;
    std::vector<double> tableau(static_cast<std::size_t>(rows * columns), 0.);
    std::vector<int> basis(static_cast<std::size_t>(rows), -1);
    Program program{.tableau = tableau.data(), .rows = rows, .columns = columns, .basis = basis.data()};
    for (int c = 0; c < unknowns; ++c) program.enters[c] = true;
    for (int r = 0; r < rows; ++r) {
        double* const row = tableau.data() + r * columns;
        for (int c = 0; c < unknowns; ++c) row[c] = a(r, c);
        row[columns - 1] = q[r];
        if (r >= bounded) continue;
        row[unknowns + r] = 1;
        program.enters[unknowns + r] = true;
        basis[static_cast<std::size_t>(r)] = unknowns + r;
    }
    Answer answer{.found = solve_program(program, objective), .x = VectorXd::Zero(unknowns)};
    for (int r = 0; r < rows && answer.found; ++r) {
        const int variable = basis[static_cast<std::size_t>(r)];
        if (variable >= 0 && variable < unknowns)
            answer.x[variable] = tableau[static_cast<std::size_t>(r * columns + columns - 1)];
    }
    return answer;
}

TEST(LinearProgram, FindsTheCorner) {
    MatrixXd a(3, 2);
    a << 1, 1, 1, -1, -1, 0;  // x + y ≤ 4, x − y ≤ 1, x ≥ 1
    const Answer answer = solve(a, Eigen::Vector3d(4, 1, -1), 3, 0);
    ASSERT_TRUE(answer.found);
    EXPECT_NEAR(answer.x[0], 2.5, 1e-12);
    EXPECT_NEAR(answer.x[1], 1.5, 1e-12);
}

TEST(LinearProgram, SaysThatNothingIsPossible) {
    MatrixXd a(2, 1);
    a << 1, -1;  // x ≤ 1, x ≥ 2
    EXPECT_FALSE(solve(a, Eigen::Vector2d(1, -2), 2, 0).found);
}

TEST(LinearProgram, EquationsMayRepeatThemselves) {
    MatrixXd a(3, 3);
    a << 1, 1, 1, 2, 2, 2, 0, 1, 0;  // x + y + z = 3, twice; y = 1
    const Answer answer = solve(a, Eigen::Vector3d(3, 6, 1), 0, 2);
    ASSERT_TRUE(answer.found);
    EXPECT_NEAR(answer.x[2], 2, 1e-12);
    EXPECT_NEAR(answer.x[1], 1, 1e-12);
}

// Of x ≥ 0 with A x = q: a corner has as many unknowns that are not 0 as there are equations.
TEST(LinearProgram, NoCornerOfRandomProgramsIsBetter) {
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> number(-1, 1);
    int possible = 0;
    for (int n = 0; n < 400; ++n) {
        constexpr int rows = 3, unknowns = 6;
        MatrixXd a(rows, unknowns);
        for (int i = 0; i < a.size(); ++i) a.data()[i] = number(random);
        a.row(0) = a.row(0).cwiseAbs().array() + 0.1;  // bounded
        const VectorXd q = Eigen::Vector3d(1, 0.3 * number(random), 0.3 * number(random));
        double best = -1;
        std::vector<int> chosen = {0, 0, 0, 1, 1, 1};
        do {
            MatrixXd corner(rows, rows);
            std::vector<int> which;
            for (int c = 0; c < unknowns; ++c) {
                if (chosen[static_cast<std::size_t>(c)] == 0) continue;
                corner.col(static_cast<Eigen::Index>(which.size())) = a.col(c);
                which.push_back(c);
            }
            const VectorXd x = corner.fullPivLu().solve(q);
            if (x.minCoeff() < -1e-9) continue;
            const auto at = std::find(which.begin(), which.end(), 0);
            best = std::max(best, at == which.end() ? 0 : x[at - which.begin()]);
        } while (std::next_permutation(chosen.begin(), chosen.end()));
        const Answer answer = solve(a, q, 0, 0);
        ASSERT_EQ(answer.found, best >= 0) << n;
        if (!answer.found) continue;
        ++possible;
        EXPECT_LT((a * answer.x - q).norm(), 1e-9) << n;
        EXPECT_GT(answer.x.minCoeff(), -1e-12) << n;
        EXPECT_NEAR(answer.x[0], best, 1e-8) << n;
    }
    EXPECT_GT(possible, 100);
}

}  // namespace
}  // namespace shiftrig::plant::detail
