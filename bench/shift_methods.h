// Textbook integrators on the equations of the tractor shift, with complete event handling, for
// comparison with the plant's step: what error do they reach, and at what price?
#pragma once

#include <optional>

#include "tests/plant/tractor_comparison.h"

namespace shiftrig {

enum class TextbookMethod { runge_kutta_4, implicit_euler, cvode_bdf };

struct MethodRun {
    ShiftTrace trace;  // .seconds is CPU time of the shift without changes of contact state
    long force_evaluations = 0;
};

// `precision`: steps per millisecond, or for CVODE the relative tolerance. Empty where the method fails
// (not finite, does not converge) or, for CVODE, where it was not built in.
std::optional<MethodRun> run_textbook(const cases::TractorShift& shift, TextbookMethod method,
                                      double precision);

bool has_cvode();

}  // namespace shiftrig
