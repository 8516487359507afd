// Which gear is wanted: what the lever asks for, one step at a time, less what the engine could not bear.
//
// An upshift from ratio u to u' keeps the load on the output, so the engine would have to carry T u/u' at the speed
// ω u'/u. It is refused where that is more than a share of the full-load curve there; and if the engine lugs after
// all (load at its limit, speed below the curve's useful part), one gear is taken back and the upshift stays refused
// for a while.
#pragma once

#include "apps/tcu/machine.h"

namespace shiftrig::tcu {

class GearChoice {
  public:
    // Once a cycle, while the sensors are to be trusted: keeps the estimates up to date.
    void observe(const Calibration& cal, const Sensors& s) SHIFTRIG_REALTIME;
    // The gear to start off in, at rest or in motion; 0 if the lever wants none.
    int starting(const Calibration& cal, const Sensors& s) const SHIFTRIG_REALTIME;
    // The gear to go to from `gear`; equal to it if nothing is to be done, 0 to open the driveline.
    int next(const Calibration& cal, const Sensors& s, int gear) const SHIFTRIG_REALTIME;
    // A shift ended; if it failed, or the engine lugged, none upwards for the refusal time.
    void shifted(const Calibration& cal, bool refuse_upshifts) SHIFTRIG_REALTIME;

  private:
    bool engine_bears(const Calibration& cal, const Sensors& s, int from, int to) const SHIFTRIG_REALTIME;

    bool observed_ = false;
    double torque_ = 0;       // filtered [Nm]
    double lugging_ = 0;      // for so long [s]
    double refused_for_ = 0;  // no upshift for so long [s]
    double pause_ = 0;        // no shift at all for so long [s]
};

}  // namespace shiftrig::tcu
