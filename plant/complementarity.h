// Which of two things that exclude each other happens, for a handful of pairs at once: a joint slips or holds, a
// torque is within its limit or at it.
#pragma once

#include "plant/realtime.h"

namespace shiftrig::plant::detail {

// The linear complementarity problem: w − M z = q, w ≥ 0, z ≥ 0, wᵀz = 0, by Lemke's method.
//
// `tableau`, `size` rows of `lemke_columns(size)` numbers, one after the other: [I, −M, room for one, q] of the
// columns of w, z, the artificial variable and the right-hand side. Its numbers should be of the order of 1.
// Afterwards basis[r] is the variable that row r gives (w_i is i, z_i is size + i), its value the row's last
// number; all others are 0. False: no solution was found within a bounded number of pivots.
constexpr int lemke_columns(int size) noexcept {
    return 2 * size + 2;
}
bool solve_complementarity(double* tableau, int* basis, int size, int course = 0) SHIFTRIG_REALTIME;

}  // namespace shiftrig::plant::detail
