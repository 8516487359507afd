// What contact bytes are about: slips, scales and laws of single devices, for all who ask after their states. Internal to
// plant/.
#pragma once

#include <algorithm>
#include <cmath>

#include "plant/forces.h"

namespace shiftrig::plant::detail {

constexpr double at_rest = 1e-9;       // a pair that engages at less slip than this closes at once [rad/s]
constexpr double overload = 1 + 1e-9;  // torque over capacity that opens a closed pair

inline const std::array<Link, 2>& pair_links(const Work& w, int pair) {
    return w.model.structure.pairs[static_cast<std::size_t>(pair)].links;
}
inline const Mesh& mesh_of(const Work& w, int mesh) {
    return w.model.structure.meshes[static_cast<std::size_t>(mesh)];
}

// The slip that a contact byte is about.
inline double device_slip(const Work& w, int device, const double* speeds) {
    const ModelData& m = w.model;
    return device < m.pairs ? slip_fast(m.pair_slip[static_cast<std::size_t>(device)], speeds)
                            : slip_fast(m.mesh_motion[static_cast<std::size_t>(device - m.pairs)], speeds);
}

// Sum of magnitudes behind a slip: what its rounding errors are relative to.
inline double slip_scale(const Work& w, int device, const double* speeds) {
    const std::array<Link, 2> links =
        device < w.model.pairs ? pair_links(w, device) : mesh_of(w, device - w.model.pairs).motion();
    double scale = 1;
    for (const Link& link : links) {
        if (link.mass >= 0) scale += std::fabs(link.factor * speeds[link.mass]);
    }
    return scale;
}

inline double torque_scale(const Work& w, const Sample& s) {
    double scale = 0;
    for (int k = 0; k < w.model.torques; ++k) scale = std::max(scale, std::fabs(s.torque[k]));
    for (int k = 0; k < w.model.first_flank_force; ++k) scale = std::max(scale, std::fabs(s.f[k]));
    return scale;
}

// What changes in the loss when power turns round, per torque.
inline double loss_difference(const Mesh& mesh) {
    return 1 / mesh.backward_efficiency - mesh.forward_efficiency;
}

// Torque at which the two loss lines of a mesh cross: below it the second link drives.
inline double loss_kink(const Work& w, int mesh, double sign) {
    return sign * w.model.loss_kink[static_cast<std::size_t>(mesh)];
}

// Of a locked pair ([Algin] eq. (12)). Capacities may be as small as the rounding of torques.
inline bool is_overloaded(const Work& w, int pair, const Sample& s) {
    if (pair < 0) return false;
    const double torque = std::fabs(s.torque[pair]);
    return torque > overload * static_limit(w, pair, s) && torque > 1e-11 * torque_scale(w, s);
}

// The law of a pair that is a freewheel, else none.
inline const FreewheelLaw* freewheel_of(const Work& w, int pair) {
    const int index = w.model.pair_laws[static_cast<std::size_t>(pair)].freewheel;
    return index < 0 ? nullptr : &w.model.freewheels[static_cast<std::size_t>(index)];
}

// The sense in which a locked pair begins to slip: that of its torque. A freewheel that lets go does so at next to none.
inline double opening_sense(const Work& w, int pair, double torque) {
    const FreewheelLaw* law = freewheel_of(w, pair);
    if (!law) return torque;
    return is_next_to_overrun(*law, torque) ? -law->sense : law->sense;
}

}  // namespace shiftrig::plant::detail
