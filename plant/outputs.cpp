// Output signals from the end of a step. The order of writing is the order in which model.cpp names them.
#include <algorithm>

#include "plant/few.h"
#include "plant/finish.h"
#include "plant/laws/plough.h"
#include "plant/ledger.h"
#include "plant/transitions.h"

namespace shiftrig::plant::detail {
namespace {

// Of a translating mass: those stand behind the torques of the mode's rows.
double acceleration(Work& w, const Mode& mode, const Sample& s, std::size_t translating) {
    if (!mode.tree) return s.active[static_cast<std::size_t>(mode.row_count) + translating];
    Sample rates = s;
    sample_rate(w, mode, rates);
    return rates.rate[w.model.translating[translating]];
}

// Which way power goes through a mesh that loses nothing.
double flow(const Work& w, int mesh, double torque, const double* speeds) {
    return torque * slip_fast(w.model.mesh_motion[static_cast<std::size_t>(mesh)], speeds) < 0 ? -1 : 1;
}

}  // namespace

void fill_outputs(Work& w, const Mode& mode, const Sample& s) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    const double* block = w.state;
    const double* speeds = s.z;
    double* next = w.outputs.value.data();
    const auto put = [&next](auto... values) { ((*next++ = values), ...); };

    next = copy_few(speeds, m.masses, next);
    const double* twist = speeds + m.masses;
    for (std::size_t e = 0; e < static_cast<std::size_t>(m.plain_shafts); ++e, ++twist) {
        const double rate = mode.tree ? slip_fast(m.shaft_rate[e], speeds) : s.swing[e];
        put(m.structure.shafts[e].stiffness * *twist + m.swing_damping[e] * rate, *twist);
    }
    // Clutches are the first pairs.
    const auto clutches = static_cast<int>(m.description.clutches.size());
    const ContactTable& table = w.operators.table;
    const double *const f = s.f, *const torque = s.torque, *const slip = s.slip;
    const auto put_each = [&next](int count, const auto& value) {
        for (int k = 0; k < count; ++k) next[k] = value(k);
        next += count;
    };
    next = m.kernel.loops.show_clutches(
        {f, torque, slip, s.sliding, table.state_code, block + m.layout.heat, clutches}, next);
    for (const int k : m.hydraulic_pairs) {
        const auto i = static_cast<std::size_t>(k);
        put(block[m.pair_laws[i].actuator + chamber_slot] * w.operators.commands[i].scale);
    }
    const double* const surface = block + m.layout.temperatures;
    next = copy_few(surface, static_cast<int>(m.heated_pairs.size()), next);
    for (const FreewheelLaw& law : m.freewheels) {
        const int k = law.pair;
        const unsigned char state = w.contact[k];
        const double speed = slip_fast(m.pair_slip[static_cast<std::size_t>(k)], speeds);
        const double passed = state == locked ? torque[k] : f[k];
        put(passed, speed,
            state == locked                    ? 0.
            : slip_sign(state) * law.sense > 0 ? 1.
                                               : 2.,
            state == locked ? 0. : passed * speed, block[m.layout.heat + k]);
    }
    for (const BacklashLaw& law : m.backlashes) {
        const double side = flank_side(w.contact[law.device]), angle = speeds[m.masses + law.shaft];
        const double rate = slip_fast(m.shaft_rate[static_cast<std::size_t>(law.shaft)], speeds);
        put(side == 0 ? 0. : flank_torque(law, side, angle, rate), angle, side);
    }
    // Gears are the first meshes.
    const auto gears = static_cast<int>(m.description.gears.size());
    const double *const mesh_torque = torque + m.pairs, *const direction = table.direction;
    next = copy_few(mesh_torque, gears, next);
    const unsigned char* const lossy = m.lossy.data();
    put_each(gears, [&](int k) { return lossy[k] ? direction[k] : flow(w, k, mesh_torque[k], speeds); });
    const Mesh* const meshes = m.structure.meshes.data();
    put_each(gears, [&](int k) { return mesh_torque[k] * speeds[meshes[k].first]; });
    for (int k = gears; k < m.meshes; ++k) {
        const double u = meshes[k].force_ratio(static_cast<int>(direction[k])), sun = mesh_torque[k];
        const double lost = meshes[k].ratio * torque[m.pairs + m.meshes + k];
        put(sun, -u * sun + lost, -(1 - u) * sun - lost, lossy[k] ? direction[k] : flow(w, k, sun, speeds));
    }
    for (std::size_t t = 0; t < m.tyres.size(); ++t) put(s.tyre_force[t], s.tyre_slip[t]);
    for (std::size_t c = 0; c < m.converters.size(); ++c) put(s.converter[2 * c], s.converter[2 * c + 1]);
    for (std::size_t e = 0; e < m.engines.size(); ++e) {
        const double full = s.engine_full_load[e];
        const auto engine_mode =
            static_cast<EngineMode>(static_cast<int>(block[m.layout.engines + 3 * static_cast<int>(e)]));
        put(s.engine_torque[e], full > 0 ? s.engine_torque[e] / full : 0.,
            engine_mode == EngineMode::stalled ? 1. : 0.);
    }
    for (std::size_t i = 0; i < m.translating.size(); ++i) {
        put(acceleration(w, mode, s, i), block[m.layout.distances + static_cast<int>(i)]);
    }
    for (const PloughLaw& law : m.ploughs) {
        // Its share of what resists the body.
        const int pair = law.pair;
        const double force = w.contact[pair] == locked ? s.torque[pair] : s.f[pair];
        const double draft = plough_draft(law.curve, speeds[law.mass], w.operators.draft);
        put(s.sliding[pair] > 0 ? force * draft / s.sliding[pair] : 0.);
    }
    const double* shown = sensor_slots(m.layout, m.sensors.size(), block).output;
    for (const SensorFaults& faults : w.operators.sensor_faults) {
        put(faults.dropout ? 0. : *shown);
        ++shown;
    }
    if (m.description.oil) put(w.operators.oil_temperature, w.operators.oil.viscosity);

    const double stored = w.scratch.stored;
    const double* energy = block + m.layout.energy;
    put(energy[0], stored, energy[1], stored - energy[2] - energy[0] + energy[1]);
    const Certificate& c = w.outputs.certificate;
    put(c.torque_residual, c.constraint_violation, c.energy_defect, double(c.events), double(c.fall_backs),
        double(c.mode_lookups), double(c.mode_misses), double(c.flags));
}

}  // namespace shiftrig::plant::detail
