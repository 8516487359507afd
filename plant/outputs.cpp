// Output signals from the end of a step. The order of writing is the order in which model.cpp names them.
#include "plant/finish.h"
#include "plant/laws/plough.h"
#include "plant/ledger.h"

namespace shiftrig::plant::detail {

void fill_outputs(Work& w, const Mode& mode, const Sample& s) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    const OutputLayout& at = m.output_layout;
    const double* block = w.state;
    // Torques are those of the sample; speeds those the step ends with (a join at the very end differs).
    const double* speeds = w.scratch.begin.z;
    double* value = w.outputs.value.data();
    const auto put = [&](int index, auto... values) { ((value[index++] = values), ...); };

    for (int j = 0; j < m.masses; ++j) value[at.mass[static_cast<std::size_t>(j)]] = speeds[j];
    for (int e = 0; e < m.twists; ++e) {
        const Elastic& shaft = m.structure.shafts[static_cast<std::size_t>(e)];
        const double twist = speeds[m.masses + e];
        put(at.shaft[static_cast<std::size_t>(e)],
            shaft.stiffness * twist + shaft.damping * slip_of(shaft.links, speeds), twist);
    }
    for (int k = 0; k < m.pairs; ++k) {
        const auto i = static_cast<std::size_t>(k);
        if (at.pair[i] < 0) continue;
        const double slip = slip_of(m.structure.pairs[i].links, speeds);
        const unsigned char state = w.contact[k];
        const double torque = state == locked ? s.torque[k] : s.f[k];
        put(at.pair[i], torque, slip, s.sliding[k], state == locked ? 0. : state == free_running ? 2. : 1.,
            state == locked ? 0. : s.f[k] * slip, block[m.layout.heat + k]);
        if (at.pressure[i] >= 0) {
            const PairLoad& load = w.scratch.loads[i];
            const double fraction = s.at.fraction;
            value[at.pressure[i]] = load.hydraulic.chamber(fraction) * load.scale;
        }
        if (at.temperature[i] >= 0) value[at.temperature[i]] = block[m.pair_laws[i].temperature];
    }
    for (int k = 0; k < m.meshes; ++k) {
        const auto i = static_cast<std::size_t>(k);
        const Mesh& mesh = m.structure.meshes[i];
        const unsigned char state = w.contact[m.pairs + k];
        const bool resting = state == stuck || mode.bound[m.pairs + k];
        const int x = resting ? 0 : loss_exponent(state);
        const double torque = s.torque[m.pairs + k], lost = s.torque[m.pairs + m.meshes + k];
        const double direction = mesh.lossy() ? x : torque * (speeds[mesh.first] - (mesh.carrier < 0 ? 0 : speeds[mesh.carrier])) < 0 ? -1 : 1;
        if (mesh.planetary) {
            const double u = mesh.force_ratio(x);
            put(at.mesh[i], torque, -u * torque + mesh.ratio * lost, -(1 - u) * torque - mesh.ratio * lost, direction);
        } else {
            put(at.mesh[i], torque, direction, torque * speeds[mesh.first]);
        }
    }
    for (std::size_t t = 0; t < m.tyres.size(); ++t) put(at.tyre[t], s.tyre_force[t], s.tyre_slip[t]);
    for (std::size_t c = 0; c < m.converters.size(); ++c) put(at.converter[c], s.converter[2 * c], s.converter[2 * c + 1]);
    for (std::size_t e = 0; e < m.engines.size(); ++e) {
        const double full = full_load(m.description.engines[e], speeds[m.engines[e].mass]);
        const double mode_code = block[m.layout.engines + 3 * static_cast<int>(e)];
        put(at.engine[e], s.engine_torque[e], full > 0 ? s.engine_torque[e] / full : 0.,
            static_cast<EngineMode>(static_cast<int>(mode_code)) == EngineMode::stalled ? 1. : 0.);
    }
    for (std::size_t i = 0; i < m.translating.size(); ++i) {
        put(at.body[i], s.rate[m.translating[i]], block[m.layout.distances + static_cast<int>(i)]);
    }
    for (std::size_t p = 0; p < m.plough_mass.size(); ++p) {
        // Its share of what resists the body.
        const int pair = m.plough_pair[p];
        const double force = w.contact[pair] == locked ? s.torque[pair] : s.f[pair];
        const double share = m.draft < 0 ? 1 : w.scratch.input[static_cast<std::size_t>(m.draft)];
        const double draft = plough_draft(m.description.ploughs[p], speeds[m.plough_mass[p]], share);
        value[at.plough[p]] = s.sliding[pair] > 0 ? force * draft / s.sliding[pair] : 0;
    }
    for (std::size_t i = 0; i < m.sensors.size(); ++i) {
        const double* sensor = block + m.layout.sensors + 4 * static_cast<int>(i);
        const int dropout = m.sensors[i].dropout;
        value[at.sensor[i]] = dropout >= 0 && w.scratch.input[static_cast<std::size_t>(dropout)] > 0.5 ? 0 : sensor[3];
    }
    if (at.oil >= 0) put(at.oil, w.operators.oil_temperature, w.operators.oil.viscosity);

    const double stored = stored_energy(m, speeds);
    const double* energy = block + m.layout.energy;
    put(at.energy, energy[0], stored, energy[1], stored - energy[2] - energy[0] + energy[1]);
    const Certificate& c = w.outputs.certificate;
    put(at.certificate, c.torque_residual, c.constraint_violation, c.energy_defect, double(c.events),
        double(c.fall_backs), double(c.mode_lookups), double(c.mode_misses), double(c.flags));
}

}  // namespace shiftrig::plant::detail
