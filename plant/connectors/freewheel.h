// One-way clutch (freewheel, sprag or roller clutch) between a and b: it joins both in one sense of the slip
// Δω = ω_a − ω_b, the blocked one, and lets them go in the other.
//
//     locked        Δω = 0        −M_D ≤ s M ≤ M_R
//     overrunning   s Δω < 0      M = −s M_D
//     overloaded    s Δω > 0      M = s α M_R
//
//   M     torque on the first link, from a into the freewheel   Nm
//   Δω    slip, a minus b                                       rad/s
//   s     blocked sense of Δω                                   +1 a cannot run ahead of b, −1 a cannot fall behind
//   M_R   rated torque: the static capacity in that sense       Nm, > 0
//   α     share of it that is left while overloaded rollers slip   1, in (0, 1]
//   M_D   drag while overrunning                                Nm, ≥ 0
//
// A friction pair ([Algin] §4) whose capacities depend on the sign: with M_R = M_D and α = 1 it is a Coulomb clutch,
// with M_D = 0 a ratchet of infinitely many teeth. The torque is continuous where it lets go, so the instant of that
// needs no more than a step's order; where it locks, the slip changes sign.
// Does not model: elasticity of rollers and races (put a shaft beside it), the angle until the rollers grip, drag that
// depends on speed, sprags that lift off, damage by an overload.
#pragma once

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "plant/connectors/connector.h"

namespace shiftrig::plant {

// One-way clutch (freewheel, sprag) between a and b, with b empty to the housing. It does not let
// ω_a − ω_b go in the sense it blocks: forward, a cannot run ahead of b; backward, a cannot fall behind.
enum class Sense { forward, backward };

struct Freewheel {
    std::string name, a, b;
    Sense blocks = Sense::forward;
    double rated_torque = 0;   // held in the blocked sense [Nm], > 0
    double sliding_share = 0;  // of it that is left while the overloaded freewheel slips, in (0, 1]
    double drag_torque = 0;    // while overrunning [Nm], ≥ 0
};

// ---- the law

inline double blocked_sense(const Freewheel& f) noexcept {  // s
    return f.blocks == Sense::forward ? 1 : -1;
}

// What is left until a locked freewheel at torque M changes its state [Nm]; negative: beyond it.
inline double freewheel_margin(const Freewheel& f, double torque) noexcept {
    const double blocked = blocked_sense(f) * torque;
    return std::min(f.rated_torque - blocked, f.drag_torque + blocked);
}

// Is the limit next to torque M the one at which it begins to overrun?
inline bool is_next_to_overrun(const Freewheel& f, double torque) noexcept {
    const double blocked = blocked_sense(f) * torque;
    return f.drag_torque + blocked < f.rated_torque - blocked;
}

// ---- what it answers (connector.h)

inline const char* kind(const Freewheel&) {
    return "freewheel";
}
inline std::array<End, 2> ends(const Freewheel& c) {
    return {End{"a", c.a},
            End{.field = "b", .mass = c.b, .may_be_housing = true, .motion = EndMotion::alike}};
}
inline bool may_be_closed(const Freewheel&) {
    return true;
}
void check_parameters(const Check& check, const Freewheel& device);
void assemble(Assembly& assembly, const Freewheel& device);
void add_pair_law(detail::ModelBuilder& builder, const Freewheel& device);
void name_outputs(detail::ModelBuilder& builder, const std::vector<Freewheel>& devices);
double* show(const detail::Shown& at, const std::vector<Freewheel>& devices, double* next) SHIFTRIG_REALTIME;
std::string in_words(const Freewheel& device, const Event& event);
const char* beyond_limit(const Freewheel& device, double torque, double tolerance);

}  // namespace shiftrig::plant
