// The two ends of a step: taking the state out of its block, and putting it back together with the slow
// states and the outputs. Internal to plant/.
#pragma once

#include "plant/forces.h"

namespace shiftrig::plant::detail {

Work begin_step(const ModelData& model, OperatorsData& operators, State& state, Outputs& outputs,
                ScratchData& scratch) SHIFTRIG_REALTIME;

// True if the sample at the beginning already has its forces and torques, from the end of the last step.
bool is_begun(const Work& work) SHIFTRIG_REALTIME;

// The end of the part just computed becomes the beginning of the next.
void accept(Work& work) SHIFTRIG_REALTIME;

// Writes the state, advances what is slow (facing temperatures, engine mode, sensors) and fills the
// outputs and the certificate.
void finish_step(Work& work, const Mode& mode) SHIFTRIG_REALTIME;

// The same for a look that changes nothing.
Work begin_look(const ModelData& model, OperatorsData& operators, const State& state, Outputs& outputs,
                ScratchData& scratch) SHIFTRIG_REALTIME;
void finish_look(Work& work, const Mode& mode) SHIFTRIG_REALTIME;

// Output values from a sample and the State block (outputs.cpp).
void fill_outputs(Work& work, const Mode& mode, Sample& sample) SHIFTRIG_REALTIME;

}  // namespace shiftrig::plant::detail
