#include "plant/forces.h"

#include <algorithm>
#include <cmath>

#include "plant/devices.h"
#include "plant/few.h"
#include "plant/laws/converter.h"
#include "plant/laws/plough.h"
#include "plant/laws/road.h"

namespace shiftrig::plant::detail {
namespace {

// Viscous drag of an open wet clutch, and what a slipping pair passes on.
double pair_force(const Work& w, int k, unsigned char state, const Sample& s) noexcept {
    const double drag = state == free_running ? w.model.pair_laws[static_cast<std::size_t>(k)].drag : 0;
    return drag_torque(drag, w.operators.oil.viscosity, s.slip[k], w.model.drag_speed_limit) +
           slip_sign(state) * s.sliding[k];
}

// Capacities and force of every pair from its load, [Algin] eq. (11).
void pair_forces(const Work& w, const unsigned char* contact, Sample& s) noexcept {
    const ModelData& m = w.model;
    for (int k = 0; k < m.pairs; ++k) {
        const auto i = static_cast<std::size_t>(k);
        s.holding[k] = s.load[k] * m.static_factor[i];
        // One that is about to engage shows what it would pass.
        s.sliding[k] = contact[k] == locked || s.load[k] == 0
                           ? s.load[k] * m.sliding_at_rest[i]
                           : sliding_capacity(m.pair_laws[i].friction, s.load[k], s.slip[k]);
        s.f[k] = pair_force(w, k, contact[k], s);
    }
}

// The same of pairs that something actuates, for the contact states in force, from their table.
FrictionTerms friction_terms(const Work& w, const double* load, const Sample& s) noexcept {
    const ModelData& m = w.model;
    const ContactTable& table = w.operators.table;
    return {load,
            s.slip,
            table.sense,
            table.drag,
            table.base,
            table.rise,
            table.inverse_speed,
            m.static_factor.data(),
            table.fades,
            m.drag_speed_limit,
            m.actuated_pairs};
}

// Of pairs loaded by nature: what loads them is known after the laws.
void natural_forces(const Work& w, Sample& s, bool complete) noexcept {
    const ModelData& m = w.model;
    const ContactTable& table = w.operators.table;
    for (int k = m.actuated_pairs, pairs = m.pairs; k < pairs; ++k) {
        const auto i = static_cast<std::size_t>(k);
        const double factor =
            table.rise[k] == 0 ? table.base[k] : sliding_factor(m.pair_laws[i].friction, s.slip[k]);
        const double load = s.load[k], sliding = load * factor;
        s.f[k] = table.sense[k] * sliding;
        if (!complete) continue;
        s.sliding[k] = sliding;
        s.holding[k] = load * m.static_factor[i];
    }
}

// Of pairs whose friction factor is a table.
void tabled_forces(const Work& w, Sample& s, bool complete) noexcept {
    for (const int k : w.model.tabled_pairs) {
        if (w.contact[k] == locked) {
            if (complete) s.sliding[k] = s.load[k] * w.model.sliding_at_rest[static_cast<std::size_t>(k)];
            continue;
        }
        const FrictionLaw& law = w.model.pair_laws[static_cast<std::size_t>(k)].friction;
        const double sliding = s.load[k] == 0 ? 0 : sliding_capacity(law, s.load[k], s.slip[k]);
        if (complete) s.sliding[k] = sliding;
        s.f[k] += w.operators.table.sense[k] * sliding;
    }
}

// Of pairs that slip in their weak sense; in the other one they are pairs like any other.
void weak_forces(const Work& w, const unsigned char* contact, Sample& s) noexcept {
    for (const int k : w.model.one_way_pairs) {
        const double sense = slip_sign(contact[k]);
        if (is_weak(w.model, k, sense)) s.f[k] = sense * sliding_limit(w.model, k, sense, s);
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

// What few machines have.
void rare_forces(const Work& w, const unsigned char* contact, Sample& s) noexcept {
    weak_forces(w, contact, s);
    flank_forces(w, contact, s);
    bearing_forces(w, contact, s);
}

// Once the laws are known: what the loop over actuated pairs leaves out.
void further_forces(const Work& w, Sample& s, bool complete) noexcept {
    if (w.model.actuated_pairs < w.model.pairs) natural_forces(w, s, complete);
    if (!w.model.rare_forces) return;
    tabled_forces(w, s, complete);
    rare_forces(w, w.contact, s);
}

}  // namespace

void latch_inputs(Work& w, const Inputs& inputs) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    OperatorsData& known = w.operators;
    const auto count = static_cast<int>(known.raw_input.size());
    if (known.inputs_known && m.kernel.loops.same(known.raw_input.data(), inputs.value.data(), count)) return;
    std::copy(inputs.value.begin(), inputs.value.end(), known.raw_input.begin());
    known.inputs_known = true;
    known.carried = false;
    for (std::size_t i = 0; i < m.inputs.size(); ++i) {
        w.operators.input[i] = m.inputs[i].limited(inputs.value[i]);
    }
    for (std::size_t t = 0; t < m.tyres.size(); ++t) {
        const TyreLaw& law = m.tyres[t];
        w.operators.soils[t] = tyre_soil(m.description.tyres[t], law.share * input(w, law.mobility));
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
    known.teeth_missing = known.sensors_disturbed = false;
    for (std::size_t i = 0; i < m.sensors.size(); ++i) {
        const SensorLaw& law = m.sensors[i];
        known.sensor_faults[i] = {input(w, law.bias), input(w, law.noise), input(w, law.stuck) > 0.5,
                                  input(w, law.dropout) > 0.5, static_cast<int>(input(w, law.missing_teeth))};
        const SensorFaults& faults = known.sensor_faults[i];
        known.teeth_missing |= faults.missing_teeth > 0;
        known.sensors_disturbed |= faults.bias != 0 || faults.noise > 0 || faults.stuck;
    }
    latch_commands(w);
    known.draft = m.draft < 0 ? 1 : input(w, m.draft);
    at_oil_temperature(m, w.operators, input(w, m.oil_temperature));
}

namespace {

void load_pairs(const Work& w, Sample& s) noexcept {
    const ScratchData& scratch = w.scratch;
    copy_few(scratch.held.data(), w.model.pairs, s.load);
    for (int i = 0; i < scratch.moving_count; ++i) {
        const int k = scratch.moving[static_cast<std::size_t>(i)];
        s.load[k] = pair_load(w, k, s.at);
    }
}

// The same for a stage, where nobody looks at the loads afterwards: where those of actuated pairs stand.
const double* stage_loads(const Work& w, Sample& s) noexcept {
    const ModelData& m = w.model;
    const double* const held = w.scratch.held.data();
    if (w.scratch.moving_count > 0 || m.rare_forces) {
        load_pairs(w, s);
        return s.load;
    }
    for (int k = m.actuated_pairs; k < m.pairs; ++k) s.load[k] = held[k];
    return held;
}

// Torques that no contact state concerns, rates of the auxiliary states, and what the laws press together, added to
// what is in f and load. They read speeds where they act: f[force] is paid for by −slip[force].

void tyre_forces(const Work& w, Sample& s) noexcept {
    const ModelData& m = w.model;
    const BrixiusTyre* tyre = m.description.tyres.data();
    const TyreSoil* soil = w.operators.soils.data();
    const double* auxiliary = s.auxiliary;
    double *rate = s.auxiliary_rate, *slip = s.tyre_slip, *traction = s.tyre_force;
    for (const TyreLaw& law : m.tyres) {
        const TyreMotion motion =
            tyre_motion(*tyre, *soil, *auxiliary++, -s.slip[law.wheel_force], -s.slip[law.body_force]);
        *rate++ = motion.rate;
        *slip++ = motion.slip;
        const double force = tyre_force(*soil, motion.slip);
        *traction++ = force;
        s.f[law.wheel_force] -= force * tyre->radius;
        s.f[law.body_force] += force;
        s.load[law.resistance] += tyre_resistance(*soil, motion.slip);
        ++tyre;
        ++soil;
    }
}

void engine_forces(const Work& w, Sample& s) noexcept {
    const ModelData& m = w.model;
    const Engine* engine = m.description.engines.data();
    const EngineSetting* setting = w.operators.engine_settings.data();
    const EngineMode* mode = w.scratch.engine_modes.data();
    const double* auxiliary = s.auxiliary + m.tyres.size();  // those of tyres stand before
    double* rate = s.auxiliary_rate + m.tyres.size();
    double *torque_shown = s.engine_torque, *full_load_shown = s.engine_full_load;
    for (const EngineLaw& law : m.engines) {
        const double speed = -s.slip[law.force];
        const double full = full_load(*engine, law.full_load, speed);
        *full_load_shown++ = full;
        const EngineState state{auxiliary[0], auxiliary[1]};
        const EngineDrive drive = engine_drive(*engine, *setting, state, *mode, speed, full);
        rate[0] = drive.rate.torque;
        rate[1] = drive.rate.boost;
        *torque_shown++ = drive.torque;
        s.f[law.force] += drive.torque;
        if (law.pair >= 0) s.load[law.pair] = stalled_friction_capacity(*engine, *mode, speed);
        auxiliary += 2;
        rate += 2;
        ++engine;
        ++setting;
        ++mode;
    }
}

void converter_forces(const Work& w, Sample& s) noexcept {
    const TorqueConverter* converter = w.model.description.converters.data();
    double* shown = s.converter;
    for (const ConverterLaw& law : w.model.converters) {
        const ConverterTorques torques =
            converter_torques(*converter++, -s.slip[law.pump_force], -s.slip[law.turbine_force]);
        *shown++ = torques.pump;
        *shown++ = torques.turbine;
        s.f[law.pump_force] -= torques.pump;
        s.f[law.turbine_force] += torques.turbine;
    }
}

void source_forces(const Work& w, Sample& s) noexcept {
    const TorqueSource* source = w.model.description.sources.data();
    const double* told = w.operators.source_inputs.data();
    for (const SourceLaw& law : w.model.sources) {
        double torque = *told++;
        if (!source->waveform.pieces.empty()) torque += waveform(source->waveform, s.at.time, s.at.side);
        if (source->quadratic != 0)
            torque += source->quadratic * s.slip[law.force] * std::fabs(s.slip[law.force]);
        s.f[law.force] += torque;
        ++source;
    }
}

void ground_forces(const Work& w, Sample& s) noexcept {
    const ModelData& m = w.model;
    const Road* road = m.description.roads.data();
    const double* grade = w.operators.grade_forces.data();
    for (const int force : m.road_force) s.f[force] += *grade++ + air_force(*road++, -s.slip[force]);
    for (const PloughLaw& law : m.ploughs)
        s.load[law.pair] += plough_draft(law.curve, -s.slip[law.force], w.operators.draft);
}

void law_forces(const Work& w, Sample& s) noexcept {
    const ModelData& m = w.model;
    if (!m.tyres.empty()) tyre_forces(w, s);
    if (!m.engines.empty()) engine_forces(w, s);
    if (!m.converters.empty()) converter_forces(w, s);
    if (!m.sources.empty()) source_forces(w, s);
    if (!m.road_force.empty() || !m.ploughs.empty()) ground_forces(w, s);
}

}  // namespace

void evaluate_forces(const Work& w, const unsigned char* contact, Sample& s) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    load_pairs(w, s);
    std::fill(s.f, s.f + m.forces, 0.);
    law_forces(w, s);
    pair_forces(w, contact, s);
    if (w.model.rare_forces) rare_forces(w, contact, s);
}

void stage_forces(const Work& w, Sample& s) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    const bool acts = w.operators.table.acts;
    const double* const load = stage_loads(w, s);
    if (acts) m.kernel.loops.slide(friction_terms(w, load, s), s.f);
    clear_few(acts ? s.f + m.actuated_pairs : s.f, s.f + m.forces);  // the loop went beyond
    law_forces(w, s);
    further_forces(w, s, false);
}

void end_forces(const Work& w, Sample& s) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    load_pairs(w, s);
    const double* const load = w.scratch.moving_count > 0 ? s.load : w.scratch.held.data();
    m.kernel.loops.press(friction_terms(w, load, s), s.f, s.holding, s.sliding);
    clear_few(s.f + m.actuated_pairs, s.f + m.forces);
    for (int i = 0; i < w.scratch.moving_count;
         ++i) {  // one that is about to engage shows what it would pass
        const int k = w.scratch.moving[static_cast<std::size_t>(i)];
        if (w.contact[k] != free_running || s.load[k] == 0) continue;
        s.sliding[k] =
            sliding_capacity(m.pair_laws[static_cast<std::size_t>(k)].friction, s.load[k], s.slip[k]);
    }
    law_forces(w, s);
    further_forces(w, s, true);
}

