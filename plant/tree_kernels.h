// Inner loops of the engine for long chains, over the groups of a tree mode. As in kernels.h one source is compiled for
// portable, AVX2 and AVX-512 processors; those with fused multiply-add round differently, so bits depend on the kernel.
//
// Groups lie in paths: inside a path the parent of g is g − 1. Only the heads of paths hang elsewhere.
#pragma once

#include "plant/kernels.h"

namespace shiftrig::plant::detail {

// The groups of a mode as the loops see them. Vectors are read and written in whole blocks: up to seven elements behind the last
// group belong to them, whatever stands there.
struct TreePaths {
    int groups = 0;
    int count = 0;                   // paths
    const int* begin = nullptr;      // of each path, and `groups` at the end
    const int* parent = nullptr;     // group that the head hangs on, −1: none
    const int* up = nullptr;         // parent of every group; roots, with L = 0, name group 0
    const double* inside = nullptr;  // per group: 1 where its parent is the one before it, else 0
    // Heads that hang on another group.
    int hanging = 0;
    const int* head = nullptr;
    // Paths with the roots behind them, whose L of 0 ends no chain of operations: what the solutions follow. The same fields.
    int run_count = 0;
    const int* run_begin = nullptr;
    const int* run_parent = nullptr;
    bool long_runs = false;  // worth a scan; short ones run into each other by themselves
    const double* mass = nullptr;
    const double* inverse_mass = nullptr;  // 0 where grounded
    bool drags = false;                    // some group is damped to the housing
    const double* drag = nullptr;
    const double* stiffness = nullptr;  // of the link to the parent; 0 at roots
    const double* damping = nullptr;
    const double* inner_stiffness = nullptr;  // the same, 0 at heads and behind the last group as well
    const double* inner_damping = nullptr;
};

// Differences δ along the shafts, their torques `passed` on the child (with the sign of ψ), and N = −(K ψ + D δ) on the
// groups, from speeds and twists.
using ShaftTorques = void (*)(const TreePaths&, const double* speed, const double* twist, double* rate,
                              double* passed, double* torque) SHIFTRIG_REALTIME;

// What the speeds of the stages so far make of momenta, M (of_momentum_0 q_0 + Σ of_momentum_j (q_j − q_0)) + of_net · net, and
// of the ways that groups turn, Σ of_way_j q_j.
struct StageSums {
    int count = 0;
    const double* const* speed = nullptr;                           // so many
    const double *of_momentum = nullptr, *weight_of_way = nullptr;  // likewise; of_way = h · weight_of_way
    double h = 0;
    const double* net = nullptr;  // M q̇ at the beginning
    double of_net = 0;
};
// And the right-hand side of the stage that follows, momenta − hγ K (twist + differences of the ways), with the weight hγ. No
// twist: none.
using Combine = void (*)(const TreePaths&, double weight, const StageSums&, const double* twist,
                         double* right, double* way) SHIFTRIG_REALTIME;

// One implicit stage: q of (M + hγ D + (hγ)² K) q = the right-hand side, in its place.
//
// Along a run x_g = y_g + L x of the one before is worked out for a block of groups at a time: to y of each that of the one,
// then of the second, then (blocks of eight) of the fourth before it in its block is added with these factors, at last what
// stands before the block. Blocks are counted from where the sweep begins; what is left of a run goes one by one. Only
// where runs are long.
constexpr int largest_tree_block = 8, smallest_tree_block = 4;
struct TreeScan {
    double *by_one = nullptr, *by_two = nullptr, *by_four = nullptr, *from_outside = nullptr;
};
struct StageMatrix {
    double weight = 0;
    double *inverse = nullptr, *lower = nullptr;  // 1/D, L
    TreeScan towards_leaves, towards_roots;
};
using Solve = void (*)(const TreePaths&, const StageMatrix&, double* right) SHIFTRIG_REALTIME;

// Twists at the end of the step, from those at the beginning, ways without what the last stage gives to them, and its speeds, which
// are copied.
using FinishStages = void (*)(const TreePaths&, double weight, const double* begin_twist, const double* way,
                              const double* last_speed, double* speed, double* twist) SHIFTRIG_REALTIME;

// Speeds half way, from Hermite's cubic; Σ loss (δ0² + 4 δm² + δ1²) + drag_loss (q0² + 4 qm² + q1²).
struct MiddleSums {
    double h = 0;
    const double *speed[2], *net[2], *rate[2];  // at the beginning and the end
    const double *loss = nullptr, *drag_loss = nullptr;
};
using Middle = double (*)(const TreePaths&, const MiddleSums&, double* speed) SHIFTRIG_REALTIME;

// The largest difference e of a twist from that of the embedded method [rad], and the largest speed [rad/s].
struct Swing {
    double error = 0, fastest = 0;
};
// e as the differences of Σ of_way_j q_j, left in `way`; the last speed is that of the end.
using SwingError = Swing (*)(const TreePaths&, const StageSums&, double* way) SHIFTRIG_REALTIME;

// Adds factor (S² − S) e to speeds and twists: S = (1 − hγL)⁻¹ of the linear part L is what a stage solves with. Of the momenta
// and twists e, the latter differences of `way`, work.first has the right-hand side that they give.
struct SwingWork {
    double *first, *second, *error, *rate;
};
using Correct = void (*)(const TreePaths&, const StageMatrix&, const double* way, double factor,
                         const SwingWork&, double* speed, double* twist) SHIFTRIG_REALTIME;

// What belongs to one or two groups each: the factor is 0 where there is only one.
struct GroupPairs {
    int *first = nullptr, *second = nullptr;
    double *of_first = nullptr, *of_second = nullptr;
};
// Places rise. values[place[i]] = of_first · that of the first group + of_second · that of the second
using Slips = void (*)(const GroupPairs&, const double* of_group, const int* place, int count,
                       double* values) SHIFTRIG_REALTIME;

// Forces that can be other than 0: where they stand, what they slip at, and what they take from one or two groups.
struct GroupForces {
    GroupPairs slip, share;
    int* place = nullptr;  // rising
    int count = 0;
};
// Adds factor · Σ_j weight_j effort_j[place[i]], times its share, to the sums of one or two groups; with a scale by group, times
// that.
struct Efforts {
    int terms = 0;
    const double* const* effort = nullptr;  // so many
    const double* weight = nullptr;         // likewise
    double factor = 1;
};
using Give = void (*)(const GroupForces&, const Efforts&, const double* scale, double* sum) SHIFTRIG_REALTIME;

// values[i] = ratio[i] · of_group[group[i]]; in_line, by block: 1 where its groups lie side by side.
struct Spreading {
    int *group = nullptr, *in_line = nullptr;
    double* ratio = nullptr;
};
using Spread = void (*)(const Spreading&, const double* of_group, int count,
                        double* values) SHIFTRIG_REALTIME;

struct TreeKernel {
    int block = 0;  // what its loops take at a time, smallest_tree_block or largest_tree_block
    ShaftTorques shaft_torques = nullptr;
    Combine combine = nullptr;
    Solve solve = nullptr;
    FinishStages finish = nullptr;
    Middle middle = nullptr;
    SwingError swing_error = nullptr;
    Correct correct = nullptr;
    Slips slips = nullptr;
    Give give = nullptr;
    Spread spread = nullptr;
};

TreeKernel choose_tree_kernel(KernelKind kind);
TreeKernel tree_kernel_portable() noexcept;
TreeKernel tree_kernel_avx2() noexcept;
TreeKernel tree_kernel_avx512() noexcept;

}  // namespace shiftrig::plant::detail
