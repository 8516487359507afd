#include "plant/wedged.h"

#include <algorithm>

#include "plant/devices.h"
#include "plant/settling.h"

namespace shiftrig::plant::detail {
namespace {

// Its torque beyond what it passes, with the contact states in scratch.trial, or that of another one in a loop beyond what it holds.
// No loop of closed devices would share its load, but the losses of a mesh at rest, or there is no split of the torques: as
// if all were too much.
double trial_excess(Work& w, int pair, Sample& s) {
    unsigned char* const trial = w.scratch.trial.data();
    contact_forces(w, trial, s);
    const auto [mode, agrees] = try_directions(w, trial, s);
    const double sense = slip_sign(w.contact[pair]), limit = sliding_limit(w.model, pair, sense, s);
    if (!agrees || (mode.bound[pair] & shares_load) == 0) return limit;
    double most = sense * s.torque[pair] - limit;
    for (int k = 0; k < w.model.pairs; ++k) {
        if (k != pair && trial[k] == locked && (mode.bound[k] & shares_load) != 0)
            most = std::max(most, -static_margin(w, k, s));
    }
    return most;
}

}  // namespace

double wedged_excess(Work& w, const Mode& mode, int pair, Sample& s) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    unsigned char* const trial = w.scratch.trial.data();
    const auto lock = [&] {
        std::copy(w.contact, w.contact + m.contact_bytes, trial);
        trial[pair] = locked;
    };
    lock();
    double most = trial_excess(w, pair, s);
    // A mesh at rest may share the load the other way round as well.
    for (const int k : m.lossy_meshes) {
        const int device = m.pairs + k;
        if (most > 0 || !mode.bound[device] || w.contact[device] == stuck) continue;
        const double turned = -motion_sign(w.contact[device]);
        lock();
        trial[device] = moving(turned, s.torque[device] * turned < 0 ? -1 : 1);
        most = std::max(most, trial_excess(w, pair, s));
    }
    contact_forces(w, w.contact, s);
    internal_torques(w, mode, s);
    return most;
}

bool may_hold(Work& w, const Mode& mode, int pair, Sample& s) SHIFTRIG_REALTIME {
    const double excess = wedged_excess(w, mode, pair, s);
    return excess < -1e-9 * s.sliding[pair] && excess < -1e-11 * torque_scale(w, s);
}

}  // namespace shiftrig::plant::detail
