// The plant's certificates of many steps as one: of a tick from those of its substeps, of a run from those of its ticks.
#pragma once

#include <array>
#include <cstdint>

#include "plant/plant.h"

namespace shiftrig::rig {

// The worst residuals, sums of defects and counts, all flags.
void add(plant::Certificate& tick, const plant::Certificate& step) SHIFTRIG_REALTIME;

struct RunCertificate {
    double torque_residual = 0, constraint_violation = 0;  // the worst, as in plant::Certificate
    double energy_defect = 0;                              // of the whole run [J]
    std::int64_t events = 0, fall_backs = 0, mode_lookups = 0, mode_misses = 0;
    std::int64_t ticks = 0;
    std::array<std::int64_t, 5> flagged{};  // in so many of them each bit of Certificate::flags is set

    void take(const plant::Certificate& tick) SHIFTRIG_REALTIME;
    bool is_finite() const noexcept { return flagged[2] == 0; }
};

}  // namespace shiftrig::rig
