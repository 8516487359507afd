// Inner loops of the engine for long chains, over the groups of a tree mode. As in kernels.h one source is compiled for
// portable, AVX2 and AVX-512 processors; those with fused multiply-add round differently, so bits depend on the kernel.
//
// Groups lie in paths: inside a path the parent of g is g − 1. Only the heads of paths hang elsewhere.
#pragma once

#include "plant/kernels.h"

namespace shiftrig::plant::detail {

// The groups of a mode as the loops see them. Vectors may be read one element beyond either end.
struct TreePaths {
    int groups = 0;
    int count = 0;                // paths
    const int* begin = nullptr;   // of each path, and `groups` at the end
    const int* parent = nullptr;  // group that the head hangs on, −1: none
    const int* up = nullptr;      // parent of every group; roots, with L = 0, name group 0
    // Paths with the roots behind them, whose L of 0 ends no chain of operations: what the solutions follow. The same fields.
    int run_count = 0;
    const int* run_begin = nullptr;
    const int* run_parent = nullptr;
    bool long_runs = false;  // worth following; short ones run into each other by themselves
    const double* mass = nullptr;
    const double* inverse_mass = nullptr;  // 0 where grounded
    const double* drag = nullptr;
    const double* stiffness = nullptr;
    const double* damping = nullptr;
};

// Differences δ along the shafts, their torques `passed` on the child (with the sign of ψ), and N = −(K ψ + D δ) on the
// groups, from speeds and twists.
using ShaftTorques = void (*)(const TreePaths&, const double* speed, const double* twist, double* rate,
                              double* passed, double* torque) SHIFTRIG_REALTIME;

// Σ of what the stages so far contribute; terms j = 0 … count − 1.
struct StageSums {
    int count = 0;
    double implicit_weight[4], explicit_weight[4];  // times h
    const double *torque[4], *force[4], *rate[4];
};

// One implicit stage: from the sums to speeds, δ and N of the stage. `weight` = hγ.
using Stage = void (*)(const TreePaths&, const StageSums&, const double* momentum, const double* twist,
                       double weight, const double* inverse, const double* lower, double* work,
                       double* star_twist, double* speed, double* rate, double* torque) SHIFTRIG_REALTIME;

// End of the step: speeds and twists from the last stage.
struct FinalSums {
    double weight = 0;     // hγ
    double correction[4];  // h (b_j − a^E_4j); the last one h γ
    const double* force[4];
    const double* last_speed = nullptr;
    const double* last_rate = nullptr;
    const double* star_twist = nullptr;
};
using FinishStages = void (*)(const TreePaths&, const FinalSums&, double* speed,
                              double* twist) SHIFTRIG_REALTIME;

// Speeds half way, from Hermite's cubic; Σ loss (δ0² + 4 δm² + δ1²) + drag_loss (q0² + 4 qm² + q1²).
struct MiddleSums {
    double h = 0;
    const double *speed[2], *torque[2], *force[2], *rate[2];  // at the beginning and the end
    const double *loss = nullptr, *drag_loss = nullptr;
};
using Middle = double (*)(const TreePaths&, const MiddleSums&, double* speed, double* rate) SHIFTRIG_REALTIME;

// e = Σ weight_j (N_j + Q_j; δ_j) of momenta and twists: by what the embedded method differs.
struct EmbeddedSums {
    double weight[4];
    const double *torque[4], *force[4], *rate[4];
};

// The largest e of a twist [rad], and the largest speed [rad/s].
struct Swing {
    double error = 0, fastest = 0;
};
using SwingError = Swing (*)(const TreePaths&, const EmbeddedSums&, const double* speed) SHIFTRIG_REALTIME;

// Adds factor (S² − S) e to speeds and twists: S = (1 − hγL)⁻¹ of the linear part L is what a stage solves with.
struct EmbeddedWork {
    double *momentum, *passed, *twist, *first, *second, *rate;
};
using Correct = void (*)(const TreePaths&, const EmbeddedSums&, double weight, const double* inverse,
                         const double* lower, double factor, const EmbeddedWork&, double* speed,
                         double* twist) SHIFTRIG_REALTIME;

struct TreeKernel {
    ShaftTorques shaft_torques = nullptr;
    Stage stage = nullptr;
    FinishStages finish = nullptr;
    Middle middle = nullptr;
    SwingError swing_error = nullptr;
    Correct correct = nullptr;
};

TreeKernel choose_tree_kernel(KernelKind kind);
TreeKernel tree_kernel_portable() noexcept;
TreeKernel tree_kernel_avx2() noexcept;
TreeKernel tree_kernel_avx512() noexcept;

}  // namespace shiftrig::plant::detail
