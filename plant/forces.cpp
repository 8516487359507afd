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

// Viscous drag of an open wet clutch.
double open_drag(const Work& w, int k, const Sample& s) noexcept {
    return drag_torque(w.model.pair_laws[static_cast<std::size_t>(k)].drag, w.operators.oil.viscosity,
                       s.slip[k], w.model.description.oil->drag_speed_limit);
}

// Capacities and force of every pair from its load, [Algin] eq. (11).
void pair_forces(const Work& w, const unsigned char* contact, Sample& s) noexcept {
    const ModelData& m = w.model;
    const PairLaw* laws = m.pair_laws.data();
    for (int k = 0; k < m.pairs; ++k) {
        const PairLaw& law = laws[k];
        const double load = s.load[k];
        s.holding[k] = load * law.friction.static_factor;
        if (contact[k] != locked && load != 0) {  // one that is about to engage shows what it would pass
            s.sliding[k] = sliding_capacity(law.friction, load, s.slip[k]);
            s.f[k] = slip_sign(contact[k]) * s.sliding[k];
        } else {
            s.sliding[k] = load * law.sliding_at_rest;
            s.f[k] = contact[k] == free_running && law.drag > 0 ? open_drag(w, k, s) : 0;
        }
    }
}

// Overrunning freewheels pass on their drag only; in the other sense they are pairs like any other.
void freewheel_forces(const Work& w, const unsigned char* contact, Sample& s) noexcept {
    for (const FreewheelLaw& law : w.model.freewheels) {
        if (slip_sign(contact[law.pair]) * law.sense < 0) s.f[law.pair] = -law.sense * law.drag;
    }
}

// ∓kδ of closed flanks: their torque is k φ of the mode and this.
void flank_forces(const Work& w, const unsigned char* contact, Sample& s) noexcept {
    for (const BacklashLaw& law : w.model.backlashes)
        s.f[law.force] = -flank_side(contact[law.device]) * law.stiffness * law.half_gap;
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
    for (std::size_t i = 0; i < m.road_mass.size(); ++i) {
        known.grade_forces[i] = grade_force(m.description.roads[i], input(w, m.grade), m.description.gravity);
    }
    known.draft = m.draft < 0 ? 1 : input(w, m.draft);
    at_oil_temperature(m, w.operators, input(w, m.oil_temperature));
}

