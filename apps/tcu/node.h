// The controller as a node on a bus: signals in, one control cycle, signals out. It knows messages and nothing else; the
// same class runs inside the rig (in-process bus) and in the program shiftrig-tcu.
#pragma once

#include <cstdint>
#include <string>

#include "apps/bus/bus.h"
#include "apps/tcu/controller.h"

namespace shiftrig::tcu {

class Node {
  public:
    // In lockstep time is counted by the rig's questions, and `now_ns` ignored. Throws what bus::Bus throws, and
    // InputError if the bus does not carry what the controller needs.
    Node(const Calibration& calibration, const std::string& bus, const io::can::Mapping* mapping,
         bool lockstep);
    // On an end of the in-process bus, where time is the rig's anyway.
    Node(const Calibration& calibration, const std::string& bus, io::can::CanPort& port,
         const io::can::Mapping& mapping);

    // Hears what has come by `now_ns`, steps the controller when its cycle is due, says what is due. To be called every
    // millisecond or when something arrives. A cycle is due when the rig asks (its feedback frame A, the speeds message
    // on LCM), and by the clock if nobody has asked for long.
    void tick(std::int64_t now_ns) SHIFTRIG_REALTIME;

    // As if the controller had been switched off and on again: it forgets everything.
    void restart() SHIFTRIG_REALTIME;

    // Another calibration of the same machine and cycle, from the next cycle on.
    void recalibrate(const Calibration& calibration) { calibration_ = calibration; }

    void archive(io::Archive& a) {
        controller_.archive(a);
        bus_.archive(a);
        a(signals_.value, commands_, last_cycle_ns_, last_rig_time_ns_, counted_ns_);
    }

    const Controller& controller() const noexcept { return controller_; }
    const Commands& commands() const noexcept { return commands_; }
    bus::Bus& bus() noexcept { return bus_; }

  private:
    struct Indices {
        int engine_speed, disc_speed, input_speed, output_speed, engine_torque;
        std::array<int, clutch_count> pressure, pressure_command;
        int lever, automatic, brake, clutch_pedal, parking_brake;
        int main_release;
        int selected_gear, current_gear, shift_in_process, limp,
            driveline_engaged;  // −1: the bus does not carry it
        int told_input_speed, told_output_speed;
        int speed_request_enable, speed_request;
    };
    void find_signals();
    Sensors sense() const SHIFTRIG_REALTIME;
    void say(const Sensors& sensors) SHIFTRIG_REALTIME;
    bool cycle_is_due(bool asked, std::int64_t now_ns) SHIFTRIG_REALTIME;

    Calibration calibration_;
    Controller controller_;
    io::SignalTable signals_;
    bus::Bus bus_;
    Indices at_{};
    std::vector<int> speed_statuses_, engine_statuses_, lever_statuses_, pressure_statuses_;
    Commands commands_;
    const bool lockstep_;
    std::int64_t period_ns_ = 0, last_cycle_ns_ = 0, last_rig_time_ns_ = 0;
    std::int64_t counted_ns_ = 0;  // lockstep: the questions' time
};

}  // namespace shiftrig::tcu
