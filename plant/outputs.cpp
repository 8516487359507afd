// Output signals from the end of a step. The order of writing is the order in which model.cpp names them.
#include <algorithm>

#include "plant/finish.h"
#include "plant/laws/plough.h"
#include "plant/ledger.h"
#include "plant/transitions.h"

namespace shiftrig::plant::detail {
namespace {

// Of clutches, by PairState.
constexpr double state_code[] = {0, 1, 1, 2};

// Of a translating mass: those stand behind the torques of the mode's rows.
double acceleration(Work& w, const Mode& mode, const Sample& s, std::size_t translating) {
    if (!mode.tree) return s.active[static_cast<std::size_t>(mode.row_count) + translating];
    Sample rates = s;
    sample_rate(w, mode, rates);
    return rates.rate[w.model.translating[translating]];
}

}  // namespace

void fill_outputs(Work& w, const Mode& mode, const Sample& s) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    const double* block = w.state;
    const double* speeds = s.z;
    double* next = w.outputs.value.data();
    const auto put = [&next](auto... values) { ((*next++ = values), ...); };

    next = std::copy(speeds, speeds + m.masses, next);
    const double* twist = speeds + m.masses;
    for (std::size_t e = 0; e < static_cast<std::size_t>(m.plain_shafts); ++e, ++twist) {
        const double rate = mode.tree ? slip_fast(m.shaft_rate[e], speeds) : s.swing[e];
        put(m.structure.shafts[e].stiffness * *twist + m.swing_damping[e] * rate, *twist);
    }
    const double* heat = block + m.layout.heat;
    for (int k = 0; k < m.actuated_pairs; ++k, ++heat) {
        const auto i = static_cast<std::size_t>(k);
        const PairLaw& law = m.pair_laws[i];
        const double force = s.f[k], slip = s.slip[k];
        // Either the sliding force is zero or the internal torque.
        put(force + s.torque[k], slip, s.sliding[k], state_code[w.contact[k]], force * slip, *heat);
        if (law.hydraulic) put(block[law.actuator + chamber_slot] * w.operators.commands[i].scale);
        if (law.heat) put(block[law.temperature]);
    }
    for (const FreewheelLaw& law : m.freewheels) {
        const int k = law.pair;
        const unsigned char state = w.contact[k];
        const double slip = slip_fast(m.pair_slip[static_cast<std::size_t>(k)], speeds);
        const double torque = state == locked ? s.torque[k] : s.f[k];
        put(torque, slip,
            state == locked                    ? 0.
            : slip_sign(state) * law.sense > 0 ? 1.
                                               : 2.,
            state == locked ? 0. : torque * slip, block[m.layout.heat + k]);
    }
    for (const BacklashLaw& law : m.backlashes) {
        const double side = flank_side(w.contact[law.device]), angle = speeds[m.masses + law.shaft];
        const double rate = slip_fast(m.shaft_rate[static_cast<std::size_t>(law.shaft)], speeds);
        put(side == 0 ? 0. : flank_torque(law, side, angle, rate), angle, side);
    }
    for (int k = 0; k < m.meshes; ++k) {
        const auto i = static_cast<std::size_t>(k);
        const Mesh& mesh = m.structure.meshes[i];
        const double torque = s.torque[m.pairs + k];
        int x = mode.bound[m.pairs + k] ? 0 : loss_exponent(w.contact[m.pairs + k]);
        if (mesh.planetary) {
            const double u = mesh.force_ratio(x), lost = s.torque[m.pairs + m.meshes + k];
            put(torque, -u * torque + mesh.ratio * lost, -(1 - u) * torque - mesh.ratio * lost);
        } else {
            put(torque);
        }
        if (!m.lossy[i]) x = torque * slip_fast(m.mesh_motion[i], speeds) < 0 ? -1 : 1;
        put(static_cast<double>(x));
        if (!mesh.planetary) put(torque * speeds[mesh.first]);
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
    for (std::size_t p = 0; p < m.plough_mass.size(); ++p) {
        // Its share of what resists the body.
        const int pair = m.plough_pair[p];
        const double force = w.contact[pair] == locked ? s.torque[pair] : s.f[pair];
        const double share = m.draft < 0 ? 1 : w.operators.input[static_cast<std::size_t>(m.draft)];
        const double draft = plough_draft(m.description.ploughs[p], speeds[m.plough_mass[p]], share);
        put(s.sliding[pair] > 0 ? force * draft / s.sliding[pair] : 0.);
    }
    for (std::size_t i = 0; i < m.sensors.size(); ++i) {
        const double* sensor = block + m.layout.sensors + 4 * static_cast<int>(i);
        put(w.operators.sensor_faults[i].dropout ? 0. : sensor[3]);
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
