// What is possible at all, for a handful of unknowns: the simplex method on a tableau.
#pragma once

#include "plant/realtime.h"

namespace shiftrig::plant::detail {

constexpr int most_program_columns = 192;

// Rows Σ a_c x_c = q over the columns that `enters` allows (x ≥ 0), of which row r may begin with basis[r], a column that is 1
// there and 0 in all other rows; −1: with none. The last of `columns` is q.
struct Program {
    double* tableau = nullptr;  // `rows` times `columns` numbers, one row after the other
    int rows = 0, columns = 0;
    int* basis = nullptr;
    bool enters[most_program_columns] = {};
};

// Finds values with x[objective] as large as it can be, if there are any; true: basis[r] is the variable that row r gives, its value
// the row's last number, all others are 0. Rows that say nothing keep −1.
bool solve_program(Program& program, int objective) SHIFTRIG_REALTIME;

}  // namespace shiftrig::plant::detail
