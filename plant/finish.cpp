#include "plant/finish.h"

#include <algorithm>
#include <cmath>

#include "plant/laws/sensor.h"
#include "plant/ledger.h"
#include "plant/transitions.h"

namespace shiftrig::plant::detail {
namespace {

constexpr std::uint64_t noise_seed = 0x5ee0;  // sensors draw from their own streams of it

void load_sample(const ModelData& m, const double* block, double time, Sample& s) {
    std::copy(block + m.layout.speeds, block + m.layout.speeds + m.masses, s.z);
    std::copy(block + m.layout.twists, block + m.layout.twists + m.twists, s.z + m.masses);
    std::fill(s.z + m.states, s.z + m.states_padded, 0.);
    std::copy(block + m.layout.auxiliary, block + m.layout.auxiliary + m.auxiliary, s.auxiliary);
    std::fill(s.torque, s.torque + m.torques, 0.);
    s.at = {time, 0, Side::right};
}

void reset(Outputs& outputs, ScratchData& scratch) {
    outputs.certificate = {};
    outputs.event_count = 0;
    std::fill(scratch.heat.begin(), scratch.heat.end(), 0.);
    scratch.dissipated = scratch.input_work = 0;
    scratch.begin_groups = nullptr;
}

double input(const Work& w, int index) { return index < 0 ? 0 : w.scratch.input[static_cast<std::size_t>(index)]; }

void advance_temperatures(Work& w) {
    const ModelData& m = w.model;
    const double oil = input(w, m.oil_temperature);
    for (int k = 0; k < m.pairs; ++k) {
        const PairLaw& law = m.pair_laws[static_cast<std::size_t>(k)];
        if (!law.heat) continue;
        double* at = w.next + law.temperature;
        HeatState state{at[0], at[1]};
        advance_heat(law.heat_operator, state, w.scratch.heat[static_cast<std::size_t>(k)] / w.h, oil);
        const auto passes = [&](double limit) { return limit > 0 && at[0] < limit && state.surface >= limit; };
        const double end = w.start + w.h;
        if (passes(law.heat->warn_temperature)) log_event(w, EventKind::facing_warning, k, end, 0, 0, state.surface);
        if (passes(law.heat->fail_temperature)) log_event(w, EventKind::facing_failure, k, end, 0, 0, state.surface);
        at[0] = state.surface;
        at[1] = state.bulk;
    }
}

void advance_engine_modes(Work& w) {
    const ModelData& m = w.model;
    for (std::size_t e = 0; e < m.engines.size(); ++e) {
        double* at = w.next + m.layout.engines + 3 * static_cast<int>(e);
        double* state = w.next + m.layout.auxiliary + static_cast<int>(m.tyres.size() + 2 * e);
        const EngineLaw& law = m.engines[e];
        const double speed = w.next[m.layout.speeds + law.mass];
        const double start = input(w, law.start);
        const auto mode = static_cast<EngineMode>(static_cast<int>(at[0]));
        const EngineMode next =
            next_engine_mode(m.description.engines[e], mode, speed, start > 0.5 && at[2] <= 0.5, w.h, at[1]);
        const int device = m.pairs + m.meshes + static_cast<int>(e);
        if (next != mode && next != EngineMode::cranking) {
            const EventKind kind = next == EngineMode::stalled ? EventKind::engine_stalls : EventKind::engine_starts;
            log_event(w, kind, device, w.start + w.h, state[0], 0, speed);
        }
        if (next != EngineMode::running) state[0] = state[1] = 0;
        at[0] = static_cast<double>(static_cast<int>(next));
        at[2] = start;
    }
}

void advance_sensors(Work& w, const double* old_speeds) {
    const ModelData& m = w.model;
    const auto count = static_cast<std::uint64_t>(read_integer(w.next));
    for (std::size_t i = 0; i < m.sensors.size(); ++i) {
        const SensorLaw& law = m.sensors[i];
        double* at = w.next + m.layout.sensors + 4 * static_cast<int>(i);
        SensorState state{at[0], at[1], at[2], at[3]};
        const SensorFaults faults{input(w, law.bias), input(w, law.noise), input(w, law.stuck) > 0.5,
                                  input(w, law.dropout) > 0.5, static_cast<int>(input(w, law.missing_teeth))};
        advance_pickup(m.description.sensors[i], state, old_speeds[law.mass], w.next[m.layout.speeds + law.mass], w.h,
                       faults.missing_teeth);
        const double deviate = faults.noise > 0 ? noise(noise_seed, i, count) : 0;
        sensor_output(state, faults, deviate);
        at[0] = state.position;
        at[1] = state.since_edge;
        at[2] = state.reading;
        at[3] = state.output;
    }
}

// Residual of [Algin] eq. (15) at the sample: accelerations of the active rows from M̃ and M_R, term by term,
// relative to the terms.
double torque_residual(Work& w, const Mode& mode, const Sample& s) {
    const ModelData& m = w.model;
    double* torque = w.scratch.vector_a.data();   // on each mass
    double* size = w.scratch.vector_b.data();     // Σ of magnitudes
    std::fill(torque, torque + m.masses, 0.);
    std::fill(size, size + m.masses, 0.);
    const auto take = [&](const auto& links, double moment) {
        for (const Link& link : links) {
            if (link.mass < 0) continue;
            torque[link.mass] -= link.factor * moment;
            size[link.mass] += std::fabs(link.factor * moment);
        }
    };
    for (int k = 0; k < m.forces; ++k) take(m.force_columns[static_cast<std::size_t>(k)], s.f[k]);
    for (int e = 0; e < m.twists; ++e) {
        const Elastic& shaft = m.structure.shafts[static_cast<std::size_t>(e)];
        take(shaft.links, shaft.stiffness * s.z[m.masses + e] + shaft.damping * slip_of(shaft.links, s.z));
    }
    for (const Elastic& damper : m.structure.dampers) take(damper.links, damper.damping * slip_of(damper.links, s.z));
    for (int r = 0; r < mode.row_count; ++r) {
        const int unknown = mode.rows[r];
        if (unknown < m.pairs) {
            take(m.structure.pairs[static_cast<std::size_t>(unknown)].links, s.torque[unknown]);
        } else if (unknown < m.pairs + m.meshes) {
            const int k = unknown - m.pairs;
            const Mesh& mesh = m.structure.meshes[static_cast<std::size_t>(k)];
            const bool resting = mode.bound[unknown] || mode.key[unknown] == 0;
            const int x = resting ? 0 : mode.key[unknown] == 2 ? -1 : 1;
            take(mesh.column(mesh.force_ratio(x)), s.torque[unknown]);
        } else {
            const Mesh& mesh = m.structure.meshes[static_cast<std::size_t>(unknown - m.pairs - m.meshes)];
            take(std::array<Link, 2>{Link{mesh.second, mesh.ratio}, Link{mesh.carrier, -mesh.ratio}}, s.torque[unknown]);
        }
    }
    double worst = 0;
    const auto examine = [&](const auto& links) {
        double sum = 0, terms = 0;
        for (const Link& link : links) {
            if (link.mass < 0) continue;
            const double inertia = m.structure.inertia[static_cast<std::size_t>(link.mass)];
            sum += link.factor * torque[link.mass] / inertia;
            terms += std::fabs(link.factor) * size[link.mass] / inertia;
        }
        if (terms > 0) worst = std::max(worst, std::fabs(sum) / terms);
    };
    for (int r = 0; r < mode.row_count; ++r) {
        const int unknown = mode.rows[r];
        if (unknown < m.pairs) examine(m.structure.pairs[static_cast<std::size_t>(unknown)].links);
        else if (unknown < m.pairs + m.meshes) {
            const Mesh& mesh = m.structure.meshes[static_cast<std::size_t>(unknown - m.pairs)];
            examine(mesh.column(mesh.ratio));
        } else examine(m.structure.meshes[static_cast<std::size_t>(unknown - m.pairs - m.meshes)].motion());
    }
    return worst;
}

double constraint_violation(const Work& w, const Mode& mode, const double* speeds) {
    const ModelData& m = w.model;
    double worst = 0;
    for (int r = 0; r < mode.row_count; ++r) {
        const int unknown = mode.rows[r];
        double slip;
        if (unknown < m.pairs) {
            slip = slip_of(m.structure.pairs[static_cast<std::size_t>(unknown)].links, speeds);
        } else if (unknown < m.pairs + m.meshes) {
            const Mesh& mesh = m.structure.meshes[static_cast<std::size_t>(unknown - m.pairs)];
            slip = 0;
            for (const Link& link : mesh.column(mesh.ratio)) {
                if (link.mass >= 0) slip += link.factor * speeds[link.mass];
            }
        } else {
            slip = slip_of(m.structure.meshes[static_cast<std::size_t>(unknown - m.pairs - m.meshes)].motion(), speeds);
        }
        worst = std::max(worst, std::fabs(slip));
    }
    return worst;
}

// Emits the events that belong to the step as a whole.
void report_changes(Work& w, const Mode& mode) {
    const ModelData& m = w.model;
    const double end = w.start + w.h;
    const Sample& s = w.scratch.end;
    for (int k = 0; k < m.meshes; ++k) {
        const unsigned char was = w.scratch.before[static_cast<std::size_t>(m.pairs + k)], is = w.contact[m.pairs + k];
        if (was == stuck || is == stuck || loss_exponent(was) == loss_exponent(is)) continue;
        log_event(w, EventKind::drive_side, m.pairs + k, w.start, s.torque[m.pairs + k], 0, loss_exponent(is));
    }
    double& tie_up = w.next[m.layout.tie_up];
    if (mode.redundant) w.outputs.certificate.flags |= 1;
    for (int k = 0; mode.redundant && tie_up == 0 && k < m.pairs; ++k) {
        if (mode.bound[k] & shares_load) log_event(w, EventKind::tie_up, k, end, s.torque[k], s.holding[k], 0);
    }
    tie_up = mode.redundant ? 1 : 0;
    if (w.outputs.certificate.fall_backs > 0) log_event(w, EventKind::fall_back, -1, end, 0, 0, 0);
}

}  // namespace

Work begin_step(const ModelData& m, OperatorsData& operators, State& state, Outputs& outputs,
                ScratchData& scratch) SHIFTRIG_REALTIME {
    double* block = state.block.data();
    auto* contact = reinterpret_cast<unsigned char*>(block + m.layout.contact);
    const double h = m.options.step_size;
    const double time = static_cast<double>(read_integer(block)) * h;
    reset(outputs, scratch);
    load_sample(m, block, time, scratch.begin);
    std::copy(contact, contact + m.contact_bytes, scratch.before.begin());
    outputs.certificate.mode_misses = -static_cast<std::int32_t>(operators.misses);
    return {m, operators, block, block, outputs, scratch, contact, time, h};
}

Work begin_look(const ModelData& m, OperatorsData& operators, const State& state, Outputs& outputs,
                ScratchData& scratch) SHIFTRIG_REALTIME {
    const double* block = state.block.data();
    const auto* contact = reinterpret_cast<const unsigned char*>(block + m.layout.contact);
    const double h = m.options.step_size;
    const double time = static_cast<double>(read_integer(block)) * h;
    reset(outputs, scratch);
    load_sample(m, block, time, scratch.begin);
    std::copy(contact, contact + m.contact_bytes, scratch.before.begin());
    outputs.certificate.mode_misses = -static_cast<std::int32_t>(operators.misses);
    return {m, operators, block, nullptr, outputs, scratch, scratch.before.data(), time, h};
}

void accept(Work& w) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    const Sample& end = w.scratch.end;
    Sample& begin = w.scratch.begin;
    std::copy(end.z, end.z + m.columns, begin.z);  // z and f
    std::copy(end.auxiliary, end.auxiliary + m.auxiliary, begin.auxiliary);
    std::copy(end.sliding, end.sliding + m.pairs, begin.sliding);
    std::copy(end.holding, end.holding + m.pairs, begin.holding);
    std::copy(end.torque, end.torque + m.torques, begin.torque);
    begin.at = {end.at.time, end.at.fraction, Side::right};
    w.scratch.begin_groups = nullptr;
}

