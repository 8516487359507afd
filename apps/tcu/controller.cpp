#include "apps/tcu/controller.h"

namespace shiftrig::tcu {

Commands Controller::step(const Sensors& s) SHIFTRIG_REALTIME {
    Commands c;
    in_mode_ += cal_->period;
    if (s.lever_alive && s.lever != failed_lever_) failed_lever_ = 0;

    trusted_ = trusts(s) ? trusted_ + cal_->period : 0;
    if (trusted_ > 0) choice_.observe(*cal_, s);
    watch_engine(s);
    if (mode_ == Mode::listening && trusted_ > 0) listen(s);
    if (trusted_ == 0 && mode_ != Mode::limp && mode_ != Mode::listening) {
        if (mode_ != Mode::driving) gear_ = 0;  // half-done engagements are opened
        enter(Mode::limp);
    }
    switch (mode_) {
        case Mode::listening:
            hold_as_found(s, c);
            break;
        case Mode::neutral:
            neutral(s, c);
            break;
        case Mode::launch:
            launch(s, c);
            break;
        case Mode::driving:
            driving(s, c);
            break;
        case Mode::shift:
            shift(s, c);
            break;
        case Mode::limp:
            limp(s, c);
            break;
    }
    if (c.engine_speed_request == 0) c.engine_speed_request = give_back_engine(s);
    engine_request_ = c.engine_speed_request;
    c.mode = mode_;
    c.engaged = gear_ != 0;
    c.current_gear = mode_ == Mode::launch ? 0 : gear_;
    c.selected_gear = mode_ == Mode::shift ? shift_.to() : gear_;
    c.shifting = mode_ == Mode::shift || mode_ == Mode::launch;
    c.main_release = std::max(c.main_release, s.clutch_pedal);
    return c;
}

void Controller::enter(Mode mode) SHIFTRIG_REALTIME {
    mode_ = mode;
    in_mode_ = 0;
    slipping_ = 0;
    if (mode == Mode::neutral) gear_ = 0;
}

// Nothing is known yet but pressures: what is closed stays closed.
void Controller::hold_as_found(const Sensors& s, Commands& c) SHIFTRIG_REALTIME {
    for (std::size_t i = 0; i < clutch_count; ++i)
        if (s.pressure[i] > 0.8 * cal_->clutch.full_pressure) c.pressure[i] = cal_->clutch.full_pressure;
}

// The first believable picture: a controller that (re)starts finds the machine as it is.
void Controller::listen(const Sensors& s) SHIFTRIG_REALTIME {
    enter(Mode::neutral);
    if (!s.pressures_alive) return;
    for (const int gear : {-1, 1, 2, 3, 4}) {
        const bool pressed =
            s.pressure[static_cast<std::size_t>(clutch_of(gear))] > 0.8 * cal_->clutch.full_pressure;
        if (!pressed || std::abs(slip_of(*cal_, s, gear)) > cal_->limp.slip) continue;
        enter(Mode::driving);
        gear_ = gear;
        pressure_ = cal_->clutch.full_pressure;
    }
}

// ---- neutral ------------------------------------------------------------------------------------------------

void Controller::neutral(const Sensors& s, Commands& c) SHIFTRIG_REALTIME {
    const int gear = choice_.starting(*cal_, s);
    if (may_start_off(s, gear)) {
        begin_launch(s, gear);
        launch(s, c);
    }
}

bool Controller::may_start_off(const Sensors& s, int gear) const SHIFTRIG_REALTIME {
    if (gear == 0 || s.lever == failed_lever_) return false;
    const double against = gear > 0 ? -s.output_speed : s.output_speed;
    return against <= cal_->launch.highest_reversal_speed && s.engine_speed >= cal_->stop.relaunch_speed &&
           s.brake < cal_->stop.brake_applied && !s.parking_brake && s.clutch_pedal < 0.5;
}

// ---- launch: the gear's clutch, or the main clutch, slips until both sides run together -------------------------

void Controller::begin_launch(const Sensors& s, int gear) SHIFTRIG_REALTIME {
    enter(Mode::launch);
    gear_ = gear;
    fill_ = Fill{};
    slip_ = SlipWatch{};
    launch_speed_ = s.engine_speed;
    launch_torque_ = 0;
    by_main_clutch_ = cal_->launch.element == LaunchElement::main_clutch &&
                      std::abs(s.output_speed) < cal_->limp.sensor_zero;
}

void Controller::launch(const Sensors& s, Commands& c) SHIFTRIG_REALTIME {
    const auto clutch = static_cast<std::size_t>(clutch_of(gear_));
    const auto& launch = cal_->launch;

    pressure_ = fill_.step(*cal_, s.pressure[clutch], s.pressures_alive);
    const bool ready = fill_.done && (!by_main_clutch_ || in_mode_ >= launch.main_release_time);
    if (ready) {
        // The torque fades as the engine is drawn down, so that it settles where the engine can hold it.
        const double fade =
            (s.engine_speed / launch_speed_ - (1 - launch.engine_droop)) / launch.engine_droop;
        launch_torque_ = std::min(launch_torque_ + launch.torque_rate * cal_->period,
                                  launch.torque * std::clamp(fade, 0.0, 1.0));
    }
    if (by_main_clutch_) {
        if (fill_.done) pressure_ = cal_->clutch.full_pressure;
        c.main_release = std::clamp(1 - launch_torque_ / launch.main_clutch_torque, 0.0, 1.0);
    } else {
        pressure_ = std::max(pressure_, cal_->pressure_for(launch_torque_));
    }
    c.pressure[clutch] = pressure_;

    const double slip = by_main_clutch_ ? s.engine_speed - s.disc_speed : slip_of(*cal_, s, gear_);
    if (ready && slip_.locked(*cal_, slip)) {
        enter(Mode::driving);
        choice_.shifted(*cal_, false);
    } else if (s.lever * gear_ <= 0 || s.brake >= cal_->stop.brake_applied || s.parking_brake ||
               would_stall(s)) {
        enter(Mode::neutral);
    } else if (in_mode_ > launch.timeout) {
        failed_lever_ = s.lever;
        enter(Mode::neutral);
    }
}

// ---- driving: one clutch locked -----------------------------------------------------------------------------

void Controller::driving(const Sensors& s, Commands& c) SHIFTRIG_REALTIME {
    pressure_ = std::min(cal_->clutch.full_pressure, pressure_ + cal_->clutch.closing_rate * cal_->period);
    c.pressure[static_cast<std::size_t>(clutch_of(gear_))] = pressure_;

    const bool slips =
        pressure_ >= cal_->clutch.full_pressure && std::abs(slip_of(*cal_, s, gear_)) > cal_->limp.slip;
    slipping_ = slips ? slipping_ + cal_->period : 0;
    const int next = choice_.next(*cal_, s, gear_);
    if (slipping_ > cal_->limp.slip_time) {
        failed_lever_ = s.lever;  // the clutch does not hold: open it before it burns
        enter(Mode::neutral);
    } else if (next == 0 || would_stall(s)) {
        enter(Mode::neutral);
    } else if (next != gear_) {
        enter(Mode::shift);
        shift_.begin(*cal_, s, gear_, next);
        engine_before_ = s.engine_speed;
    }
}

bool Controller::would_stall(const Sensors& s) const SHIFTRIG_REALTIME {
    const bool braking = s.brake >= cal_->stop.brake_applied || s.parking_brake;
    return s.engine_speed + engine_slowing_ * cal_->stop.look_ahead <
           (braking ? cal_->stop.brake_speed : cal_->stop.stall_guard_speed);
}

void Controller::watch_engine(const Sensors& s) SHIFTRIG_REALTIME {
    constexpr double share = 0.3;  // of each new difference: a filter of some three cycles
    const double change = (s.engine_speed - engine_speed_) / cal_->period;
    engine_slowing_ = std::min(0.0, engine_slowing_ + share * (change - engine_slowing_));
    engine_speed_ = s.engine_speed;
}

// ---- shift --------------------------------------------------------------------------------------------------

void Controller::shift(const Sensors& s, Commands& c) SHIFTRIG_REALTIME {
    const bool up = shift_.to() > shift_.from();
    if (s.lever * gear_ <= 0 || would_stall(s)) {
        enter(Mode::neutral);
        return;
    }
    if (up && s.lever < shift_.to()) shift_.cancel();
    shift_.step(*cal_, s, c);
    c.engine_speed_request = shift_.engine_speed_request(*cal_, s);
    if (!shift_.over()) return;

    const bool done = shift_.phase() == Shift::Phase::finished;
    gear_ = done ? shift_.to() : shift_.from();
    // An undone upshift, or a downshift from a lugging engine while the lever asks for more, is not tried again soon.
    choice_.shifted(*cal_, done ? !up && s.lever >= shift_.from() : up);
    pressure_ = c.pressure[static_cast<std::size_t>(clutch_of(gear_))];
    if (std::abs(slip_of(*cal_, s, gear_)) < cal_->limp.slip) {
        enter(Mode::driving);
    } else {
        // Take the old gear back as if starting off in it; if the tractor has slowed down meanwhile, a lower one.
        begin_launch(s, up ? std::min(gear_, choice_.starting(*cal_, s)) : gear_);
    }
}

// After a shift the speed asked for comes down until the engine pushes no more, or until it is the speed that the engine had
// before: from there on the driver's throttle would have it no slower.
double Controller::give_back_engine(const Sensors& s) SHIFTRIG_REALTIME {
    if (engine_request_ == 0 || mode_ != Mode::driving || s.engine_torque <= 0) return 0;
    const double request = engine_request_ - cal_->shift.engine_return * cal_->period;
    return request > engine_before_ ? request : 0;
}

// ---- limp ---------------------------------------------------------------------------------------------------

// Speeds, engine and lever must be heard; and in gear, a shaft that reads as standing while the other turns is a lost
// sensor, not a slip.
bool Controller::trusts(const Sensors& s) SHIFTRIG_REALTIME {
    if (!s.speeds_alive || !s.engine_alive || !s.lever_alive) return false;
    if (gear_ == 0 || mode_ == Mode::launch || std::abs(slip_of(*cal_, s, gear_)) < cal_->limp.slip)
        return true;
    const bool one_stands =
        std::abs(s.input_speed) < cal_->limp.sensor_zero || std::abs(s.output_speed) < cal_->limp.sensor_zero;
    return !one_stands;
}

void Controller::limp(const Sensors& s, Commands& c) SHIFTRIG_REALTIME {
    const bool let_go = (s.lever_alive && s.lever == 0) || (s.engine_alive && would_stall(s));
    if (let_go) gear_ = 0;
    if (gear_ != 0) {
        pressure_ = cal_->clutch.full_pressure;
        c.pressure[static_cast<std::size_t>(clutch_of(gear_))] = pressure_;
    }
    if (trusted_ >= cal_->limp.recovery_time) enter(gear_ != 0 ? Mode::driving : Mode::neutral);
}

}  // namespace shiftrig::tcu
