// What the contact bytes mean to the loops over all devices (device_loops.h): numbers side by side in place of states.
// Internal to plant/. A pure function of contact states, oil, and which pairs are pressed: made anew when one of these
// has changed, and forgetting it changes no bit.
#pragma once

#include <vector>

#include "plant/kernels.h"
#include "plant/realtime.h"

namespace shiftrig::plant::detail {

struct ModelData;
struct Mode;
struct Work;

struct ContactTable {
    ContactTable() = default;
    explicit ContactTable(const ModelData& model);

    AlignedDoubles numbers;
    // By row of the view, as far as force laws read it: the sign of the speed that a slipping pair or a moving lossy mesh
    // keeps, 0 for all others.
    double* sense = nullptr;
    double* drag = nullptr;        // per pair: torque per slip of an open clutch in its oil [Nm s/rad]
    bool drags = false;            // some of these are not 0
    double* state_code = nullptr;  // per pair, as outputs show it
    // Per mesh: power flows as assumed where drive · M_1 − drive_offset is not negative; 0 for those without losses or at rest.
    double* drive = nullptr;
    double* drive_offset = nullptr;
    double* direction =
        nullptr;  // per mesh, as outputs show it: x, 0 at rest; of lossless ones left to their torque
    std::vector<int> pressed;  // pairs that slip, or are about to, under a load
    int pressed_count = 0;

    // What it was made from.
    bool known = false;
    std::vector<unsigned char> contact;
    std::vector<unsigned char>
        laden;  // per pair: it is loaded at some instant of the step; always, where by nature
    double viscosity = 0;
};

// Once a step, when it is known what presses the pairs: notes which are, and forgets a table made for others or for other oil.
void doubt_table(Work& work) SHIFTRIG_REALTIME;
// Brings the table of `work.operators` up to date; `mode` is that of the contact states.
void tabulate_contact(Work& work, const Mode& mode) SHIFTRIG_REALTIME;

}  // namespace shiftrig::plant::detail
