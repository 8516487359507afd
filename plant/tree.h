// Long chains: the same mechanics as modes.h, factored along the tree of rigid groups instead of written as dense
// matrices. One mode costs O(N) to build, one step O(N). Internal to plant/.
//
// Masses joined by locked pairs and gears move as one *group* with one speed q: ω_j = r_j q. Torques along the group
// are weighed with the force ratios r̂_j (û in place of u), so that what the rigid devices pass on cancels:
//
//   M_g q̇_g = Σ_j r̂_j M̃_j,     M_g = Σ_j r̂_j r_j J_j
//
// Every shaft joins a group to its parent group. Both ratios are scaled so that they agree on the two sides of a
// shaft; then ψ̇ = q_child − q_parent with φ = ± r ψ, and stiffness and damping become k' = r̂ r k, d' = r̂ r d: the
// stage matrix M + hγ D' + (hγ)² K' is symmetric even with losses, and its L D Lᵀ on a forest has no fill.
//
// A group that a closed brake or a stuck mesh holds is *grounded*: q = 0. The torques inside it follow from equilibrium;
// where several devices hold the same group (tie-up) they share by minimum norm weighted with the nominal
// capacities, which on a tree is the resistor network S λ = M̃, S = Ĉ W Ĉᵀ, M = W Ĉᵀ λ, again without fill.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "plant/realtime.h"
#include "plant/structure.h"

namespace shiftrig::plant::detail {

struct ModelData;
struct Mode;
struct Sample;
struct Work;

// Where the machine's masses lie in the forest of two-link devices, fixed when the model is built. A *position* counts
// masses so that parents come first and a mass's heaviest child follows it at once.
struct TreeTopology {
    struct Edge {                // from a position to its parent
        int parent = -1;         // position, −1: root
        int rigid = -1;          // unknown (pair, or pairs + mesh) that can join it to its parent
        int shaft = -1;          // twist
        double own = 0, up = 0;  // kinematic factors of the rigid device at the position and its parent
        double stiffness = 0, damping = 0;  // of the elastic link
        double sign = 1;                    // +1 where the position is the shaft's first mass
    };
    struct Ground {  // a device between a mass and the housing
        int position = -1, pair = -1;
        double factor = 0;
    };
    std::vector<int> mass;               // of each position
    std::vector<int> position;           // of each mass
    std::vector<Edge> edges;             // by position
    std::vector<Ground> grounds;         // brakes and resistances
    std::vector<double> ground_damping;  // by position [Nm s/rad]
    std::vector<double> weight;          // by unknown: share of a torque that is not unique
    std::vector<int> observed;           // positions whose speeds the force laws read
};

// The topology, or nothing, with `reason` saying which device makes it no forest.
std::unique_ptr<TreeTopology> build_topology(const ModelData& model, std::string& reason);

// One contact mode on the tree: arrays by position and by group, in one block of memory.
struct TreeMode {
    int groups = 0;
    int* group = nullptr;           // by position
    double* ratio = nullptr;        // r, by position
    double* force_ratio = nullptr;  // r̂, by position
    // By group:
    int* first = nullptr;               // its first position: where it hangs on its parent
    int* parent = nullptr;              // group, −1: none
    unsigned char* grounded = nullptr;  // 1: held by a closed pair, 2: by a stuck mesh
    double* mass = nullptr;             // M
    double* drag = nullptr;             // damping to the housing
    double* stiffness = nullptr;        // k' towards the parent
    double* damping = nullptr;          // d'
    double* inverse = nullptr;          // 1/D and L of the stage matrix for the model's step size
    double* lower = nullptr;
    // Active rigid edges, children first: position of the child, its factors in Ĉ.
    int edge_count = 0;
    int* edge = nullptr;
    double* edge_own = nullptr;
    double* edge_up = nullptr;
    // Grounded groups: S of the resistor network by position, its L D Lᵀ.
    double* network_inverse = nullptr;
    double* network_lower = nullptr;
    int ground_count = 0;
    int* ground_position = nullptr;
    int* ground_unknown = nullptr;
    double* ground_factor = nullptr;
    bool any_grounded = false;
};

// Memory of one tree mode.
struct TreeSizes {
    std::size_t doubles = 0, integers = 0, bytes = 0;
    explicit TreeSizes(const ModelData& model);
};
void place_tree(const ModelData& model, TreeMode& tree, double* doubles, int* integers,
                unsigned char* bytes) noexcept;

// Fills mode.tree and what a mode says about itself (rows, bound, redundant) from mode.key.
void build_tree_mode(const ModelData& model, Mode& mode) SHIFTRIG_REALTIME;

// L D Lᵀ of M + hγ D' + (hγ)² K' for the weight hγ: 1/D and L by group.
void factor_stage(const TreeMode& tree, double weight, double* inverse, double* lower) SHIFTRIG_REALTIME;

// The tree's versions of what the dense modes do with matrices (forces.h, transitions.h).
void tree_internal_torques(const Work& work, const Mode& mode, Sample& sample) SHIFTRIG_REALTIME;
void tree_sample_rate(const Work& work, const Mode& mode, Sample& sample) SHIFTRIG_REALTIME;
void tree_join(const Work& work, const Mode& mode, double* speeds) SHIFTRIG_REALTIME;

// Stuck meshes and bound slips that move if mesh `leader` moves: part = ±1 turning with or against it, 0 others. Returns
// 1/√(reduced inertia) of that motion, 0 if others hold it.
double tree_family(const Work& work, const Mode& mode, int leader, signed char* part) SHIFTRIG_REALTIME;

}  // namespace shiftrig::plant::detail
