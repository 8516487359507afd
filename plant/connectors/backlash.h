// Elastic shaft with play between a and b: two flanks at the twists ±δ, elastic and damped, that press and never pull.
//
//     open        M = 0
//     flank ±1    M = k (φ ∓ δ) + d φ̇,   ± M ≥ 0
//     a flank closes where ±φ reaches δ; where its damping has left it behind (±φ > δ, still receding), where M > 0 again
//     a flank opens where M reaches 0
//
//   M     torque on the first link, from a into the shaft       Nm
//   φ     twist, φ̇ = ω_a − ω_b, 0 in the middle of the play     rad
//   δ     half of the play                                      rad, > 0
//   k     stiffness of the closed flanks                        Nm/rad, > 0
//   d     damping of the closed flanks                          Nm s/rad, ≥ 0
//
//     stored energy ½ k (φ ∓ δ)² while closed, 0 while open
//
// Each state is linear: k and d belong to the mode, ±kδ is a constant force. With d = 0 the energy of a mass that bounces
// is conserved; with d > 0 the torque jumps to d φ̇ at the first touch, and what the spring still holds when the flank
// opens is lost in its damper. All of M is max(0, …) of the twist and its rate, with no memory.
// Source: Kelvin–Voigt flanks with the adhesion cut off, as in Hunt and Crossley's discussion of impact damping.
// Does not model: damping that grows with the penetration, friction and oil film in the play, gear errors.
#pragma once

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "plant/connectors/connector.h"

namespace shiftrig::plant {

// Elastic shaft with play: within the gap it passes on nothing.
struct Backlash {
    std::string name, a, b;    // b empty: to the housing
    double stiffness = 0;      // of the closed flanks [Nm/rad], > 0
    double damping = 0;        // of the closed flanks [Nm s/rad], ≥ 0
    double gap = 0;            // the whole play [rad], > 0
    double initial_twist = 0;  // [rad], positive where a is ahead of b; 0: in the middle of the play
};

// ---- the law

struct BacklashLaw {
    int shaft = -1;                                   // among Structure::shafts, and so its twist
    int device = -1;                                  // contact byte
    int force = -1;                                   // in f: ∓kδ
    double stiffness = 0, damping = 0, half_gap = 0;  // k [Nm/rad], d [Nm s/rad], δ [rad]
};

// M of the closed flank `side` = ±1 [Nm].
inline double flank_torque(const BacklashLaw& law, double side, double twist, double rate) noexcept {
    return law.stiffness * (twist - side * law.half_gap) + law.damping * rate;
}

// What a closed flank has left until it opens, and an open one until it closes [Nm].
inline double closed_margin(const BacklashLaw& law, double side, double twist, double rate) noexcept {
    return side * flank_torque(law, side, twist, rate);
}
inline double open_margin(const BacklashLaw& law, double side, double twist, double rate) noexcept {
    return law.stiffness * (law.half_gap - side * twist) + std::max(0., -side * law.damping * rate);
}

inline double flank_energy(const BacklashLaw& law, double side, double twist) noexcept {
    const double pressed = twist - side * law.half_gap;
    return side == 0 ? 0 : 0.5 * law.stiffness * pressed * pressed;
}

// ---- what it answers (connector.h)

inline const char* kind(const Backlash&) {
    return "backlash";
}
inline std::array<End, 2> ends(const Backlash& c) {
    return {End{"a", c.a},
            End{.field = "b", .mass = c.b, .may_be_housing = true, .motion = EndMotion::alike}};
}
void check_parameters(const Check& check, const Backlash& device);
void assemble(Assembly& assembly, const Backlash& device);
void name_outputs(detail::ModelBuilder& builder, const std::vector<Backlash>& devices);
double* show(const detail::Shown& at, const std::vector<Backlash>& devices, double* next) SHIFTRIG_REALTIME;
std::string in_words(const Backlash& device, const Event& event);

}  // namespace shiftrig::plant
