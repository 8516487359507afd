// What the contact bytes mean to the loops over all devices (device_loops.h): numbers side by side in place of states.
// Internal to plant/. A pure function of contact states and oil: made anew when one of these has changed, and
// forgetting it changes no bit.
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
    double* drag = nullptr;  // per pair: torque per slip of an open clutch in its oil [Nm s/rad]
    // Per pair: its friction factor is base + rise · exp(−|slip| · inverse_speed); that at rest where it is locked, base alone
    // where an actuated one runs free. Base and rise are 0 where the factor is a table.
    double *base = nullptr, *rise = nullptr, *inverse_speed = nullptr;
    bool fades = false;            // some rise of an actuated pair is not 0
    bool acts = false;             // some actuated pair may have a force: it slips, or drags
    double* state_code = nullptr;  // per pair, as outputs show it
    // Per mesh: power flows as assumed where drive · M_1 − drive_offset is not negative; 0 for those without losses or at rest.
    double* drive = nullptr;
    double* drive_offset = nullptr;
    double* direction =
        nullptr;  // per mesh, as outputs show it: x, 0 at rest; of lossless ones left to their torque

    // What it was made from.
    bool known = false;
    std::vector<unsigned char> contact;
    double viscosity = 0;
};

// Brings the table of `work.operators` up to date; `mode` is that of the contact states.
void tabulate_contact(Work& work, const Mode& mode) SHIFTRIG_REALTIME;

}  // namespace shiftrig::plant::detail
