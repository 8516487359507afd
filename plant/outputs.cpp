// Output signals from the end of a step. The order of writing is the order in which model.cpp names them.
#include "plant/connectors.h"
#include "plant/few.h"
#include "plant/finish.h"
#include "plant/shown.h"
#include "plant/transitions.h"

namespace shiftrig::plant::detail {
namespace {

// Of a translating mass: those stand behind the torques of the mode's rows.
double acceleration(Work& w, const Mode& mode, Sample& s, std::size_t translating) {
    return mode.tree ? tree_acceleration(w, mode, s, w.model.translating[translating])
                     : s.active[static_cast<std::size_t>(mode.row_count) + translating];
}

}  // namespace

void fill_outputs(Work& w, const Mode& mode, Sample& s) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    const double* block = w.state;
    double* next = w.outputs.value.data();
    const auto put = [&next](auto... values) { ((*next++ = values), ...); };

    if (mode.tree) tree_swings(w, mode, s);
    m.kernel.loops.copy(s.z, m.masses, next);
    next += m.masses;
    const Shown at{w, s};
    const auto show_all = [&](const auto& devices) {
        if (!devices.empty()) next = show(at, devices, next);
    };
    for_each_kind(driveline_kinds(m.description), show_all);
    for (std::size_t i = 0; i < m.translating.size(); ++i) {
        put(acceleration(w, mode, s, i), block[m.layout.distances + static_cast<int>(i)]);
    }
    for_each_kind(load_kinds(m.description), show_all);
    const double* shown = sensor_slots(m.layout, m.sensors.size(), block).output;
    for (const SensorFaults& faults : w.operators.sensor_faults) {
        put(faults.dropout ? 0. : *shown);
        ++shown;
    }
    if (m.description.oil) put(w.operators.oil_temperature, w.operators.oil.viscosity);

    const double stored = w.scratch.stored;
    const double* energy = block + m.layout.energy;
    put(energy[0], stored, energy[1], stored - energy[2] - energy[0] + energy[1]);
    show_certificate(w.outputs);
}

}  // namespace shiftrig::plant::detail

namespace shiftrig::plant {

// The last of all outputs (model.cpp).
void show_certificate(Outputs& outputs) SHIFTRIG_REALTIME {
    const Certificate& c = outputs.certificate;
    const double values[] = {c.torque_residual,     c.constraint_violation, c.energy_defect,
                             double(c.events),      double(c.fall_backs),   double(c.mode_lookups),
                             double(c.mode_misses), double(c.flags)};
    double* const last = outputs.value.data() + outputs.value.size() - std::size(values);
    for (std::size_t i = 0; i < std::size(values); ++i) last[i] = values[i];
}

}  // namespace shiftrig::plant
