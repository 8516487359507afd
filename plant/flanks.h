// Flanks of shafts with play (connectors/backlash.h): when they open and close. Internal to plant/.
#pragma once

#include "plant/forces.h"

namespace shiftrig::plant::detail {

inline const BacklashLaw& backlash_of(const Work& w, int device) {
    return w.model.backlashes[static_cast<std::size_t>(device - w.model.first_flank)];
}

// In torque: what a closed flank still presses with, how far the nearer of two open ones is from pressing [Nm].
double flank_margin(const Work& work, const BacklashLaw& law, const Sample& sample) SHIFTRIG_REALTIME;
// The same half way through a part, of which only coordinates and slips are there.
double flank_margin_half_way(const Work& work, const BacklashLaw& law) SHIFTRIG_REALTIME;

// The flank that opens or closes first before `end`, where one is violated: which of two open ones it is, no margin at the
// beginning tells. Its margin along the part is smooth, that of the nearer one is not.
struct Flank {
    const BacklashLaw& law;
    double side;
    bool closed;
};
Flank violated_flank(const Work& work, const BacklashLaw& law, const Sample& end) SHIFTRIG_REALTIME;
double margin_of(const Work& work, const Flank& flank, const Sample& sample) SHIFTRIG_REALTIME;
double margin_half_way(const Work& work, const Flank& flank) SHIFTRIG_REALTIME;
// Wants the sample's rates [Nm/s].
double margin_rate(const Work& work, const Flank& flank, const Sample& sample) SHIFTRIG_REALTIME;

// Of a margin [Nm].
inline double flank_rounding(const BacklashLaw& law) noexcept {
    return 1e-12 * (law.stiffness * law.half_gap + law.damping);
}
// Not by rounding: a tooth at rest that touches without load stays as it is.
inline bool is_flank_violated(const BacklashLaw& law, double margin) noexcept {
    return margin < -flank_rounding(law);
}
bool is_flank_violated(const Work& work, const BacklashLaw& law, const Sample& sample) SHIFTRIG_REALTIME;
// Where between begin and end an open play has its widest twist within the part, if that is beyond a flank which does not
// press any more at the end; 1: nowhere. The twist is taken as the cubic through both ends.
double touch_between(const Work& work, const BacklashLaw& law, const Sample& begin,
                     const Sample& end) SHIFTRIG_REALTIME;
bool flanks_hold(const Work& work, const Sample& end) SHIFTRIG_REALTIME;

// May a closed flank let go and press again between the samples of the part? What the cubic through both ends does not show of the
// twist would be enough for it.
bool may_let_go_between(const Work& work, const BacklashLaw& law) SHIFTRIG_REALTIME;

// Strain of a flank that opens is lost in its damper; what it has where it closes, by as much as that is beside the
// very instant, is booked with its sign.
void change_flank(Work& work, const BacklashLaw& law, Sample& sample) SHIFTRIG_REALTIME;

}  // namespace shiftrig::plant::detail
