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

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "plant/realtime.h"
#include "plant/structure.h"
#include "plant/tree_kernels.h"

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
    // Behind the positions of the masses those of the *anchors*: the end of each spring to the housing, which hangs on its mass
    // as if it were one more, but never moves.
    std::vector<int> mass;               // of each position; of an anchor the one that it hangs on
    std::vector<int> position;           // of each mass
    std::vector<Edge> edges;             // by position
    std::vector<Ground> grounds;         // brakes and resistances
    std::vector<double> ground_damping;  // by position [Nm s/rad]
    std::vector<double> weight;          // by unknown: share of a torque that is not unique
    bool lossy = false;                  // any gear with losses
    TreeKernel kernel;

    int positions() const noexcept { return static_cast<int>(edges.size()); }
};

// The topology, or nothing, with `reason` saying which device makes it no forest.
std::unique_ptr<TreeTopology> build_topology(const ModelData& model, std::string& reason);

// A mass of a group with rigid devices inside.
struct TreeMass {
    int position = -1, group = -1;
    double inertia = 0;  // r J
    double drag = 0;     // r times its damping to the housing
};

// A force on such a mass: its torque changes by −factor · f.
struct TreeForce {
    int position = -1, force = -1;
    double factor = 0;
};

// A rigid device between two such masses, as far as their group is not grounded: what the child needs passes through.
struct TreeEdge {
    int position = -1, parent = -1, unknown = -1;
    double reciprocal = 0;  // 1/factor in Ĉ, at the child
    double up = 0;          // and the factor at the parent
};

// One contact mode on the tree: arrays by position and by group, in one block of memory.
struct TreeMode {
    TreePaths paths;                // groups, their masses and links, as the inner loops see them
    int* group = nullptr;           // by position
    double* ratio = nullptr;        // r, by position
    double* force_ratio = nullptr;  // r̂, by position
    // By group:
    int* first = nullptr;   // its first position: where it hangs on its parent
    int* parent = nullptr;  // group, −1: none
    // Behind `paths`, see TreePaths:
    int* up = nullptr;
    int* path_begin = nullptr;
    int* path_parent = nullptr;
    double* inside = nullptr;
    double* inner_stiffness = nullptr;
    double* inner_damping = nullptr;
    int* head = nullptr;
    int* run_begin = nullptr;
    int* run_parent = nullptr;
    // By group again:
    unsigned char* grounded = nullptr;  // 1: held by a closed pair, 2: by a stuck mesh
    double* mass = nullptr;             // M
    double* inverse_mass = nullptr;     // 1/M, 0 where grounded
    double* drag = nullptr;             // damping to the housing
    double* stiffness = nullptr;        // k' towards the parent
    double* damping = nullptr;          // d'
    double* loss = nullptr;             // power lost in the link's damper per δ²
    double* drag_loss = nullptr;        // power lost to the housing per q²
    StageMatrix matrix;                 // for the model's step size
    double liveliness = 0;              // the most that forces of magnitude 1 can accelerate a mass
    bool swings = false;                // may have swings that a step of the model's size damps noticeably
    // q = factor · z[slot], ψ = factor · z[slot]; without a shaft the factor is 0.
    int* speed_slot = nullptr;
    int* twist_slot = nullptr;
    double* speed_factor = nullptr;
    double* twist_factor = nullptr;
    // And back: of each mass its group and r, of each shaft its group and 1/factor.
    Spreading masses, shafts;
    bool exact = false;  // all factors are ±1: there and back it is the same number
    GroupForces
        forces;  // not those of locked pairs; shares with factors r̂: a momentum changes by −factor · f
    GroupPairs turning;  // per mesh, of what its loss acts on
    // Masses of groups with rigid devices inside, and the link torques that act on them.
    int inner_count = 0;
    TreeMass* inner = nullptr;
    int end_count = 0;
    int* end_group = nullptr;
    int* end_position = nullptr;
    double* end_factor = nullptr;
    int inner_force_count = 0;
    TreeForce* inner_force = nullptr;
    int inner_edge_count = 0;
    TreeEdge* inner_edge = nullptr;  // children first
    // Where nothing may be left over then: first masses of groups, all masses of grounded ones.
    int spent_count = 0;
    int* spent = nullptr;
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
};

// Memory of one tree mode, in numbers of each kind; of the doubles whole cache lines.
struct TreeSizes {
    std::size_t doubles = 0, integers = 0, bytes = 0, masses = 0, forces = 0, edges = 0;
};
struct TreeMemory {
    double* doubles = nullptr;
    int* integers = nullptr;
    unsigned char* bytes = nullptr;
    TreeMass* masses = nullptr;
    TreeForce* forces = nullptr;
    TreeEdge* edges = nullptr;
};
// Hands it out, and says how much it takes (without memory: only that).
TreeSizes place_tree(const ModelData& model, TreeMode& tree, const TreeMemory& memory) noexcept;

