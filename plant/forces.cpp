#include "plant/forces.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "plant/laws/converter.h"
#include "plant/laws/plough.h"
#include "plant/laws/road.h"

namespace shiftrig::plant::detail {
namespace {

double input(const Work& w, int index) noexcept {
    return index < 0 ? 0 : w.operators.input[static_cast<std::size_t>(index)];
}

EngineMode engine_mode(const Work& w, std::size_t engine) noexcept {
    return static_cast<EngineMode>(static_cast<int>(w.state[w.model.layout.engines + 3 * static_cast<int>(engine)]));
}

// Viscous drag of an open wet clutch.
double open_drag(const Work& w, int k, const Sample& s) noexcept {
    return drag_torque(w.model.pair_laws[static_cast<std::size_t>(k)].drag, w.operators.oil.viscosity,
                       slip_fast(w.model.pair_slip[static_cast<std::size_t>(k)], s.z),
                       w.model.description.oil->drag_speed_limit);
}

// Load of the pairs that no actuator presses; their friction factor is 1. [Nm] or [N]
double natural_load(const Work& w, int k, const Sample& s) noexcept {
    const ModelData& m = w.model;
    const auto i = static_cast<std::size_t>(k);
    const FrictionPair& pair = m.structure.pairs[i];
    const int mass = m.pair_slip[i][0].mass;
    if (pair.kind == PairKind::rolling) return m.pair_laws[i].full_load;
    if (pair.kind == PairKind::engine_friction) {
        const auto e = static_cast<std::size_t>(pair.source);
        return stalled_friction_capacity(m.description.engines[e], engine_mode(w, e), s.z[mass]);
    }
    double force = 0;
    for (std::size_t t = 0; t < m.tyres.size(); ++t) {
        if (m.tyres[t].body == mass) force += tyre_resistance(w.operators.soils[t], s.tyre_slip[t]);
    }
    const double share = m.draft < 0 ? 1 : input(w, m.draft);
    for (std::size_t p = 0; p < m.plough_mass.size(); ++p) {
        if (m.plough_mass[p] == mass) force += plough_draft(m.description.ploughs[p], s.z[mass], share);
    }
    return force;
}

// Capacities and force of every pair, [Algin] eq. (11).
void pair_forces(const Work& w, const unsigned char* contact, Sample& s, Extent extent) noexcept {
    const ModelData& m = w.model;
    const PairLaw* laws = m.pair_laws.data();
    const PairLoad* loads = w.scratch.loads.data();
    for (int k = 0; k < m.pairs; ++k) {
        const PairLaw& law = laws[k];
        if (extent == Extent::moving_pairs && contact[k] == locked) {
            s.f[k] = 0;
            continue;
        }
        if (law.source >= LoadSource::rolling) {
            s.load[k] = s.sliding[k] = s.holding[k] = natural_load(w, k, s);
            s.f[k] = slip_sign(contact[k]) * s.sliding[k];
            continue;
        }
        const double load = s.load[k] = loads[k].moves ? pair_load(w, k, s.at) : loads[k].held;
        s.holding[k] = load * law.friction.static_factor;
        if (contact[k] == locked || load == 0) {
            s.sliding[k] = load * law.sliding_at_rest;
            s.f[k] = contact[k] == free_running && law.drag > 0 ? open_drag(w, k, s) : 0;
        } else {
            s.sliding[k] = sliding_capacity(law.friction, load, slip_fast(m.pair_slip[static_cast<std::size_t>(k)], s.z));
            s.f[k] = slip_sign(contact[k]) * s.sliding[k];
        }
    }
}

void bearing_forces(const Work& w, const unsigned char* contact, Sample& s) noexcept {
    const ModelData& m = w.model;
    if (m.first_external == m.pairs) return;
    for (int k = 0; k < m.meshes; ++k) {
        const int f = m.bearing_force[static_cast<std::size_t>(k)];
        if (f < 0) continue;
        const unsigned char state = contact[m.pairs + k];
        const Mesh& mesh = m.structure.meshes[static_cast<std::size_t>(k)];
        s.f[f] = state == stuck
                     ? 0
                     : motion_sign(state) * (state & driven ? mesh.backward_bearing : mesh.forward_bearing);
    }
}

}  // namespace

void latch_inputs(Work& w, const Inputs& inputs) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    OperatorsData& known = w.operators;
    const std::size_t bytes = known.raw_input.size() * sizeof(double);
    if (known.inputs_known && std::memcmp(known.raw_input.data(), inputs.value.data(), bytes) == 0) return;
    std::memcpy(known.raw_input.data(), inputs.value.data(), bytes);
    known.inputs_known = true;
    known.carried = false;
    for (std::size_t i = 0; i < m.inputs.size(); ++i) {
        const Signal& signal = m.inputs[i];
        const double value = inputs.value[i];
        w.operators.input[i] =
            value != value ? signal.initial : std::clamp(value, signal.minimum, signal.maximum);
    }
    for (std::size_t t = 0; t < m.tyres.size(); ++t) {
        w.operators.soils[t] = tyre_soil(m.description.tyres[t], input(w, m.tyres[t].mobility));
    }
    for (std::size_t e = 0; e < m.engines.size(); ++e) {
        const EngineLaw& engine = m.engines[e];
        w.operators.engine_inputs[e] = {input(w, m.throttle), input(w, engine.speed_request_enable) > 0.5,
                                      input(w, engine.speed_request), input(w, engine.torque_limit),
                                      input(w, engine.fuel_cut) > 0.5};
    }
    at_oil_temperature(m, w.operators, input(w, m.oil_temperature));
}

