// What outputs are made from: the end of a step. Internal to plant/.
#pragma once

#include "plant/forces.h"

namespace shiftrig::plant::detail {

struct Shown {
    const Work& work;
    const Sample& sample;

    const ModelData& model() const noexcept { return work.model; }
    // Of a kind whose devices are friction pairs: the pair of the first one, those of the others follow.
    template <class Kind>
    int first_pair(const std::vector<Kind>&) const noexcept {
        return model().first_pair[place_of<Kind>];
    }
    // What a friction pair passes on at this instant, on its first link [Nm]: its internal torque where it is locked,
    // its force where it slips.
    double passed(int pair) const noexcept {
        return work.contact[pair] == locked ? sample.torque[pair] : sample.f[pair];
    }
    double slip(int pair) const noexcept {  // [rad/s]
        return slip_fast(model().pair_slip[static_cast<std::size_t>(pair)], sample.z);
    }
    // Which way power goes through a mesh that loses nothing.
    double flow(int mesh) const noexcept {
        const double motion = slip_fast(model().mesh_motion[static_cast<std::size_t>(mesh)], sample.z);
        return sample.torque[model().pairs + mesh] * motion < 0 ? -1 : 1;
    }
    // Friction heat of a pair since start [J].
    double heat(int pair) const noexcept { return work.state[model().layout.heat + pair]; }
};

}  // namespace shiftrig::plant::detail
