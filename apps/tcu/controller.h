// The reference shift controller: sensors in, clutch commands out, once every control cycle. It has no clock but
// its cycle count, opens no bus and knows nothing of the bench; node.h puts it on a bus.
//
// It is meant to be read, and to be the start of your own. The state of the driveline is one of
//
//   listening not everything was heard yet: what is closed stays closed, and a gear found locked is taken over
//   neutral   nothing closed; waits for a lever and an engine that can start off
//   launch    one clutch slips until input and output run together (standing start, shuttle, restart in motion)
//   driving   one clutch locked at full pressure
//   shift     one clutch hands over to another (shift.h)
//   limp      signals are missing: the gear that was locked is held, anything half done is opened
#pragma once

#include <array>

#include "apps/tcu/calibration.h"
#include "apps/tcu/gear_choice.h"
#include "apps/tcu/machine.h"
#include "apps/tcu/shift.h"
#include "io/archive.h"

namespace shiftrig::tcu {

class Controller {
  public:
    // The calibration must outlive the controller. Everything else is its state: a copy is a snapshot.
    explicit Controller(const Calibration& calibration) noexcept : cal_(&calibration) {}

    // One control cycle. Never throws, allocates or blocks. While the mode is `listening` they are better not sent,
    // unless somebody waits for them.
    Commands step(const Sensors& sensors) SHIFTRIG_REALTIME;

    Mode mode() const noexcept { return mode_; }

    void archive(io::Archive& a) {
        Controller copy = *this;
        copy.cal_ = nullptr;  // an address means nothing to another run
        a(copy);
        copy.cal_ = cal_;
        *this = copy;
    }

  private:
    void listen(const Sensors& s) SHIFTRIG_REALTIME;
    void hold_as_found(const Sensors& s, Commands& c) SHIFTRIG_REALTIME;
    void neutral(const Sensors& s, Commands& c) SHIFTRIG_REALTIME;
    void launch(const Sensors& s, Commands& c) SHIFTRIG_REALTIME;
    void driving(const Sensors& s, Commands& c) SHIFTRIG_REALTIME;
    void shift(const Sensors& s, Commands& c) SHIFTRIG_REALTIME;
    void limp(const Sensors& s, Commands& c) SHIFTRIG_REALTIME;

    void enter(Mode mode) SHIFTRIG_REALTIME;
    double give_back_engine(const Sensors& s) SHIFTRIG_REALTIME;
    void begin_launch(const Sensors& s, int gear) SHIFTRIG_REALTIME;
    bool may_start_off(const Sensors& s, int gear) const SHIFTRIG_REALTIME;
    void watch_engine(const Sensors& s) SHIFTRIG_REALTIME;
    bool would_stall(const Sensors& s) const SHIFTRIG_REALTIME;
    bool trusts(const Sensors& s) SHIFTRIG_REALTIME;

    const Calibration* cal_;
    GearChoice choice_;
    Mode mode_ = Mode::listening;
    int gear_ = 0;               // that is locked, or being launched in; 0 none
    double in_mode_ = 0;         // time since the mode was entered [s]
    double engine_speed_ = 0;    // in the last cycle [rad/s]
    double engine_slowing_ = 0;  // filtered, ≤ 0 [rad/s²]
    double slipping_ = 0;        // slip in gear at full pressure for so long [s]
    double trusted_ = 0;         // signals believable for so long [s]
    int failed_lever_ = 0;       // where the lever stood when an engagement failed: not again until it moves
    Fill fill_;
    SlipWatch slip_;
    bool by_main_clutch_ = false;  // the launch slips the main clutch, else the gear's own
    double launch_speed_ = 0;      // of the engine when the launch began [rad/s]
    double launch_torque_ = 0;     // capacity asked for [Nm]
    double pressure_ = 0;          // commanded to the gear's clutch in launch and driving [Pa]
    double engine_request_ = 0;    // asked of the engine [rad/s]; 0: nothing
    double engine_before_ = 0;     // its speed when the shift began, under the driver's throttle [rad/s]
    Shift shift_;
};

}  // namespace shiftrig::tcu