void evaluate_forces(const Work& w, const unsigned char* contact, Sample& s, Extent extent) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    const Description& d = m.description;
    std::fill(s.f + m.first_external, s.f + m.forces, 0.);
    s.input_power = s.field_power = 0;
    const auto add = [&](int mass, double torque) { s.f[m.external_force[static_cast<std::size_t>(mass)]] += torque; };
    const auto drive = [&](int mass, double torque) {
        add(mass, torque);
        s.input_power += torque * s.z[mass];
    };

    const double* auxiliary = s.auxiliary;
    double* rate = s.auxiliary_rate;
    for (std::size_t t = 0; t < m.tyres.size(); ++t, ++auxiliary, ++rate) {
        const BrixiusTyre& tyre = d.tyres[t];
        const int wheel = m.tyres[t].wheel, body = m.tyres[t].body;
        *rate = tyre_slip_rate(tyre, *auxiliary, s.z[wheel], s.z[body]);
        s.tyre_slip[t] = tyre_slip(tyre, *auxiliary, *rate, s.z[wheel], s.z[body]);
        s.tyre_force[t] = tyre_force(w.operators.soils[t], s.tyre_slip[t]);
        add(wheel, -s.tyre_force[t] * tyre.radius);
        add(body, s.tyre_force[t]);
        s.field_power += s.tyre_force[t] * (s.z[wheel] * tyre.radius - s.z[body]);
    }
    for (std::size_t e = 0; e < m.engines.size(); ++e, auxiliary += 2, rate += 2) {
        const Engine& engine = d.engines[e];
        const EngineState state{auxiliary[0], auxiliary[1]};
        const EngineInput& in = w.operators.engine_inputs[e];
        const EngineMode mode = engine_mode(w, e);
        const int mass = m.engines[e].mass;
        const double speed = s.z[mass], peak = m.engines[e].peak;
        EngineState change;
        if (mode == EngineMode::running) change = engine_rate(engine, peak, in, state, speed);
        rate[0] = change.torque;
        rate[1] = change.boost;
        s.engine_torque[e] = engine_torque(engine, peak, in, state, mode, speed);
        drive(mass, s.engine_torque[e]);
    }
    for (std::size_t c = 0; c < m.converters.size(); ++c) {
        const int pump = m.converters[c].pump, turbine = m.converters[c].turbine;
        const ConverterTorques torques = converter_torques(d.converters[c], s.z[pump], s.z[turbine]);
        s.converter[2 * c] = torques.pump;
        s.converter[2 * c + 1] = torques.turbine;
        add(pump, -torques.pump);
        add(turbine, torques.turbine);
        s.field_power += torques.pump * s.z[pump] - torques.turbine * s.z[turbine];
    }
    for (std::size_t i = 0; i < m.sources.size(); ++i) {
        const TorqueSource& source = d.sources[i];
        const int mass = m.sources[i].mass;
        double torque = waveform(source.waveform, s.at.time, s.at.side) + input(w, m.sources[i].input);
        if (source.quadratic != 0) torque -= source.quadratic * s.z[mass] * std::fabs(s.z[mass]);
        drive(mass, torque);
    }
    for (std::size_t i = 0; i < m.road_mass.size(); ++i) {
        const Road& road = d.roads[i];
        const int body = m.road_mass[i];
        drive(body, grade_force(road, input(w, m.grade), d.gravity) + air_force(road, s.z[body]));
    }
    pair_forces(w, contact, s, extent);
    bearing_forces(w, contact, s);
}

void contact_forces(const Work& w, const unsigned char* contact, Sample& s) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    for (int k = 0; k < m.pairs; ++k) {
        s.f[k] = slip_sign(contact[k]) * s.sliding[k];
        if (contact[k] == free_running && m.pair_laws[static_cast<std::size_t>(k)].drag > 0) s.f[k] = open_drag(w, k, s);
    }
    bearing_forces(w, contact, s);
}

void internal_torques(const Work& w, const Mode& mode, Sample& s) SHIFTRIG_REALTIME {
    if (mode.tree) return tree_internal_torques(w, mode, s);
    const ModelData& m = w.model;
    double* active = w.scratch.vector_c.data();
    m.kernel.multiply(mode.torques, padded(mode.row_count), m.columns, s.z, nullptr, active);
    std::fill(s.torque, s.torque + m.torques, 0.);
    for (int r = 0; r < mode.row_count; ++r) s.torque[mode.rows[r]] = active[r];
}

}  // namespace shiftrig::plant::detail
