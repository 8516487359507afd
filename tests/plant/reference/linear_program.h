// Least cost·x subject to a·x ≤ b and x ≥ 0, for a handful of unknowns: the simplex method on a dense tableau.
#pragma once

#include <Eigen/Dense>

namespace shiftrig::reference {

// False: nothing satisfies the constraints (or the cost has no bound, which does not happen here).
bool linear_program(const Eigen::MatrixXd& a, const Eigen::VectorXd& b, const Eigen::VectorXd& cost,
                    Eigen::VectorXd& x);

}  // namespace shiftrig::reference