// Fills mode.tree and what a mode says about itself (rows, bound, redundant) from mode.key.
void build_tree_mode(const ModelData& model, Mode& mode) SHIFTRIG_REALTIME;

// Parts of that. Is the rigid device of this edge closed in the mode? Gears always are.
bool is_active(const ModelData& model, const Mode& mode, const TreeTopology::Edge& edge) SHIFTRIG_REALTIME;
// What holds a group: closed pairs to the housing; failing that, a stuck mesh.
void find_grounds(const ModelData& model, Mode& mode, TreeMode& tree) SHIFTRIG_REALTIME;
// S = Ĉ W Ĉᵀ of the grounded groups.
void factor_network(const ModelData& model, TreeMode& tree) SHIFTRIG_REALTIME;

// L D Lᵀ of M + hγ D' + (hγ)² K' for the weight hγ of the matrix, which has its memory; `block`: of the kernel
// that will solve with it.
void factor_stage(int block, const TreeMode& tree, StageMatrix& matrix) SHIFTRIG_REALTIME;

// ---- motion of the groups -----------------------------------------------------------------------------

// The groups at the instant of a sample.
struct GroupState {
    double* speed = nullptr;   // q
    double* twist = nullptr;   // ψ
    double* rate = nullptr;    // δ = ψ̇
    double* passed = nullptr;  // torque of the link to the parent, on the child
    double* net = nullptr;     // M q̇: of all links, of damping to the housing and of all other forces
    // The mode in which they hold, as it was when so many had been built; none: they are not there.
    const Mode* mode = nullptr;
    std::int64_t modes_built = 0;
};
std::size_t group_state_size(const ModelData& model) noexcept;  // in doubles
void place_groups(const ModelData& model, GroupState& groups, double* memory) noexcept;

// Working memory of a step on the tree.
struct TreeWork {
    double *momentum = nullptr, *way = nullptr, *load = nullptr, *potential = nullptr, *swing[4] = {};
    StageMatrix matrix;  // of a part of a step
    // Speeds and f of each stage: those of the beginning, then
    const double *speed[4] = {}, *effort[4] = {};
    double *stage_speed[3] = {}, *stage_effort[3] = {};
    double* auxiliary_rate[4] = {};  // of each stage
    Swing swing_seen;                // by the last advance; nothing where the mode has none
};
std::size_t tree_work_size(const ModelData& model) noexcept;  // in doubles
void place_tree_work(const ModelData& model, TreeWork& work, double* memory) noexcept;

// q and ψ from z.
void read_groups(const TreeMode& tree, const double* z, GroupState& groups) SHIFTRIG_REALTIME;
// What follows from them and from the sample's f.
void complete_groups(const Work& work, const Mode& mode, Sample& sample) SHIFTRIG_REALTIME;
// The sample's groups, read from its z and f if they are not there.
const GroupState& groups_of(const Work& work, const Mode& mode, Sample& sample) SHIFTRIG_REALTIME;
// Slips of forces and meshes from q.
void group_slips(const ModelData& model, const Mode& mode, const double* speed,
                 Sample& sample) SHIFTRIG_REALTIME;

// Internal torques of the sample from its groups, and their residual.
void rigid_torques(const Work& work, const Mode& mode, Sample& sample) SHIFTRIG_REALTIME;

// ---- the tree's versions of what the dense modes do with matrices (forces.h, transitions.h) ---------------

void tree_internal_torques(const Work& work, const Mode& mode, Sample& sample) SHIFTRIG_REALTIME;
// Slips of forces and meshes from z.
void tree_slips(const ModelData& model, const Mode& mode, Sample& sample) SHIFTRIG_REALTIME;
// Twist rates of the shafts.
void tree_swings(const Work& work, const Mode& mode, Sample& sample) SHIFTRIG_REALTIME;
void tree_sample_rate(const Work& work, const Mode& mode, Sample& sample) SHIFTRIG_REALTIME;
double tree_acceleration(const Work& work, const Mode& mode, Sample& sample, int mass) SHIFTRIG_REALTIME;
// ω̇ of impulses: change = B impulse.
void tree_mobility(const Work& work, const Mode& mode, const double* impulse,
                   double* change) SHIFTRIG_REALTIME;

// Stuck meshes and bound slips that move if mesh `leader` moves: part = ±1 turning with or against it, 0 others. Returns
// 1/√(reduced inertia) of that motion, 0 if others hold it.
double tree_family(const Work& work, const Mode& mode, int leader, signed char* part) SHIFTRIG_REALTIME;

}  // namespace shiftrig::plant::detail
