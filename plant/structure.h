// The regular mechanical system behind a description: who joins whom, as the structural distribution
// matrix (SDM) of [Algin]. Everything that solves for torques or speeds reads it: the step, the statics
// and the modal view. Building it validates the description.
//
//   mass j:      J_j ω̇_j = M̃_j − Σ_k A_jk M_k                                             [Algin] eq. (14)
//   device k:    one unknown M_k, the torque on its first link, positive from that mass into the device
//   kinematics:  Σ_j A_jk ω_j is what the device sees: a slip speed, a twist rate, or 0 where it is rigid
//
//   | device                        | column of A                                   |
//   | clutch, shaft, damper a–b     | a: 1, b: −1                                   |
//   | freewheel a–b                 | a: 1, b: −1                                   |
//   | brake, damper on a            | a: 1                                          |
//   | wheel a on a road mass b      | a: 1, b: −1/r                                 |
//   | gear, u = ω_a/ω_b             | a: 1, b: −u                                   |
//   | planetary row, Willis' u      | sun: 1, ring: −u, carrier: −(1 − u)           |
//
// Losses change the distribution of torques, not the kinematics: the force column Â of a mesh is its
// column with û = u·η^x in place of u ([Algin] eq. 16–25), x = +1 where the first link drives the mesh.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "plant/description.h"

namespace shiftrig::plant {

// One entry of an SDM column; mass −1 is the housing (its factor is then 0).
struct Link {
    int mass = -1;
    double factor = 0;  // [1], or [1/m] towards a translating mass
};

// A pair that is locked, slips or is free. Besides devices that are one there are pairs that appear by themselves,
// because what resists motion must also be able to hold a body at rest. A structure holds them in this order:
enum class PairKind {
    clutch,           // closed by command: clutch, brake, Coulomb wheel contact
    self_acting,      // a device that locks and lets go by a law of its own: freewheel
    rolling,          // rolling moment on a tyre's wheel
    body_resistance,  // motion resistance and draft on a translating mass
    engine_friction,  // of a stalled engine on its mass
};

struct FrictionPair {
    std::string name;
    PairKind kind{};
    std::array<Link, 2> links;
    double nominal_capacity = 0;   // [Nm] or [N], > 0; shares a torque that is not unique (tie-up)
    bool rolling_contact = false;  // of a wheel on a road
    bool initially_locked = false;
};

// A gear or a planetary row: rigid, possibly with losses.
struct Mesh {
    std::string name;
    bool planetary = false;
    int first = -1, second = -1, carrier = -1;               // masses; carrier −1: the housing
    double ratio = 0;                                        // u
    double forward_efficiency = 1, backward_efficiency = 1;  // first link drives / is driven
    double forward_bearing = 0, backward_bearing = 0;        // [Nm] referred to the first link

    bool lossy() const noexcept {
        return forward_efficiency < 1 || backward_efficiency < 1 || forward_bearing > 0 ||
               backward_bearing > 0;
    }
    // û for the loss exponent x = +1, −1, or 0 (no loss: at rest, or asked for ideally).
    double force_ratio(int x) const noexcept {
        return x > 0 ? ratio * forward_efficiency : x < 0 ? ratio / backward_efficiency : ratio;
    }
    // The column with the ratio u (kinematics) or any û (forces).
    std::array<Link, 3> column(double u) const noexcept {
        return {Link{first, 1}, Link{second, -u}, Link{carrier, carrier < 0 ? 0 : -(1 - u)}};
    }
    // What slips inside the mesh: ω_first − ω_carrier.
    std::array<Link, 2> motion() const noexcept {
        return {Link{first, 1}, Link{carrier, carrier < 0 ? 0. : -1.}};
    }
    // How a loss torque, referred to the first link, acts on the masses: as a column of the SDM, the torque out of the mass; lost
    // where it is positive and the mesh moves forward.
    std::array<Link, 2> loss() const noexcept {
        return {Link{second, ratio}, Link{carrier, carrier < 0 ? 0. : -ratio}};
    }
    // Where torques are shared out, those of a mesh count half way between its links, as |u|^½ M_1, whichever is called the
    // first: the weight of M_1 is so much of the weight of that.
    double first_link_weight() const noexcept { return 1 / std::fabs(ratio); }
    // M_1, moving forward, at which the loss lines of both directions cross: the first link drives above it. Lines that are
    // parallel do not: bearing friction alone is overcome by either link, half of it by each at this torque. [Nm]
    double loss_kink() const noexcept {
        const double slope = forward_efficiency - 1 / backward_efficiency;
        return slope < 0 ? (forward_bearing - backward_bearing) / slope : forward_bearing / 2;
    }
};

// A shaft or a damper: a known torque stiffness·twist + damping·(ω_a − ω_b). With a gap, only beyond it.
struct Elastic {
    std::string name;
    std::array<Link, 2> links;
    double stiffness = 0, damping = 0;
    double gap = 0;            // the whole play [rad]; 0: none
    double initial_twist = 0;  // [rad], positive where the first link is ahead
};

// Where a tyre that does not slip would tie its wheel to the body.
struct RollingContact {
    std::string name;
    std::array<Link, 2> links;
};

struct Structure {
    std::vector<std::string> mass_names;
    std::vector<double> inertia;  // [kg m²] or [kg]
    std::vector<FrictionPair> pairs;
    std::vector<Mesh> meshes;     // gears and their like, then planetary rows, in description order
    std::vector<Elastic> shafts;  // without play, then those with it, in description order
    std::vector<Elastic> dampers;
    std::vector<RollingContact> rolling_contacts;  // of tyres whose law is a force

    int masses() const noexcept { return static_cast<int>(inertia.size()); }
    // Where closed loops leave torques open they are shared by minimum norm, each weighted: a pair by its nominal capacity, a
    // mesh by this times Mesh::first_link_weight(), since sharing is for friction pairs [Nm].
    double mesh_weight() const noexcept {
        double heaviest = 0;
        for (const FrictionPair& pair : pairs) heaviest = std::max(heaviest, pair.nominal_capacity);
        return 1e7 * (heaviest > 0 ? heaviest : 1);
    }
    double loss_weight() const noexcept {
        return 1e-10 * mesh_weight();
    }                                                // of the loss torque of a mesh at rest
    int mass(std::string_view name) const noexcept;  // index, or −1
    int pair(std::string_view name) const noexcept;  // index, or −1
    int mesh(std::string_view name) const noexcept;  // index, or −1

    // SDM columns as dense matrices (masses × devices), for those who need no speed.
    Eigen::MatrixXd pair_columns() const;
    Eigen::MatrixXd mesh_columns() const;                              // A, with u
    Eigen::MatrixXd mesh_force_columns(std::span<const int> x) const;  // Â, with û by exponent x of each mesh
    Eigen::MatrixXd shaft_columns() const;
    Eigen::MatrixXd damper_columns() const;
};

// Validates the description and builds its structure. Throws ModelError: inertia or stiffness not
// positive, ratio 0, efficiency outside (0, 1], names used twice, and above all the regularity rule,
// "every link of every connector ends on a mass", naming the connectors that meet without one.
Structure build_structure(const Description& description);

}  // namespace shiftrig::plant
