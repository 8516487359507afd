#include "plant/forces.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "plant/laws/converter.h"
#include "plant/laws/plough.h"
#include "plant/laws/road.h"

namespace shiftrig::plant::detail {
namespace {

// Viscous drag of an open wet clutch.
double open_drag(const Work& w, int k, const Sample& s) noexcept {
    return drag_torque(w.model.pair_laws[static_cast<std::size_t>(k)].drag, w.operators.oil.viscosity,
                       s.slip[k], w.model.description.oil->drag_speed_limit);
}

// Capacities and force of every pair from its load, [Algin] eq. (11).
void pair_forces(const Work& w, const unsigned char* contact, Sample& s) noexcept {
    const ModelData& m = w.model;
    const PairLaw* laws = m.pair_laws.data();
    const double *const static_factor = m.static_factor.data(), *const sliding_at_rest =
                                                                    m.sliding_at_rest.data();
    const double* const load = s.load;
    double* __restrict holding = s.holding, * __restrict sliding = s.sliding;
    const int pairs = m.pairs;
    for (int k = 0; k < pairs; ++k) {
        holding[k] = load[k] * static_factor[k];
        sliding[k] = load[k] * sliding_at_rest[k];
    }
    std::fill(s.f, s.f + pairs, 0.);
    for (int k = 0; k < pairs; ++k) {
        if (contact[k] == locked) continue;
        if (s.load[k] != 0) {  // one that is about to engage shows what it would pass
            s.sliding[k] = sliding_capacity(laws[k].friction, s.load[k], s.slip[k]);
            s.f[k] = slip_sign(contact[k]) * s.sliding[k];
        } else if (contact[k] == free_running && laws[k].drag > 0) {
            s.f[k] = open_drag(w, k, s);
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
        const EngineInput in{input(w, m.throttle), input(w, engine.speed_request_enable) > 0.5,
                             input(w, engine.speed_request), input(w, engine.torque_limit),
                             input(w, engine.fuel_cut) > 0.5};
        known.engine_settings[e] = engine_setting(m.description.engines[e], engine.peak, in);
    }
    for (std::size_t i = 0; i < m.road_mass.size(); ++i) {
        known.grade_forces[i] = grade_force(m.description.roads[i], input(w, m.grade), m.description.gravity);
    }
    for (std::size_t i = 0; i < m.sources.size(); ++i) known.source_inputs[i] = input(w, m.sources[i].input);
    for (std::size_t i = 0; i < m.sensors.size(); ++i) {
        const SensorLaw& law = m.sensors[i];
        known.sensor_faults[i] = {input(w, law.bias), input(w, law.noise), input(w, law.stuck) > 0.5,
                                  input(w, law.dropout) > 0.5, static_cast<int>(input(w, law.missing_teeth))};
    }
    latch_commands(w);
    known.draft = m.draft < 0 ? 1 : input(w, m.draft);
    at_oil_temperature(m, w.operators, input(w, m.oil_temperature));
}

namespace {

// Torques that no contact state concerns, rates of the auxiliary states, and what the laws press together. They read
// speeds where they act: f[force] is paid for by −slip[force].
void law_forces(const Work& w, Sample& s) noexcept {
    const ModelData& m = w.model;
    const Description& d = m.description;
    const OperatorsData& known = w.operators;
    std::fill(s.f + m.first_external, s.f + m.forces, 0.);
    const double* auxiliary = s.auxiliary;
    double* rate = s.auxiliary_rate;
    for (std::size_t t = 0; t < m.tyres.size(); ++t, ++auxiliary, ++rate) {
        const TyreLaw& law = m.tyres[t];
        const BrixiusTyre& tyre = d.tyres[t];
        const double wheel_speed = -s.slip[law.wheel_force], body_speed = -s.slip[law.body_force];
        const TyreMotion motion = tyre_motion(tyre, *auxiliary, wheel_speed, body_speed);
        *rate = motion.rate;
        const double slip = s.tyre_slip[t] = motion.slip;
        const double force = s.tyre_force[t] = tyre_force(known.soils[t], slip);
        s.f[law.wheel_force] -= force * tyre.radius;
        s.f[law.body_force] += force;
        s.load[law.resistance] += tyre_resistance(known.soils[t], slip);
    }
    for (std::size_t e = 0; e < m.engines.size(); ++e, auxiliary += 2, rate += 2) {
        const EngineLaw& law = m.engines[e];
        const Engine& engine = d.engines[e];
        const EngineState state{auxiliary[0], auxiliary[1]};
        const EngineMode mode = w.scratch.engine_modes[e];
        const double speed = -s.slip[law.force];
        const double full = s.engine_full_load[e] = full_load(engine, law.full_load, speed);
        EngineState change;
        if (mode == EngineMode::running)
            change = engine_rate(engine, known.engine_settings[e], state, speed, full);
        rate[0] = change.torque;
        rate[1] = change.boost;
        s.engine_torque[e] = engine_torque(engine, known.engine_settings[e], state, mode, speed, full);
        s.f[law.force] += s.engine_torque[e];
        s.load[law.pair] = stalled_friction_capacity(engine, mode, speed);
    }
    for (std::size_t c = 0; c < m.converters.size(); ++c) {
        const ConverterLaw& law = m.converters[c];
        const ConverterTorques torques =
            converter_torques(d.converters[c], -s.slip[law.pump_force], -s.slip[law.turbine_force]);
        s.converter[2 * c] = torques.pump;
        s.converter[2 * c + 1] = torques.turbine;
        s.f[law.pump_force] -= torques.pump;
        s.f[law.turbine_force] += torques.turbine;
    }
    for (std::size_t i = 0; i < m.sources.size(); ++i) {
        const TorqueSource& source = d.sources[i];
        const int force = m.sources[i].force;
        double torque = known.source_inputs[i];
        if (!source.waveform.pieces.empty()) torque += waveform(source.waveform, s.at.time, s.at.side);
        if (source.quadratic != 0) torque += source.quadratic * s.slip[force] * std::fabs(s.slip[force]);
        s.f[force] += torque;
    }
    for (std::size_t i = 0; i < m.road_force.size(); ++i) {
        const int force = m.road_force[i];
        s.f[force] += known.grade_forces[i] + air_force(d.roads[i], -s.slip[force]);
    }
    for (std::size_t p = 0; p < m.plough_pair.size(); ++p) {
        s.load[m.plough_pair[p]] += plough_draft(d.ploughs[p], -s.slip[m.plough_force[p]], known.draft);
    }
}

}  // namespace

void evaluate_forces(const Work& w, const unsigned char* contact, Sample& s) SHIFTRIG_REALTIME {
    const ScratchData& scratch = w.scratch;
    std::copy(scratch.held.begin(), scratch.held.end(), s.load);
    for (int i = 0; i < scratch.moving_count; ++i) {
        const int k = scratch.moving[static_cast<std::size_t>(i)];
        s.load[k] = pair_load(w, k, s.at);
    }
    law_forces(w, s);
    pair_forces(w, contact, s);
    freewheel_forces(w, contact, s);
    flank_forces(w, contact, s);
    bearing_forces(w, contact, s);
}

void list_passing_pairs(Work& w) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    ScratchData& s = w.scratch;
    s.sliding_count = s.dragging_count = 0;
    int sliding = 0, dragging = 0;
    for (int k = 0; k < m.pairs; ++k) {
        const unsigned char state = w.contact[k];
        if (state == locked) continue;
        const auto i = static_cast<std::size_t>(k);
        if (state != free_running) {
            const bool pressed = s.held[i] != 0 || s.moves[i] || k >= m.actuated_pairs;
            if (pressed) s.sliding[static_cast<std::size_t>(sliding++)] = k;
        } else if (m.pair_laws[i].drag > 0) {
            s.dragging[static_cast<std::size_t>(dragging++)] = k;
        }
    }
    s.sliding_count = sliding;
    s.dragging_count = dragging;
}

void stage_forces(const Work& w, Sample& s) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    const ScratchData& scratch = w.scratch;
    std::copy(scratch.held.begin(), scratch.held.end(), s.load);
    std::fill(s.f, s.f + m.first_external, 0.);
    law_forces(w, s);
    for (int i = 0; i < scratch.sliding_count; ++i) {
        const int k = scratch.sliding[static_cast<std::size_t>(i)];
        const auto at = static_cast<std::size_t>(k);
        const double load = scratch.moves[at] ? pair_load(w, k, s.at) : s.load[k];
        s.f[k] = slip_sign(w.contact[k]) * sliding_capacity(m.pair_laws[at].friction, load, s.slip[k]);
    }
    for (int i = 0; i < scratch.dragging_count; ++i) {
        const int k = scratch.dragging[static_cast<std::size_t>(i)];
        s.f[k] = open_drag(w, k, s);
    }
    freewheel_forces(w, w.contact, s);
    flank_forces(w, w.contact, s);
    bearing_forces(w, w.contact, s);
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
    read_coordinates(mode, s);
    active_torques(w.model, mode, s);
}

void active_torques(const ModelData& m, const Mode& mode, Sample& s) SHIFTRIG_REALTIME {
    const int rows = mode.row_count + static_cast<int>(m.translating.size());
    m.kernel.multiply(mode.torques, padded(rows), mode.order + m.forces, s.f - mode.order, nullptr, s.active);
    double* const torque = s.torque;
    const double* const active = s.active;
    std::fill(torque, torque + m.torques, 0.);
    for (int r = 0, count = mode.row_count; r < count; ++r) torque[mode.rows[r]] = active[r];
}

double* read_coordinates(const Mode& mode, const Sample& s) SHIFTRIG_REALTIME {
    double* q = s.f - mode.order;
    const double* const z = s.z;
    for (int i = 0, order = mode.order; i < order; ++i) q[i] = z[mode.coordinates[i]];
    return q;
}

void show(const ModelData& m, const Mode& mode, const double* q, Sample& s, int rows) SHIFTRIG_REALTIME {
    m.kernel.multiply(mode.view, rows, mode.order, q, nullptr, s.slip);
}

void look(const ModelData& m, const Mode& mode, Sample& s) SHIFTRIG_REALTIME {
    if (mode.tree) return tree_slips(m, mode, s);
    show(m, mode, read_coordinates(mode, s), s, padded(m.seen));
}

}  // namespace shiftrig::plant::detail
