// The loops of an ordinary step over all devices side by side, without a branch per device: do all states hold, may a
// margin have dipped, what pairs drag and pass on, what the ledger books, temperatures, pick-ups, what is shown. Compiled for
// each kernel like its products (device_loops_body.h), so that as many devices go at once as a register holds.
//
// Arrays are read and written in whole registers: behind their last entry up to `loop_slack` more doubles must belong to
// the same memory. What stands there does not matter, and what is written there is of no meaning.
#pragma once

#include "plant/realtime.h"

namespace shiftrig::plant::detail {

constexpr int loop_slack = 8;

// Speeds whose sense is part of the contact states: of slipping pairs, of moving lossy meshes.
struct SpeedCheck {
    const double* sense = nullptr;  // ±1; 0 where the state says nothing of a speed, also behind the last
    const double *begin = nullptr, *half = nullptr, *end = nullptr;  // the speeds at three instants
    int speeds = 0;
};

// Friction of so many pairs (laws/friction.h, laws/oil.h) in their contact states: the factor is
// base + rise · exp(−|slip| · inverse_speed).
struct FrictionTerms {
    const double *load = nullptr, *slip = nullptr;
    const double *sense = nullptr, *drag = nullptr;
    const double *base = nullptr, *rise = nullptr, *inverse_speed = nullptr, *static_factor = nullptr;
    bool fades = false;  // some rise is not 0
    double drag_limit = 0;
    int pairs = 0;
};

// Simpson's rule over powers: forces on speeds, torques of meshes on what their losses turn, dampers on their rates.
struct PowerTerms {
    const double *force[3] = {}, *slip[3] = {};
    const double *lost = nullptr, *given = nullptr;  // per force: not 0 where its power counts as that
    int forces = 0;
    const double* loss_share = nullptr;  // per mesh, 0 where nothing is lost
    const double *mesh_torque[3] = {}, *turning[3] = {};
    int meshes = 0;
    const double* damping = nullptr;  // per shaft and damper
    const double* swing[3] = {};
    int swings = 0;
};
struct Work3 {
    double lost = 0, given = 0;  // [J]
};

// Facing and bulk of so many clutches, each y₁ = E y₀ + F P about the oil temperature (laws/heat.h).
struct HeatTerms {
    const double *e11 = nullptr, *e12 = nullptr, *e21 = nullptr, *e22 = nullptr, *f1 = nullptr, *f2 = nullptr;
    const double *warn = nullptr, *fail = nullptr;  // limits [°C], infinite where there are none
    const int* pair = nullptr;                      // whose work heats it
    int count = 0;
};

// Periods of so many pick-ups (laws/sensor.h), none with missing teeth.
struct PickupTerms {
    const double* teeth = nullptr;        // of the wheel; 0: an ideal one
    const double* pitch = nullptr;        // 2π/teeth [rad]
    const double* directional = nullptr;  // 1 or 0
    const double* drop_out_speed = nullptr;
    const int* mass = nullptr;  // whose speed it measures
    int count = 0;
};

// What is shown of so many clutches, from the quantities of all pairs.
struct ClutchValues {
    const double *force = nullptr, *torque = nullptr;  // sliding or internal: one of both is zero
    const double *slip = nullptr, *capacity = nullptr, *state_code = nullptr, *heat = nullptr;
    int count = 0;
};

// The same of so many shafts: torque and twist.
struct ShaftValues {
    const double *stiffness = nullptr, *damping = nullptr, *twist = nullptr, *rate = nullptr;
    int count = 0;
};

// Power through so many meshes.
struct MeshFlow {
    const double* torque = nullptr;     // on the first link
    const double* direction = nullptr;  // of the lossy ones: x, 0 at rest
    const double* checked = nullptr;    // not 0 where a mesh has losses and moves
    int meshes = 0;
};

struct DeviceLoops {
    // Has every speed at the end the sense it is to have?
    bool (*senses_hold)(const SpeedCheck& check) SHIFTRIG_REALTIME = nullptr;
    // May one have been least somewhere between begin and end?
    bool (*may_dip)(const SpeedCheck& check) SHIFTRIG_REALTIME = nullptr;
    // Does every pair run free (state_code 2) that nothing presses together, and no other?
    bool (*pressed_engage)(const double* sliding, const double* holding, const double* state_code,
                           int pairs) SHIFTRIG_REALTIME = nullptr;
    // Has power turned round in a mesh, by no less torque than this, since it was told?
    bool (*some_turned)(const MeshFlow& flow, const double* told, double torque) SHIFTRIG_REALTIME = nullptr;
    // Forces of the pairs: drag · slip, slip within ± drag_limit, and sense · load · factor.
    void (*slide)(const FrictionTerms& terms, double* f) SHIFTRIG_REALTIME = nullptr;
    // The same, and what each holds and passes: load · static_factor, load · factor.
    void (*press)(const FrictionTerms& terms, double* f, double* holding,
                  double* sliding) SHIFTRIG_REALTIME = nullptr;
    // Over h; adds the work of each force to work[k].
    Work3 (*book)(const PowerTerms& terms, double h, double* work) SHIFTRIG_REALTIME = nullptr;
    void (*subtract)(const double* a, const double* b, int count,
                     double* difference) SHIFTRIG_REALTIME = nullptr;
    // The largest magnitude, of the values and of a − b.
    double (*largest)(const double* v, int count) SHIFTRIG_REALTIME = nullptr;
    double (*largest_difference)(const double* a, const double* b, int count) SHIFTRIG_REALTIME = nullptr;
    // Σ rest² / Σ v², 0 where v is
    double (*share_of_squares)(const double* rest, int rests, const double* v,
                               int count) SHIFTRIG_REALTIME = nullptr;
    // Σ weight · v², weight 0 behind the last
    double (*weighted_square)(const double* weight, const double* v, int count) SHIFTRIG_REALTIME = nullptr;
    // Bit for bit?
    bool (*same)(const double* a, const double* b, int count) SHIFTRIG_REALTIME = nullptr;
    void (*copy)(const double* from, int count, double* to) SHIFTRIG_REALTIME = nullptr;
    // With the work of each pair and the rate 1/h. Leaves in `before` what the surfaces were; true if one has passed a
    // limit upwards.
    bool (*heat)(const HeatTerms& terms, const double* work, double rate, double oil, double* surface,
                 double* bulk, double* before) SHIFTRIG_REALTIME = nullptr;
    // From the speeds of all masses at begin and end of the step; position, time since the last tooth, reading are its state.
    void (*pick_up)(const PickupTerms& terms, const double* begin, const double* end, double h,
                    double* position, double* since_edge, double* reading) SHIFTRIG_REALTIME = nullptr;
    // Torque, slip, capacity, state, friction power and heat, of all clutches one after the other; torque, then twist of all
    // shafts. Return where it ends.
    double* (*show_clutches)(const ClutchValues& values, double* next)SHIFTRIG_REALTIME = nullptr;
    double* (*show_shafts)(const ShaftValues& values, double* next)SHIFTRIG_REALTIME = nullptr;
};

}  // namespace shiftrig::plant::detail
