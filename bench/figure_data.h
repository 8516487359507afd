// The numbers behind docs/figures: each function writes one CSV table.
#pragma once

#include <cstdio>

namespace shiftrig::figures {

void coupled_clutches(std::FILE* out);
void lossy_gear(std::FILE* out);
void friction(std::FILE* out);
void stick_slip(std::FILE* out);
void light_body(std::FILE* out);
void wrong_models(std::FILE* out);
void table_2(std::FILE* out);

void shift(std::FILE* out);           // the three shifts over time
void order(std::FILE* out);           // error and ledger defect against step size
void work_precision(std::FILE* out);  // error against cost
void sensitivity(std::FILE* out);     // ± 30 % on the estimates
void random_systems(std::FILE* out);  // deviations of random machines

}  // namespace shiftrig::figures