void contact_forces(const Work& w, const unsigned char* contact, Sample& s) SHIFTRIG_REALTIME {
    for (int k = 0; k < w.model.pairs; ++k) s.f[k] = pair_force(w, k, contact[k], s);
    if (w.model.rare_forces) rare_forces(w, contact, s);
}

void internal_torques(const Work& w, const Mode& mode, Sample& s) SHIFTRIG_REALTIME {
    if (mode.tree) return tree_internal_torques(w, mode, s);
    read_coordinates(mode, s);
    active_torques(w.model, mode, s);
}

void row_torques(const ModelData& m, const Mode& mode, Sample& s) SHIFTRIG_REALTIME {
    const int rows = mode.row_count + static_cast<int>(m.translating.size());
    m.kernel.multiply(mode.torques, padded(rows), mode.order + m.forces, s.f - mode.order, nullptr, s.active);
}

void active_torques(const ModelData& m, const Mode& mode, Sample& s) SHIFTRIG_REALTIME {
    row_torques(m, mode, s);
    double* const torque = s.torque;
    const double* const active = s.active;
    for (int k = 0, pairs = m.pairs; k < pairs; ++k) torque[k] = 0;
    for (int r = 0, closed = mode.first_mesh; r < closed; ++r) torque[mode.rows[r]] = active[r];
    double *const mesh = torque + m.pairs, *const lost = mesh + m.meshes;
    for (int k = 0, meshes = m.meshes; k < meshes; ++k) {
        mesh[k] = active[mode.first_mesh + k];
        lost[k] = 0;
    }
    for (int r = mode.first_mesh + m.meshes; r < mode.row_count; ++r) torque[mode.rows[r]] = active[r];
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
