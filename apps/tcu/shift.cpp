#include "apps/tcu/shift.h"

namespace shiftrig::tcu {

void Shift::begin(const Calibration& cal, const Sensors& s, int from, int to) SHIFTRIG_REALTIME {
    *this = Shift{};
    from_ = from;
    to_ = to;
    phase_ = Phase::fill;
    off_ = cal.clutch.full_pressure;
    first_slip_ = slip_of(cal, s, to);
    pulls_ = first_slip_ * s.engine_torque >= 0;  // T would drive the input away from its new speed
}

void Shift::enter(Phase phase) SHIFTRIG_REALTIME {
    phase_ = phase;
    in_phase_ = 0;
}

void Shift::cancel() SHIFTRIG_REALTIME {
    const bool offgoing_holds =
        phase_ == Phase::fill || (pulls_ && phase_ == Phase::torque && handed_over_ < 0.5);
    if (offgoing_holds) enter(Phase::abandoned);
}

double Shift::slipping_capacity(const Calibration& cal, const Sensors& s,
                                double slip) const SHIFTRIG_REALTIME {
    const double to_go = std::max(cal.shift.inertia_time - in_phase_, cal.shift.shortest_to_go);
    const double acceleration = -slip_of(cal, s, to_) / to_go;  // of the input, towards its new speed
    const double torque = s.engine_torque - cal.machine.input_inertia * acceleration;
    return std::max(0.0, std::copysign(1.0, slip) * torque);
}

double Shift::engine_speed_request(const Calibration& cal, const Sensors& s) const SHIFTRIG_REALTIME {
    const double new_speed = s.input_speed - slip_of(cal, s, to_);
    const bool leads_upwards =
        !pulls_ && (phase_ == Phase::inertia || phase_ == Phase::torque || phase_ == Phase::closing) &&
        to_ < from_;
    return leads_upwards ? new_speed + cal.shift.engine_lead : 0;
}

void Shift::step(const Calibration& cal, const Sensors& s, Commands& c) SHIFTRIG_REALTIME {
    const auto on = static_cast<std::size_t>(clutch_of(to_)),
               off = static_cast<std::size_t>(clutch_of(from_));
    const double torque = std::abs(s.engine_torque);
    in_phase_ += cal.period;

    switch (phase_) {
        case Phase::fill: {
            on_ = fill_.step(cal, s.pressure[on], s.pressures_alive);
            // Meanwhile the offgoing clutch comes down to just what holds, so that it can let go quickly.
            const double holding = cal.pressure_for(cal.shift.hold_margin * torque);
            off_ = std::max(holding, off_ - cal.clutch.full_pressure * cal.period / cal.shift.torque_time);
            if (fill_.done) enter(pulls_ ? Phase::torque : Phase::inertia);
            break;
        }
        case Phase::torque:
            handed_over_ = std::min(1.0, handed_over_ + cal.period / cal.shift.torque_time);
            on_ = cal.pressure_for(handed_over_ * torque);
            off_ = cal.pressure_for((1 - handed_over_) * cal.shift.hold_margin * torque);
            if (handed_over_ >= 1) enter(pulls_ ? Phase::inertia : Phase::closing);
            break;

        case Phase::inertia: {
            const double on_slip = slip_of(cal, s, to_);
            if (pulls_) {
                on_ = cal.pressure_for(slipping_capacity(cal, s, on_slip));
                off_ = 0;
            } else {
                on_ = cal.clutch.touch_pressure;
                off_ =
                    cal.pressure_for(slipping_capacity(cal, s, -on_slip));  // it slips towards the new speed
            }
            // A leading engine passes the new speed and must be caught there.
            const bool passed = !pulls_ && on_slip * first_slip_ <= 0;
            if (slip_.locked(cal, on_slip) || passed) {
                enter(pulls_ ? Phase::closing : Phase::torque);
            } else if (in_phase_ > cal.shift.timeout) {
                if (pulls_) enter(Phase::abandoned);
                pulls_ = true;  // the engine could not do it, so the oncoming clutch shall
                in_phase_ = 0;
            }
            break;
        }
        case Phase::closing:
            off_ = 0;
            on_ = std::max(
                on_, cal.pressure_for(cal.shift.hold_margin * torque));  // it has locked: let it stay so
            on_ = std::min(cal.clutch.full_pressure, on_ + cal.clutch.closing_rate * cal.period);
            if (on_ >= cal.clutch.full_pressure) enter(Phase::finished);
            break;

        case Phase::finished:
        case Phase::abandoned:
            break;
    }
    if (phase_ == Phase::abandoned) on_ = 0;
    c.pressure[on] = on_;
    c.pressure[off] = off_;
}

}  // namespace shiftrig::tcu
