// Pairs and lossy meshes at rest as a linear complementarity problem. Internal to plant/.
//
// In J^(−1/2)-scaled speeds, with A and Â the columns of all meshes (those at rest without loss), c_i and ĉ_i those of the
// devices at rest i, y_i their torques (of a mesh: its loss torque):
//
//   M = G⁻¹ Aᵀ (M̃ − Σ ĉ_i y_i),  G = Aᵀ Â                torques of the meshes, [Algin] eq. (15)
//   a_i = c_iᵀ (M̃ − Â M − Σ ĉ_j y_j) = b_i − Σ W_ij y_j   accelerations of the slips
//   y_i = upper − p_i = lower + r_i                        p, r ≥ 0: what is left of the limits on both sides
//   a_i = α_i − β_i,  α_i p_i = 0,  β_i r_i = 0            forward only at the upper limit, backward only at the lower
//
// The limits of a pair are ± its capacity, those of a mesh f(M) and −f(−M), where M is its torque and f the larger of two lines: on
// its first link the loss is (1 − η) M + o if that drives, (1 − 1/η') M + o' if it is driven. With κ where they cross,
// δ = 1/η' − η and
//
//   M − κ = u − v,  u v = 0,   f(M) = (1 − η) M + o + δ v,   likewise u', v' for −M
//
// everything is linear but for the products. Eliminating y leaves w − N z = q for w = (α, r, u, u'), z = (p, β, v, v').
#pragma once

#include "plant/forces.h"
#include "plant/piece.h"

namespace shiftrig::plant::detail {

constexpr int most_joints = 16;

// A pair or a mesh at rest.
struct RestJoint {
    int device = -1;
    int mesh = -1;                        // its number among all meshes, −1: a pair
    int row = -1;                         // where its torque stands in RestProblem::mesh
    int bend = -1;                        // its number among the meshes at rest
    double upper = 0, lower = 0;          // limits of a pair, set by whoever asks; of a mesh o and −o
    double slope = 0;                     // 1 − η
    double difference = 0;                // δ
    double kink = 0;                      // κ
    double scale = 1;                     // √W_ii: torques are counted in 1/scale, accelerations in scale
    double give = 0, give_on_losses = 0;  // of W_ii, where loads are shared out
};

// Trains of gears by position, see tree_rest.cpp.
struct TrainWork {
    double *ratio = nullptr, *force_ratio = nullptr;  // r, r̂ along a train
    double* mass = nullptr;                           // Σ r̂ r J of a position and what hangs on it
    double *load = nullptr, *sum = nullptr;           // torques on the masses; Σ r̂ of them, then r q̇
    double* moment = nullptr;                         // of the mesh to the parent
};

struct RestProblem {
    Piece piece;
    RestJoint joints[most_joints];
    int count = 0, bends = 0;
    bool mirrored = false;  // solve the mirror image, and mirror what comes out
    double unit = 0;        // torques are counted in it
    int mesh_rows = 0;      // of `mesh`: all meshes; on a tree those at rest
    int basis[4 * most_joints];
    double* free = nullptr;    // J^(−1/2) M̃, then per joint −J^(−1/2) ĉ; masses × (1 + joints)
    double* motion = nullptr;  // J^(−1/2) c, masses × joints
    double* mesh = nullptr;    // M: mesh_rows × (1 + joints)
    double *columns = nullptr, *forces = nullptr;          // J^(−1/2) A, Â: masses × meshes
    double* g = nullptr;                                   // G
    TrainWork trains;                                      // instead of these, on a tree
    double* w = nullptr;                                   // W, joints × joints, by rows like the next two
    double* response = nullptr;                            // (I − H C)⁻¹: by how much y_i falls per p_j
    double* turn = nullptr;                                // the same of M of mesh i at rest
    double *left = nullptr, *inverse = nullptr;            // work for it, by columns
    double *b = nullptr, *y = nullptr, *torque = nullptr;  // M of meshes at rest, at y
    double* tableau = nullptr;

    int size() const { return 2 * count + 2 * bends; }
};

// Is the device at rest at the sample, by others' doing or by itself?
bool is_still(const Work& work, const Mode& mode, int device, const Sample& sample) SHIFTRIG_REALTIME;

// Does the piece have more devices at rest than may be asked together?
bool is_too_much(const Work& work, const Mode& mode, const Piece& piece,
                 const Sample& sample) SHIFTRIG_REALTIME;

// The problem of everything at rest in the piece around a device at the sample, in scratch.standstill. False: nothing is,
// too much is, or the torques of meshes in a ring of their own are not unique.
bool pose_rest_problem(Work& work, const Mode& mode, int around, Sample& sample,
                       RestProblem& rest) SHIFTRIG_REALTIME;

// The part of it that differs on a tree: b, W and the torques of meshes at rest, from `free`. False where one of the joints
// cannot move.
bool set_up_trains(const Work& work, const Piece& piece, RestProblem& rest) SHIFTRIG_REALTIME;

// How a load is split where mechanics leaves that open.
enum class Split {
    any,  // a corner of what is possible, which one depends on signs and order: for accelerations, which are unique
    as_modes,  // every joint gives a little under its torque, the less the larger its nominal capacity: as the mode of the
    // same states has it
    on_losses,  // so too, but meshes give next to nothing: their losses carry what they can
};

// Solves it with the limits as they stand; leaves the torques of its solution in y and `torque`. False: no solution was found.
bool solve_rest_problem(Split split, RestProblem& rest) SHIFTRIG_REALTIME;

// Is there a split within all limits, so that nothing goes? Where large losses make rest and motion both a solution, Lemke's
// method may come upon the motion. Of all such splits it leaves that in y and `torque` whose pairs use least of what they hold.
// False as well where more meshes at rest bend than are asked.
bool find_rest(RestProblem& rest) SHIFTRIG_REALTIME;
int side_at_rest(const RestProblem& rest, int i) SHIFTRIG_REALTIME;

// Where joint i of the solution is: 0 within its limits, +1 at the upper one, −1 at the lower one. `going`: its acceleration,
// as a share of what there could be.
int side_of(const RestProblem& rest, int i, double& going) SHIFTRIG_REALTIME;

// The contact state of joint i there.
unsigned char state_of(const RestProblem& rest, int i, int side) SHIFTRIG_REALTIME;

// Doubles of working memory.
int rest_workspace(const ModelData& model) noexcept;

}  // namespace shiftrig::plant::detail