void evaluate_forces(const Work& w, const unsigned char* contact, Sample& s,
                     Extent extent) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    const Description& d = m.description;
    const OperatorsData& known = w.operators;
    const ScratchData& scratch = w.scratch;
    std::copy(scratch.held.begin(), scratch.held.end(), s.load);
    for (int i = 0; i < scratch.moving_count; ++i) {
        const int k = scratch.moving[static_cast<std::size_t>(i)];
        if (extent == Extent::all_pairs || contact[k] != locked) s.load[k] = pair_load(w, k, s.at);
    }
    for (int k = m.first_external; k < m.forces; ++k) s.f[k] = 0;
    double input_power = 0, field_power = 0;
    const auto add = [&](int mass, double torque) {
        s.f[m.external_force[static_cast<std::size_t>(mass)]] += torque;
    };
    const auto drive = [&](int mass, double torque) {
        add(mass, torque);
        input_power += torque * s.z[mass];
    };

    const double* auxiliary = s.auxiliary;
    double* rate = s.auxiliary_rate;
    for (std::size_t t = 0; t < m.tyres.size(); ++t, ++auxiliary, ++rate) {
        const TyreLaw& law = m.tyres[t];
        const BrixiusTyre& tyre = d.tyres[t];
        const double wheel_speed = s.z[law.wheel], body_speed = s.z[law.body];
        *rate = tyre_slip_rate(tyre, *auxiliary, wheel_speed, body_speed);
        const double slip = s.tyre_slip[t] = tyre_slip(tyre, *auxiliary, *rate, wheel_speed, body_speed);
        const double force = s.tyre_force[t] = tyre_force(known.soils[t], slip);
        add(law.wheel, -force * tyre.radius);
        add(law.body, force);
        s.load[law.resistance] += tyre_resistance(known.soils[t], slip);
        field_power += force * (wheel_speed * tyre.radius - body_speed);
    }
    for (std::size_t e = 0; e < m.engines.size(); ++e, auxiliary += 2, rate += 2) {
        const EngineLaw& law = m.engines[e];
        const Engine& engine = d.engines[e];
        const EngineState state{auxiliary[0], auxiliary[1]};
        const EngineMode mode = scratch.engine_modes[e];
        const double speed = s.z[law.mass];
        EngineState change;
        if (mode == EngineMode::running)
            change = engine_rate(engine, law.peak, known.engine_inputs[e], state, speed);
        rate[0] = change.torque;
        rate[1] = change.boost;
        s.engine_torque[e] = engine_torque(engine, law.peak, known.engine_inputs[e], state, mode, speed);
        drive(law.mass, s.engine_torque[e]);
        s.load[law.pair] = stalled_friction_capacity(engine, mode, speed);
    }
    for (std::size_t c = 0; c < m.converters.size(); ++c) {
        const int pump = m.converters[c].pump, turbine = m.converters[c].turbine;
        const ConverterTorques torques = converter_torques(d.converters[c], s.z[pump], s.z[turbine]);
        s.converter[2 * c] = torques.pump;
        s.converter[2 * c + 1] = torques.turbine;
        add(pump, -torques.pump);
        add(turbine, torques.turbine);
        field_power += torques.pump * s.z[pump] - torques.turbine * s.z[turbine];
    }
    for (std::size_t i = 0; i < m.sources.size(); ++i) {
        const TorqueSource& source = d.sources[i];
        const int mass = m.sources[i].mass;
        double torque = waveform(source.waveform, s.at.time, s.at.side) + input(w, m.sources[i].input);
        if (source.quadratic != 0) torque -= source.quadratic * s.z[mass] * std::fabs(s.z[mass]);
        drive(mass, torque);
    }
    for (std::size_t i = 0; i < m.road_mass.size(); ++i) {
        const int body = m.road_mass[i];
        drive(body, known.grade_forces[i] + air_force(d.roads[i], s.z[body]));
    }
    for (std::size_t p = 0; p < m.plough_mass.size(); ++p) {
        s.load[m.plough_pair[p]] += plough_draft(d.ploughs[p], s.z[m.plough_mass[p]], known.draft);
    }
    s.input_power = input_power;
    s.field_power = field_power;
    pair_forces(w, contact, s);
    freewheel_forces(w, contact, s);
    flank_forces(w, contact, s);
    bearing_forces(w, contact, s);
}

void contact_forces(const Work& w, const unsigned char* contact, Sample& s) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    for (int k = 0; k < m.pairs; ++k) {
        s.f[k] = slip_sign(contact[k]) * s.sliding[k];
        if (contact[k] == free_running && m.pair_laws[static_cast<std::size_t>(k)].drag > 0)
            s.f[k] = open_drag(w, k, s);
    }
    freewheel_forces(w, contact, s);
    flank_forces(w, contact, s);
    bearing_forces(w, contact, s);
}

void internal_torques(const Work& w, const Mode& mode, Sample& s) SHIFTRIG_REALTIME {
    if (mode.tree) return tree_internal_torques(w, mode, s);
    const ModelData& m = w.model;
    const int rows = mode.row_count + static_cast<int>(m.translating.size());
    m.kernel.multiply(mode.torques, padded(rows), mode.order + m.forces, read_coordinates(mode, s), nullptr,
                      s.active);
    std::fill(s.torque, s.torque + m.torques, 0.);
    for (int r = 0; r < mode.row_count; ++r) s.torque[mode.rows[r]] = s.active[r];
}

double* read_coordinates(const Mode& mode, const Sample& s) SHIFTRIG_REALTIME {
    double* q = s.f - mode.order;
    for (int i = 0; i < mode.order; ++i) q[i] = s.z[mode.coordinates[i]];
    return q;
}

void show(const ModelData& m, const Mode& mode, const double* q, Sample& s) SHIFTRIG_REALTIME {
    m.kernel.multiply(mode.view, padded(m.seen), mode.order, q, nullptr, s.z);
}

void look(const ModelData& m, const Mode& mode, Sample& s) SHIFTRIG_REALTIME {
    if (mode.tree) return tree_slips(m, mode, s);
    show(m, mode, read_coordinates(mode, s), s);
}

}  // namespace shiftrig::plant::detail
