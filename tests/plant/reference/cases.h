// The published examples and problems with known answers, as descriptions (sources in tests/data and
// docs/validation.md). Signs of the project: a clutch's torque is the negative of the curves' `tau`, its
// slip the negative of their `w_rel`.
#pragma once

#include "plant/description.h"

namespace shiftrig::cases {

plant::Description coupled_clutches();
plant::Description lossy_gear_demo();
plant::Description friction();
// Two inertias 2.6 and 1.0 kg m², 188.5 rad/s on the first, clutch 1500 Nm, no load.
plant::Description two_inertias();
// m = k = 1 on a belt of 0.2 m/s (a mass so heavy that its speed is a belt's), static 1, sliding 0.7.
plant::Description stick_slip();
// Planetary row with a ring of 1e-4 kg m² between a fading brake and a closing clutch.
plant::Description light_body();

}  // namespace shiftrig::cases
