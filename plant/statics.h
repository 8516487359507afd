// Statics: the torque on every link of every device at zero acceleration, [Algin] eq. (15) and Table 2.
//
//     node j:     T_j + δ_j,out T_out = Σ_k t_jk                  t_jk: torque of node j into device k
//     device k:   t_jk = Â_jk M_k                                 Â with û = u η^x of every mesh
//     speeds:     Aᵀω = 0                                         with the given speed(s)
//
// Known are the torques put in at nodes (masses); the output node absorbs what arrives. The loss exponents x agree
// with the lossy solution: starting from the ideal one, the wrong mesh with the largest torque is flipped until none
// is wrong (x = sign(M_1 (ω_1 − ω_carrier)); x = 0 where the mesh does not move).
// Shafts are taken as untwistable, tyres and wheel contacts as rolling. Not in it: what needs a magnitude of
// speed or a state (dampers, converters, engine, draft, rolling resistance).
#pragma once

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
        double torque = 0;  // [Nm], positive from the node into the device
        double speed = 0;   // of the node [rad/s]
    };
    struct MeshFlow {
        std::string name;
        int x = 0;         // +1 first link drives, −1 it is driven, 0 the mesh does not move
        double power = 0;  // through the mesh, seen from the carrier: M_1 (ω_1 − ω_carrier) [W]
        double loss = 0;   // [W], ≥ 0
    };
    struct Node {
        std::string name;
        double speed = 0;     // [rad/s]
        double external = 0;  // torque from outside, the absorbed one included [Nm]
        double residual = 0;  // of the node balance [Nm]
    };
    std::vector<LinkTorque> links;
    std::vector<MeshFlow> meshes;
    std::vector<Node> nodes;
    double output_torque =
        0;             // on the output node [Nm]; −Σ… : negative where the output resists positive input
    double ratio = 0;  // ω_input / ω_output, 0 where the output stands
    double power_in = 0;              // positive external powers together [W]
    double loss = 0;                  // [W]
    double efficiency = 1;            // 1 − loss/power_in
    double worst_residual = 0;        // relative to the largest torque
    bool split_not_unique = false;    // a tie-up: shared by capacity, see tie_up
    std::vector<std::string> tie_up;  // devices of the loops
    bool directions_settled = true;   // false: no consistent set of x found (possible below η = 0.5)
};

// Throws ModelError where names are wrong, the closed set lets nothing turn, the input torque finds no way to the
// output, a closed freewheel would have to pull or to carry more than it is rated for, or a speed that a lossy mesh needs does not follow from the given ones.
StaticsResult solve_statics(const Description& description, const StaticsProblem& problem);

}  // namespace shiftrig::plant
