// Gears and natural frequencies of a machine: what `check` shows an engineer before anything turns.
//
//     J-orthonormal motions Q of the closed set:  q̈ + Qᵀ A_E D A_Eᵀ Q q̇ + Qᵀ A_E K A_Eᵀ Q q = 0
//
//   A_E   columns of shafts, dampers and tyres          1
//   K, D  their stiffness and damping                   Nm/rad, Nm s/rad
//   tyre  k = dF/dκ · r²/σ between wheel and body, the relaxed Brixius tyre at standstill (laws/tyre.h); damping k τ.
//         At a body speed V its twist leaks with the rate V/σ (damped modes only).
//
// Closed clutches and brakes are rigid, open ones transmit nothing; wheel contacts ([Algin] Fw) count as closed.
// Linear in small motion: flanks of shafts with play closed, no friction, loss-free meshes, converters and engines without stiffness.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "plant/description.h"
#include "plant/rigid_set.h"

namespace shiftrig::plant {

// ---- gears ----------------------------------------------------------------------------------------

// One row of the gear table: a gear path with one choice of every selectable ratio, "F2/M".
struct GearVariant {
    std::string name;
    std::vector<std::string> closed;
    std::vector<std::pair<std::string, std::string>> options;  // gear, option: ("range", "M")
    Description description;                                   // with these ratios in use
    std::optional<double>
        ratio;  // ω_input / ω_output (at a translating output: of its wheel); none: not driven
    std::optional<double> metres_per_radian;  // travel of the driven body per radian of the input, no slip
    std::vector<TieUp> tie_ups;               // of what is rigid: shafts share by their stiffness
    std::vector<std::string> blocked_by;      // devices that keep the output from turning; none: it can
    double kmh(double input_rpm) const noexcept;  // 0 without a body
};

// Every gear path times every combination of options; throws ModelError where a path names no clutch or brake.
std::vector<GearVariant> gear_variants(const Description& description);

// The other states that are looked at: "all open"; of a machine without gear paths also "as it starts" (what is initially
// locked) and "all closed", each with every combination of options.
std::vector<GearVariant> other_states(const Description& description);

// Of the output or of the wheel that carries it, with shafts stiff and tyres that may slip: which devices hold it. None: it can
// move, or the machine names no output.
std::vector<std::string> output_held_by(const Description& description, const Structure& structure,
                                        const std::vector<std::string>& closed,
                                        const RigidOptions& options = slipping_tyres);

// ---- natural frequencies ----------------------------------------------------------------------------

struct Mode {
    double frequency = 0;               // undamped [Hz]
    double damping_ratio = 0;           // as if damping did not change the shape: modal damping / critical
    std::vector<double> shape;          // speed of every mass; 1 at the mass with the largest kinetic share
    std::vector<double> kinetic_share;  // of every mass in the kinetic energy, sums to 1
    std::vector<std::pair<std::string, double>>
        elastic_share;  // of every shaft and tyre in the potential energy
};

// Of shafts, dampers and tyres as they are: a strong damper holds what it joins, and another machine swings.
struct DampedMode {
    double frequency = 0;               // |λ|/2π [Hz]
    double damping_ratio = 0;           // −Re λ/|λ|
    std::vector<double> kinetic_share;  // of every mass, from its amplitude
};

struct ModalResult {
    int rigid_motions = 0;           // motions without stiffness
    std::vector<Mode> modes;         // undamped, rising frequency
    std::vector<DampedMode> damped;  // those that oscillate, rising frequency
    // Does somebody who knows the undamped frequencies alone miss something, by more than one per cent?
    bool damping_shifts() const noexcept;
};

struct ModalOptions {
    double body_speed = 0;      // V for the damped modes [m/s]
    bool closed_flanks = true;  // shafts with play press; false: their play is open
};

// The motions, J-orthonormal, in which shafts and tyres may twist while gears, closed pairs and wheel contacts hold.
Eigen::MatrixXd swinging_motions(const Description& description, const Structure& structure,
                                 const std::vector<std::string>& closed);

ModalResult natural_modes(const Description& description, const std::vector<std::string>& closed,
                          const ModalOptions& options = {});

}  // namespace shiftrig::plant
