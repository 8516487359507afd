// One change of gear under load: torque is handed from the offgoing to the oncoming clutch, and the input side is
// brought to the speed of the new gear. Which of the two comes first follows from who can do the work:
//
//   the oncoming clutch pulls (power upshift, coast downshift): the engine's torque T works against the change of
//     speed, so the clutches hand over first, then the oncoming one, slipping, pulls the input to its new speed;
//   the engine leads (power downshift, coast upshift): T itself moves the input the right way, so the offgoing clutch
//     is let slip first, and the oncoming one takes over when the speeds meet.
//
// In both inertia phases one law sets the capacity of the clutch that slips. With ω the input's speed, ω' its speed
// in the new gear, J the input's inertia and t the time to go, the input must accelerate by (ω' − ω)/t, so the clutch
// must carry
//
//     T_c = T − J (ω' − ω)/t        in the direction of its slip, else nothing.
//
// Where the engine leads upwards, its governor would stop it at the speed the driver's throttle allows; so the new speed
// is asked of it by TSC1 until the shift is over, and then given back slowly (controller.cpp).
//
// T comes from the engine's own message, so the law follows the governor; t never falls below `shortest_to_go`, which
// bounds the gain of this loop against the lag of the valve.
#pragma once

#include "apps/tcu/machine.h"

namespace shiftrig::tcu {

class Shift {
  public:
    enum class Phase { fill, torque, inertia, closing, finished, abandoned };

    void begin(const Calibration& cal, const Sensors& s, int from, int to) SHIFTRIG_REALTIME;
    // One cycle; writes the pressures of both clutches.
    void step(const Calibration& cal, const Sensors& s, Commands& c) SHIFTRIG_REALTIME;
    // The driver changed his mind: while the offgoing clutch still holds, its gear is kept.
    void cancel() SHIFTRIG_REALTIME;

    int from() const noexcept { return from_; }
    int to() const noexcept { return to_; }
    Phase phase() const noexcept { return phase_; }
    // What the engine should run at now [rad/s]; 0: as the driver has it.
    double engine_speed_request(const Calibration& cal, const Sensors& s) const SHIFTRIG_REALTIME;
    bool over() const noexcept { return phase_ == Phase::finished || phase_ == Phase::abandoned; }

  private:
    void enter(Phase phase) SHIFTRIG_REALTIME;
    double slipping_capacity(const Calibration& cal, const Sensors& s, double slip) const SHIFTRIG_REALTIME;

    int from_ = 0, to_ = 0;
    bool pulls_ = true;      // the oncoming clutch pulls; else the engine leads
    double first_slip_ = 0;  // of the oncoming clutch when the shift began [rad/s]
    Phase phase_ = Phase::finished;
    double in_phase_ = 0;      // [s]
    double on_ = 0, off_ = 0;  // commands [Pa]
    double handed_over_ = 0;   // share of the torque phase that is done [1]
    Fill fill_;
    SlipWatch slip_;
};

}  // namespace shiftrig::tcu
