// Statics: the torque on every link of every device at zero acceleration, [Algin] eq. (15) and Table 2.
//
//     node j:     T_j + δ_j,out T_out = Σ_k t_jk                  t_jk: torque of node j into device k
//     device k:   t_jk = Â_jk M_k                                 Â with û = u η^x of every mesh
//     speeds:     Aᵀω = 0                                         with the given speed(s)
//     loops:      Nᵀθ = 0, θ_k = M_k/k_k of shafts, else 0        N: torques that balance on their own, A N = 0
//
// Known are the torques put in at nodes (masses); the output node absorbs what arrives, unless closed devices hold it:
// then they take it. The loss exponents x agree with the lossy solution: starting from the ideal one, the wrong mesh with
// the largest torque is flipped until none is wrong (x = sign(M_1 (ω_1 − ω_carrier))). Where a mesh does not move x = 0:
// its loss may be anything up to its limit in either direction, and the torques are those without it.
// Motions take shafts as untwistable, tyres and wheel contacts as rolling. Loops share by the stiffness of their shafts,
// untwisted without load and with the play of backlashes taken up; loops of rigid devices by capacity.
// Not in it: what needs a magnitude of speed or a state (dampers, converters, engine, draft, rolling resistance).
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "plant/description.h"

namespace shiftrig::plant {

struct StaticsProblem {
    std::vector<std::string> closed;                     // clutches and brakes
    std::vector<std::pair<std::string, double>> inputs;  // node, torque [Nm] (translating: [N]), at least one
    std::vector<std::pair<std::string, double>>
        speeds;          // node, speed [rad/s] or [m/s]; none: first input node at +1
    std::string output;  // absorbing node; empty: the model's output mass
    bool ideal = false;  // every efficiency 1
};

struct StaticsResult {
    struct LinkTorque {
        std::string name;  // "row1.sun", "gear.a", "C1.b"
        std::string device, node;
        double torque = 0;         // [Nm] or [N], positive from the node into the device
        double speed = 0;          // of the node [rad/s] or [m/s]
        bool translating = false;  // the node
    };
    struct MeshFlow {
        std::string name;
        int x = 0;         // +1 first link drives, −1 it is driven, 0 the mesh does not move
        double power = 0;  // through the mesh, seen from the carrier: M_1 (ω_1 − ω_carrier) [W]
        double loss = 0;   // [W], ≥ 0
    };
    struct Node {
        std::string name;
        double speed = 0;     // [rad/s] or [m/s]
        double external = 0;  // torque from outside, the absorbed one included [Nm] or [N]
        double residual = 0;  // of the node balance [Nm] or [N]
        bool translating = false;
    };
    std::vector<LinkTorque> links;
    std::vector<MeshFlow> meshes;
    std::vector<Node> nodes;
    Node input, output;           // the first input node and the absorbing one
    double output_torque = 0;     // on the output node [Nm] or [N]; negative where it resists positive input
    bool output_held = false;     // by closed devices, which take what arrives: output_torque is 0
    bool output_driven = false;   // self-locking: nobody absorbs, the output has to bring part of the loss
    bool at_rest = false;         // every node
    std::optional<double> ratio;  // ω_input / ω_output; none where the output stands
    double power_in = 0;          // positive external powers together [W]
    double loss = 0;              // [W]
    // 1 − loss/power_in; none without power, where the output is driven and where directions are not settled.
    std::optional<double> efficiency;
    double worst_residual = 0;                     // relative to the largest torque
    std::vector<std::string> loss_at_rest;         // lossy meshes that carry torque and do not move
    std::vector<std::string> shared_by_stiffness;  // devices in loops that the shafts decide
    bool split_not_unique = false;                 // a tie-up: shared by capacity, see tie_up
    std::vector<std::string> tie_up;               // devices whose torque mechanics leaves open
    bool directions_settled = true;  // false: no set of x agrees with its torques, which cannot be
};

// Throws ModelError where a name or number is wrong, a given speed contradicts the closed set, the input torques are not in
// balance with the losses and nothing holds them (it says what would be), a closed freewheel would have to pull or to carry
// more than it is rated for, or a speed that a lossy mesh needs does not follow from the given ones.
StaticsResult solve_statics(const Description& description, const StaticsProblem& problem);

}  // namespace shiftrig::plant