void finish_step(Work& w, const Mode& mode) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    ScratchData& s = w.scratch;
    const StateLayout& layout = m.layout;
    double* block = w.next;
    Certificate& certificate = w.outputs.certificate;

    double* old_speeds = s.vector_c.data();
    std::copy(block + layout.speeds, block + layout.speeds + m.masses, old_speeds);
    write_integer(block, read_integer(block) + 1);
    const double before = stored_energy(m, block + layout.speeds);
    std::copy(s.begin.z, s.begin.z + m.states, block + layout.speeds);
    std::copy(s.begin.auxiliary, s.begin.auxiliary + m.auxiliary, block + layout.auxiliary);
    advance_sensors(w, old_speeds);
    advance_engine_modes(w);
    advance_temperatures(w);
    for (int k = 0; k < m.pairs; ++k) block[layout.heat + k] += s.heat[static_cast<std::size_t>(k)];
    block[layout.energy] += s.input_work;
    block[layout.energy + 1] += s.dissipated;

    certificate.energy_defect = stored_energy(m, s.begin.z) - before - s.input_work + s.dissipated;
    certificate.torque_residual = mode.tree ? s.torque_residual : torque_residual(w, mode, s.end);
    certificate.constraint_violation = constraint_violation(w, mode, s.begin.z);
    certificate.mode_misses += static_cast<std::int32_t>(w.operators.misses);
    double sum = 0;
    for (int i = 0; i < m.states; ++i) sum += s.begin.z[i];
    if (!std::isfinite(sum)) certificate.flags |= 4;
    report_changes(w, mode);
    fill_outputs(w, mode, s.end);
}

void finish_look(Work& w, const Mode& mode) SHIFTRIG_REALTIME {
    Sample& s = w.scratch.begin;
    sample_rate(w, mode, s);
    w.outputs.certificate.constraint_violation = constraint_violation(w, mode, s.z);
    w.outputs.certificate.torque_residual = torque_residual(w, mode, s);
    w.outputs.certificate.mode_misses += static_cast<std::int32_t>(w.operators.misses);
    w.outputs.event_count = 0;
    fill_outputs(w, mode, s);
}

}  // namespace shiftrig::plant::detail
