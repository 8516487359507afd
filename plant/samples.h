// The quantities of one instant inside a step, and the working memory that holds the few instants a step
// looks at. Internal to plant/. Nothing of Scratch survives a step; the two samples that a step begins and ends with lie
// in OperatorsData (modes.h), where the next step may begin with the last.
#pragma once

#include <vector>

#include "plant/laws/engine.h"
#include "plant/laws/hydraulics.h"
#include "plant/laws/tyre.h"
#include "plant/laws/waveform.h"
#include "plant/model_data.h"

namespace shiftrig::plant::detail {

// Where in the step, and from which side laws that jump are taken.
struct Instant {
    double time = 0;      // [s]
    double fraction = 0;  // of the whole step, 0…1
    Side side = Side::right;
};

struct Sample {
    Instant at;
    // What the mode's view shows of the coordinates q, in the order of the rows of Mode::view (ModelData::law_rows, power_rows, seen): a product fills all or the first of these.
    double* slip = nullptr;     // per force: slip of pairs, of bearings in meshes, −ω of external torques
    double* motion = nullptr;   // per mesh: ω_first − ω_carrier; not on a tree
    double* turning = nullptr;  // per mesh: what its loss torque acts on (ModelData::mesh_loss)
    double* swing = nullptr;    // twist rate of each shaft, slip of each damper
    double* z = nullptr;        // [ω; φ]
    // What operators multiply: q ends where f begins (`coordinates`), f is followed by the torques of the mode's
    // active rows. A product that gives q comes before f is filled, since its padding reaches into it.
    double* f =
        nullptr;  // forces; on a tree those of `late` lie in TreeWork::stage_effort, with nothing behind them
    double* active =
        nullptr;  // behind f: torques in the order of Mode::rows, then accelerations of translating masses
    double* auxiliary = nullptr;
    double* auxiliary_rate = nullptr;
    double* load = nullptr;              // per pair: what presses it together [Nm]
    double* sliding = nullptr;           // per pair: sliding capacity at its slip [Nm]
    double* holding = nullptr;           // per pair: static capacity [Nm]
    double* torque = nullptr;            // M of pairs, meshes, then loss torques of stuck meshes [Nm]
    double* rate = nullptr;              // ż
    double* tyre_force = nullptr;        // per tyre [N]
    double* tyre_slip = nullptr;         // per tyre [1]
    double* converter = nullptr;         // pump, turbine torque per converter [Nm]
    double* engine_torque = nullptr;     // per engine [Nm]
    double* engine_full_load = nullptr;  // at its speed [Nm]
    // On a tree; and what its internal torques leave over, of the largest.
    GroupState groups;
    double torque_residual = 0;
};

// What a stuck mesh takes to stay at rest, and the loss it has at its torque if it moves that way [Nm].
struct LossAtRest {
    double needed = 0, allowed = 0;
};

// What a device did in an instant: was pressed from now on, or no more (a pair); closed, with this slip left (a pair); opened, at
// this torque of what it could hold (a pair), or with this loss needed and allowed (a mesh). Told once the instant is settled.
struct Note {
    bool pressing = false, closed = false, opened = false;
    double slip = 0, torque = 0, capacity = 0;
};

// The course of what presses a pair together, where it changes within the step.
struct PairLoad {
    StepValues values;  // engagement
    HydraulicStep hydraulic;
};

// Doubles of one sample, and its place in memory.
std::size_t sample_size(const ModelData& model);
void place_sample(const ModelData& model, Sample& sample, double* memory);

// Operators of one step over one length of time, in panels (step_operators.cpp): what the coordinates and forces
// at its start, middle and end give to the coordinates half way, at the late stage and at the end. A block is
// padded(order) rows.
struct StepOperators {
    double length = 0;             // [s]
    int halvings = 0;              // of the length, until h L was small
    double* from_begin = nullptr;  // [P_h Q_h; P −Q_1; P Q_1−3Q_2+4Q_3]   three blocks × (order + forces)
    double* from_half = nullptr;   // [2Q_1; 4Q_2−8Q_3]                    two blocks × forces
    double* from_late = nullptr;   // 4Q_3−Q_2                             one block × forces
    double late_reach =
        0;  // the most that forces of magnitude 1 change a speed among the coordinates by that last way
    double* middle =
        nullptr;  // [(h/2)(2φ_2 − 2φ_3) S̃, (h/2)(φ_3 − φ_2/2) S̃], φ_k(hL/2)   one block × 2 forces
};

struct Mode;

struct ScratchData {
    explicit ScratchData(const ModelData& model);
    AlignedDoubles buffer;
    Sample *first = nullptr, *last = nullptr;  // of the part under way; they live with the operators
    Sample& begin() noexcept { return *first; }
    Sample& end() noexcept { return *last; }
    const Sample& begin() const noexcept { return *first; }
    const Sample& end() const noexcept { return *last; }
    Sample half, late, middle;
    std::vector<PairLoad> loads;
    std::vector<double> held;          // per pair: its load where that does not change within the step [Nm]
    std::vector<unsigned char> moves;  // per pair: its load does, `loads` is its course
    std::vector<int> moving;           // the pairs whose load does
    std::vector<int> piston_pairs;     // the pairs whose piston may move, and how it does
    std::vector<PistonCourse> pistons;
    std::vector<ValveBefore> piston_valves;
    int moving_count = 0, piston_count = 0;
    std::vector<EngineMode> engine_modes;  // at the beginning of the step
    std::vector<unsigned char> before, trial, release, changed, violations, found;  // contact bytes
    std::vector<unsigned char> overcome;  // per pair: broke away in the instant being settled,
    std::vector<unsigned char>
        eased;  // came to hold what it pushed with: exactly at its limit, as near as that is known
    std::vector<signed char>
        onward;  // per pair: the sense of its torque from this instant on, where it has none yet
    std::vector<signed char> family;
    std::vector<LossAtRest> losses;  // per mesh, for what is told of it
    AlignedDoubles vectors;
    double *vector_a = nullptr, *vector_b = nullptr,
           *vector_c = nullptr;  // padded masses, torques, forces, or three blocks
    std::vector<double> torque_copy;
    AlignedDoubles works;
    double* work = nullptr;  // per force in this step, what it takes out: of pairs, their heat [J]
    double dissipated = 0, input_work = 0;  // in this step [J]
    double stored_before = 0, stored = 0;   // at its beginning, at its end [J]
    AlignedDoubles workspace_memory;
    double* workspace = nullptr;     // of the mode builder
    TreeWork tree;                   // in its place, where the model has a tree
    std::vector<double> standstill;  // of rearrange(), which builds modes on its way
    std::vector<int> workspace_index;
    std::vector<int> piece;                         // per mass
    AlignedDoubles operator_memory, ledger_memory;  // operators of a partial step, of a part of one
    AlignedDoubles course_memory;                   // of an Interpolant
    std::vector<Note> notes;                        // per pair and mesh, of the instant being settled
    std::vector<int> noted;                         // these did something, in this order
    int noted_count = 0;
    std::vector<unsigned char> told;  // contact bytes of the instant told last in this step,
    bool tells_on = false;            // if any was: else those that the step began with
    bool turned = false;              // power turned round in some mesh within the last part
    StepOperators used;               // by the last advance
    StepOperators part;               // in operator_memory, for a part of a step
    const Mode* part_mode = nullptr;  // of this mode, as it was when so many had been built
    std::int64_t part_modes_built = 0;
    bool carries = false;  // `begin` is as the last advance left it, untouched by a change of state
};

}  // namespace shiftrig::plant::detail
