#include "apps/tcu/node.h"

#include <cmath>
#include <initializer_list>

#include "io/input_error.h"

namespace shiftrig::tcu {

namespace {

bus::Options options_for(const Calibration& calibration) {
    bus::Options options;
    options.role = bus::Role::controller;
    options.tick_ns =
        std::llround(calibration.period * 1e9);  // everything that is due goes out with the commands
    return options;
}

// The statuses of those of the named messages that this bus knows.
std::vector<int> statuses(const io::SignalTable& signals, std::initializer_list<const char*> messages) {
    std::vector<int> found;
    for (const char* message : messages)
        if (const int index = signals.find(std::string("bus.") + message + ".status"); index >= 0)
            found.push_back(index);
    return found;
}

// Alive or a little late; silent, corrupt or never seen otherwise.
bool heard(const std::vector<int>& statuses, const io::SignalTable& signals) SHIFTRIG_REALTIME {
    for (const int status : statuses) {
        const double value = signals.value[static_cast<std::size_t>(status)];
        if (value != 1 && value != 2) return false;
    }
    return !statuses.empty();
}

}  // namespace

Node::Node(const Calibration& calibration, const std::string& bus, const io::can::Mapping* mapping,
           bool lockstep)
    : calibration_(calibration),
      controller_(calibration_),
      bus_(bus, mapping, signals_, options_for(calibration)),
      lockstep_(lockstep) {
    find_signals();
}

Node::Node(const Calibration& calibration, const std::string& bus, io::can::CanPort& port,
           const io::can::Mapping& mapping)
    : calibration_(calibration),
      controller_(calibration_),
      bus_(bus, port, mapping, signals_, options_for(calibration)),
      lockstep_(false) {
    find_signals();
}

void Node::find_signals() {
    const auto at = [&](const std::string& name) {
        const int index = signals_.find(name);
        if (index < 0)
            throw io::InputError(bus_.name() + ": the bus does not carry " + name +
                                 ", which the controller needs");
        return index;
    };
    at_.engine_speed = at("sensor.engine.speed");
    at_.disc_speed = at("sensor.disc.speed");
    at_.input_speed = at("sensor.input.speed");
    at_.output_speed = at("sensor.output.speed");
    at_.engine_torque = at("engine.engine.torque");
    at_.lever = at("driver.lever");
    at_.automatic = at("driver.auto");
    at_.brake = at("driver.brake");
    at_.clutch_pedal = at("driver.clutch_pedal");
    at_.parking_brake = at("driver.parking_brake");
    static constexpr std::array names = {"F1", "F2", "F3", "F4", "FR"};
    for (std::size_t i = 0; i < clutch_count; ++i) {
        at_.pressure[i] = at("clutch." + std::string(names[i]) + ".pressure");
        at_.pressure_command[i] = at("clutch." + std::string(names[i]) + ".pressure_command");
    }
    at_.main_release = at("clutch.Fc.release_command");
    // What the controller says of itself; a bus need not carry it.
    at_.selected_gear = signals_.find("controller.selected_gear");
    at_.current_gear = signals_.find("controller.current_gear");
    at_.shift_in_process = signals_.find("controller.shift_in_process");
    at_.limp = signals_.find("controller.limp");
    at_.driveline_engaged = signals_.find("controller.driveline_engaged");
    at_.told_input_speed = signals_.find("controller.input_speed");
    at_.told_output_speed = signals_.find("controller.output_speed");
    at_.speed_request_enable = signals_.find("engine.engine.speed_request_enable");
    at_.speed_request = signals_.find("engine.engine.speed_request");
    // The engine's torque is not limited.
    if (const int limit = signals_.find("engine.engine.torque_limit"); limit >= 0)
        signals_.value[static_cast<std::size_t>(limit)] = 1;

    // The messages of CAN and of LCM that carry what the controller cannot do without.
    speed_statuses_ = statuses(signals_, {"ShaftSpeedsA", "ShaftSpeedsB", "speeds"});
    engine_statuses_ = statuses(signals_, {"EEC1", "speeds"});
    lever_statuses_ = statuses(signals_, {"TC1", "driver_input"});
    pressure_statuses_ = statuses(signals_, {"ClutchFeedbackA", "ClutchFeedbackB", "speeds"});

    period_ns_ = std::llround(calibration_.period * 1e9);
    last_rig_time_ns_ = -period_ns_;
}

Sensors Node::sense() const SHIFTRIG_REALTIME {
    const auto get = [&](int index) { return signals_.value[static_cast<std::size_t>(index)]; };
    Sensors s;
    s.engine_speed = get(at_.engine_speed);
    s.disc_speed = get(at_.disc_speed);
    s.input_speed = get(at_.input_speed);
    s.output_speed = get(at_.output_speed);
    s.engine_torque = get(at_.engine_torque);
    for (std::size_t i = 0; i < clutch_count; ++i) s.pressure[i] = get(at_.pressure[i]);
    s.lever = static_cast<int>(get(at_.lever));
    s.automatic = get(at_.automatic) > 0.5;
    s.brake = get(at_.brake);
    s.clutch_pedal = get(at_.clutch_pedal);
    s.parking_brake = get(at_.parking_brake) > 0.5;
    s.speeds_alive = heard(speed_statuses_, signals_);
    s.engine_alive = heard(engine_statuses_, signals_);
    s.lever_alive = heard(lever_statuses_, signals_);
    s.pressures_alive = heard(pressure_statuses_, signals_);
    return s;
}

void Node::say(const Sensors& sensors) SHIFTRIG_REALTIME {
    const auto set = [&](int index, double value) {
        if (index >= 0) signals_.value[static_cast<std::size_t>(index)] = value;
    };
    for (std::size_t i = 0; i < clutch_count; ++i) set(at_.pressure_command[i], commands_.pressure[i]);
    set(at_.main_release, commands_.main_release);
    set(at_.speed_request_enable, commands_.engine_speed_request > 0);
    set(at_.speed_request, commands_.engine_speed_request);
    set(at_.selected_gear, commands_.selected_gear);
    set(at_.current_gear, commands_.current_gear);
    set(at_.shift_in_process, commands_.shifting);
    set(at_.limp, commands_.mode == Mode::limp);
    set(at_.driveline_engaged, commands_.engaged);
    set(at_.told_input_speed, sensors.input_speed);
    set(at_.told_output_speed, sensors.output_speed);
}

void Node::tick(std::int64_t now_ns) SHIFTRIG_REALTIME {
    if (lockstep_) now_ns = counted_ns_;
    bus_.receive(now_ns, signals_);
    const bool asked = bus_.question_pending();
    if (cycle_is_due(asked, now_ns)) {
        const Sensors sensors = sense();
        commands_ = controller_.step(sensors);
        say(sensors);
    }
    if (asked && lockstep_) now_ns = counted_ns_ += period_ns_;
    if (commands_.mode != Mode::listening || asked) bus_.send(now_ns, signals_);
}

void Node::restart() SHIFTRIG_REALTIME {
    controller_ = Controller(calibration_);
    commands_ = Commands{};
}

bool Node::cycle_is_due(bool asked, std::int64_t now_ns) SHIFTRIG_REALTIME {
    // LCM asks every tick, and says what time it is there: cycles stand on the grid of that time, however late a question
    // is heard. CAN asks once a cycle.
    const auto rig_time = bus_.rig_time_ns();
    const bool new_cycle = !rig_time || *rig_time / period_ns_ != last_rig_time_ns_ / period_ns_;
    const bool unasked_for_long = !lockstep_ && now_ns - last_cycle_ns_ >= 2 * period_ns_;
    if (!(asked && new_cycle) && !unasked_for_long) return false;
    last_rig_time_ns_ = rig_time.value_or(0);
    last_cycle_ns_ = now_ns;
    return true;
}

}  // namespace shiftrig::tcu
