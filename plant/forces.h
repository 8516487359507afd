// Everything the step needs to know besides linear mechanics: what presses the pairs together over the
// step, and the forces at an instant. Internal to plant/.
#pragma once

#include "plant/modes.h"
#include "plant/samples.h"

namespace shiftrig::plant::detail {

// One step's view of all roles, handed down through its parts.
struct Work {
    const ModelData& model;
    OperatorsData& operators;
    const double* state;  // the State block
    double* next;         // the same, to be written; null where one only looks
    Outputs& outputs;
    ScratchData& scratch;
    unsigned char* contact;  // contact states in force, per pair, mesh and flank
    double start;            // time at the start of the step [s]
    double h;                // [s]
};

// Inputs as they act: limited to their ranges, not-a-number taken as the initial value.
void latch_inputs(Work& work, const Inputs& inputs) SHIFTRIG_REALTIME;

// What the latched inputs say of each pair.
void latch_commands(Work& work) SHIFTRIG_REALTIME;

// Valves, pistons, pedals: advances their states over the step and leaves the course of every pair's load.
void advance_actuation(Work& work) SHIFTRIG_REALTIME;
// The loads at the present state of the actuators, for a look without a step.
void hold_actuation(Work& work) SHIFTRIG_REALTIME;

// Of a hydraulic actuator, from the State block [Pa].
double chamber_pressure(const double* block, const PairLaw& law) SHIFTRIG_REALTIME;

// Load of a pair at an instant: times its friction factor this is its capacity. [Nm]
double pair_load(const Work& work, int pair, const Instant& at) SHIFTRIG_REALTIME;

// Where between two fractions of the step the load of a pair starts or ends to be there: 1 if nowhere.
double load_edge(const Work& work, int pair, double from, double until) SHIFTRIG_REALTIME;

// Does the pair carry anything at this instant, or from it on?
bool is_pressed(const Work& work, int pair, const Instant& at) SHIFTRIG_REALTIME;

// From the slips and the auxiliary states of the sample, with the contact states `contact`: capacities, forces f,
// auxiliary rates.
void evaluate_forces(const Work& work, const unsigned char* contact, Sample& sample) SHIFTRIG_REALTIME;

// The same for the contact states in force, once tabulate_contact() has looked at them. While a part of a step is under
// way, where nobody asks what pairs could hold or pass: forces f and auxiliary rates alone. Loads of
// actuated pairs stand in the sample only where some move, or there are tables or one-way pairs.
void stage_forces(const Work& work, Sample& sample) SHIFTRIG_REALTIME;
// At the end of a part: all of it, bit for bit what evaluate_forces() gives.
void end_forces(const Work& work, Sample& sample) SHIFTRIG_REALTIME;

// The part of f that depends on the contact states, from capacities already there.
void contact_forces(const Work& work, const unsigned char* contact, Sample& sample) SHIFTRIG_REALTIME;

// [Algin] eq. (15): M of the active set in `mode` from z and f of the sample.
void internal_torques(const Work& work, const Mode& mode, Sample& sample) SHIFTRIG_REALTIME;
// The same where the coordinates stand before f already.
void active_torques(const ModelData& model, const Mode& mode, Sample& sample) SHIFTRIG_REALTIME;
// Only as `active`, by row of the mode.
void row_torques(const ModelData& model, const Mode& mode, Sample& sample) SHIFTRIG_REALTIME;

// The coordinates of the mode, read out of z into their place before f.
double* read_coordinates(const Mode& mode, const Sample& sample) SHIFTRIG_REALTIME;
// From coordinates, so many rows of the view: ModelData::law_rows, power_rows or all of them.
void show(const ModelData& model, const Mode& mode, const double* coordinates, Sample& sample,
          int rows) SHIFTRIG_REALTIME;
// All rows, from the sample's own z. Of a dense mode z is written back, and comes to lie on its constraints; on a tree it stays as it is.
void look(const ModelData& model, const Mode& mode, Sample& sample) SHIFTRIG_REALTIME;

// An input as it acts; 0 where the model has none.
inline double input(const Work& work, int index) noexcept {
    return index < 0 ? 0 : work.operators.input[static_cast<std::size_t>(index)];
}

// What a pair or a mesh slips at: A_kᵀω.
inline double slip_of(const std::array<Link, 2>& links, const double* speeds) noexcept {
    double slip = links[0].factor * speeds[links[0].mass];
    if (links[1].mass >= 0) slip += links[1].factor * speeds[links[1].mass];
    return slip;
}
// The same for ModelData's links, which have the housing as a mass of factor 0.
inline double slip_fast(const std::array<Link, 2>& links, const double* speeds) noexcept {
    return links[0].factor * speeds[links[0].mass] + links[1].factor * speeds[links[1].mass];
}
inline double slip_fast(const std::array<Link, 3>& links, const double* speeds) noexcept {
    return links[0].factor * speeds[links[0].mass] + links[1].factor * speeds[links[1].mass] +
           links[2].factor * speeds[links[2].mass];
}

}  // namespace shiftrig::plant::detail
