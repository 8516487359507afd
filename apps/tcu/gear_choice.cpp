#include "apps/tcu/gear_choice.h"

namespace shiftrig::tcu {

namespace {

double ratio(const Calibration& cal, int gear) {
    return cal.machine.ratio[static_cast<std::size_t>(clutch_of(gear))];
}

void count_down(double& time, double period) {
    time = std::max(0.0, time - period);
}

}  // namespace

void GearChoice::observe(const Calibration& cal, const Sensors& s) SHIFTRIG_REALTIME {
    if (!observed_) torque_ = s.engine_torque;
    observed_ = true;
    torque_ += (s.engine_torque - torque_) * cal.period / (cal.choice.torque_filter + cal.period);
    count_down(refused_for_, cal.period);
    count_down(pause_, cal.period);
    const bool lugs = s.engine_speed < cal.choice.lug_speed &&
                      s.engine_torque >= cal.choice.lug_load * cal.full_load(s.engine_speed);
    lugging_ = lugs ? lugging_ + cal.period : 0;
}

int GearChoice::starting(const Calibration& cal, const Sensors& s) const SHIFTRIG_REALTIME {
    if (s.lever < 0) return -1;
    const int highest = std::min(s.lever, highest_gear);
    if (std::abs(s.output_speed) < cal.limp.sensor_zero) return std::min(highest, cal.launch.highest_gear);
    // In motion: the gear whose input speed comes nearest to the engine's.
    int best = std::min(highest, 1);
    for (int gear = 2; gear <= highest; ++gear) {
        const auto miss = [&](int g) { return std::abs(ratio(cal, g) * s.output_speed - s.engine_speed); };
        if (miss(gear) < miss(best)) best = gear;
    }
    return best;
}

int GearChoice::next(const Calibration& cal, const Sensors& s, int gear) const SHIFTRIG_REALTIME {
    if (s.lever == 0 || s.lever * gear < 0) return 0;
    if (gear < 0 || pause_ > 0) return gear;
    const auto input_speed_in = [&](int to) { return s.input_speed * ratio(cal, to) / ratio(cal, gear); };

    if (gear > 1 && lugging_ >= cal.choice.lug_time) return gear - 1;
    const int wanted = std::min(s.lever, highest_gear);
    if (wanted < gear) return input_speed_in(gear - 1) <= cal.choice.highest_engine_speed ? gear - 1 : gear;
    if (wanted == gear || refused_for_ > 0 || !engine_bears(cal, s, gear, gear + 1)) return gear;
    if (s.automatic && input_speed_in(gear + 1) < cal.choice.auto_upshift_speed) return gear;
    return gear + 1;
}

bool GearChoice::engine_bears(const Calibration& cal, const Sensors& s, int from,
                              int to) const SHIFTRIG_REALTIME {
    const double step = ratio(cal, from) / ratio(cal, to);  // > 1 upwards
    return torque_ * step <= cal.choice.upshift_torque_margin * cal.full_load(s.input_speed / step);
}

void GearChoice::shifted(const Calibration& cal, bool refuse_upshifts) SHIFTRIG_REALTIME {
    pause_ = cal.shift.pause;
    lugging_ = 0;
    if (refuse_upshifts) refused_for_ = cal.choice.refusal_time;
}

}  // namespace shiftrig::tcu
