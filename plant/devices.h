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

// Sum of magnitudes behind a slip (of rates: behind its acceleration), not less than 1: what its rounding errors are relative to.
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

// ---- limits of a pair: −static_limit(−1) ≤ M ≤ static_limit(+1) while it is locked

// Is that the sense, of torque or slip, in which it holds less than in the other?
inline bool is_weak(const ModelData& m, int pair, double sense) noexcept {
    return m.pair_laws[static_cast<std::size_t>(pair)].weak_sense * sense > 0;
}
// What it holds in this sense of its torque [Nm]; 0 asks for the stronger one.
inline double static_limit(const ModelData& m, int pair, double sense, const Sample& s) noexcept {
    return is_weak(m, pair, sense) ? s.load[pair] * m.pair_laws[static_cast<std::size_t>(pair)].weak_factor
                                   : s.holding[pair];
}
// What it passes on once it slips in this sense [Nm].
inline double sliding_limit(const ModelData& m, int pair, double sense, const Sample& s) noexcept {
    return is_weak(m, pair, sense) ? s.load[pair] * m.pair_laws[static_cast<std::size_t>(pair)].weak_factor
                                   : s.sliding[pair];
}
// What it holds in the sense of its torque.
inline double static_limit(const Work& w, int pair, const Sample& s) noexcept {
    return static_limit(w.model, pair, s.torque[pair], s);
}
// How far its torque is from the nearer limit [Nm]; negative: beyond it.
inline double static_margin(const Work& w, int pair, const Sample& s) noexcept {
    const double torque = s.torque[pair];
    return std::min(static_limit(w.model, pair, 1, s) - torque, static_limit(w.model, pair, -1, s) + torque);
}
// The sense in which a locked pair would slip at this torque: the limit in that sense is the nearer one. Where both limits
// are alike, that is the sense of the torque.
inline double opening_sense(const Work& w, int pair, double torque, const Sample& s) noexcept {
    if (const signed char onward = w.scratch.onward[static_cast<std::size_t>(pair)]; onward != 0)
        return onward;
    const double difference = static_limit(w.model, pair, 1, s) - static_limit(w.model, pair, -1, s);
    return 2 * torque < difference ? -1 : 1;
}

constexpr double at_its_limit =
    1e-5;  // of the limit: what a pair that gives way is from it at most, well above rounding

// Of a locked pair ([Algin] eq. (12)). Capacities may be as small as the rounding of torques, and what came to hold in this
// instant what it pushed with may be wrong by as much as the instant is.
inline bool is_overloaded(const Work& w, int pair, const Sample& s) {
    if (pair < 0) return false;
    const double torque = std::fabs(s.torque[pair]), limit = static_limit(w, pair, s);
    const double most = w.scratch.eased[static_cast<std::size_t>(pair)] ? 1 + at_its_limit : overload;
    return torque > most * limit && torque > 1e-11 * torque_scale(w, s);
}

}  // namespace shiftrig::plant::detail
