#include "apps/rig/certificate.h"

#include <cmath>

namespace shiftrig::rig {

namespace {

double larger(double a, double b) SHIFTRIG_REALTIME {
    return std::fabs(b) > std::fabs(a) ? b : a;
}

}  // namespace

void add(plant::Certificate& tick, const plant::Certificate& step) SHIFTRIG_REALTIME {
    tick.torque_residual = larger(tick.torque_residual, step.torque_residual);
    tick.constraint_violation = larger(tick.constraint_violation, step.constraint_violation);
    tick.energy_defect += step.energy_defect;
    tick.events += step.events;
    tick.fall_backs += step.fall_backs;
    tick.mode_lookups += step.mode_lookups;
    tick.mode_misses += step.mode_misses;
    tick.flags |= step.flags;
}

void RunCertificate::take(const plant::Certificate& tick) SHIFTRIG_REALTIME {
    torque_residual = larger(torque_residual, tick.torque_residual);
    constraint_violation = larger(constraint_violation, tick.constraint_violation);
    energy_defect += tick.energy_defect;
    events += tick.events;
    fall_backs += tick.fall_backs;
    mode_lookups += tick.mode_lookups;
    mode_misses += tick.mode_misses;
    ++ticks;
    for (std::size_t bit = 0; bit < flagged.size(); ++bit) flagged[bit] += tick.flags >> bit & 1;
}

}  // namespace shiftrig::rig
