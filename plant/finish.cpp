#include "plant/finish.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "plant/devices.h"
#include "plant/few.h"
#include "plant/laws/sensor.h"
#include "plant/ledger.h"
#include "plant/stuck_meshes.h"
#include "plant/telling.h"
#include "plant/transitions.h"

namespace shiftrig::plant::detail {
namespace {

constexpr std::uint64_t noise_seed = 0x5edf;  // plus the model's; sensors draw from their own streams of it

void load_sample(const ModelData& m, const double* block, double time, Sample& s) {
    std::copy(block + m.layout.speeds, block + m.layout.speeds + m.masses, s.z);
    std::copy(block + m.layout.twists, block + m.layout.twists + m.twists, s.z + m.masses);
    std::copy(block + m.layout.auxiliary, block + m.layout.auxiliary + m.auxiliary, s.auxiliary);
    std::fill(s.torque, s.torque + m.torques, 0.);
    s.at = {time, 0, Side::right};
    s.groups.mode = nullptr;
}

// A few numbers are compared and copied here, many of a long chain by whole registers.
constexpr int few = 32;
bool same_state(const ModelData& m, const double* a, const double* b) {
    return m.states > few ? m.kernel.loops.same(a, b, m.states) : same_bits(a, b, m.states);
}
void copy_state(const ModelData& m, const double* from, double* to) {
    m.states > few ? m.kernel.loops.copy(from, m.states, to) : void(copy_few(from, m.states, to));
}

// Is the sample that the last step ended with the beginning of this one? Then its forces and torques are
// what computing them again would give, bit for bit. They come from speeds, twists, auxiliary states, contact states and
// the engines' modes.
bool is_carried(const ModelData& m, const OperatorsData& o, const double* block) {
    if (!o.carried || m.depends_on_time) return false;
    const StateLayout& at = m.layout;
    const Sample& s = o.samples[o.first];
    // The step ended with the table up to date.
    return same_state(m, s.z, block + at.speeds) &&
           same_bits(s.auxiliary, block + at.auxiliary, m.auxiliary) &&
           same_states(o.table.contact.data(), reinterpret_cast<const unsigned char*>(block + at.contact),
                       m.contact_bytes) &&
           same_bits(o.carried_engines.data(), block + at.engines, 3 * static_cast<int>(m.engines.size()));
}

// Would settling turn the loss of a mesh that others hold? Of meshes in motion the step has seen to that.
bool turns_at_rest(const Work& w, const Sample& s) {
    double size = -1;
    for (const int k : w.model.lossy_meshes) {
        const unsigned char state = w.contact[w.model.pairs + k];
        if (state == stuck) continue;
        const double sign = motion_sign(state), torque = s.torque[w.model.pairs + k] - loss_kink(w, k, sign);
        if ((torque * sign < 0 ? -1 : 1) == loss_exponent(state)) continue;
        if (size < 0) size = 1e-9 * torque_scale(w, s);
        if (std::fabs(torque) > size) return true;
    }
    return false;
}

// Would settling let a pair go that nothing presses any more, or engage one?
bool engages_or_releases(const Work& w, const Sample& s) {
    const ModelData& m = w.model;
    return !m.kernel.loops.pressed_engage(s.sliding, s.holding, w.operators.table.state_code, m.pairs);
}

void reset(Outputs& outputs, ScratchData& scratch, int forces) {
    outputs.certificate = {};
    outputs.event_count = 0;
    scratch.tells_on = false;
    if (scratch.noted_count > 0) forget_notes(scratch);  // a look leaves them untold
    clear_few(scratch.work, scratch.work + forces);
    scratch.dissipated = scratch.input_work = 0;
    scratch.part_mode = nullptr;
}

void advance_temperatures(Work& w) {
    const ModelData& m = w.model;
    const auto count = static_cast<int>(m.heated_pairs.size());
    if (count == 0) return;
    double* const before = w.scratch.vector_b;
    const HeatNumbers& heat = m.heat;
    const HeatTerms terms{
        heat.e11.data(), heat.e12.data(),  heat.e21.data(),  heat.e22.data(),  heat.f1.data(),
        heat.f2.data(),  heat.warn.data(), heat.fail.data(), heat.pair.data(), count};
    double* const surface = w.next + m.layout.temperatures;
    if (!m.kernel.loops.heat(terms, w.scratch.work, 1 / w.h, input(w, m.oil_temperature), surface,
                             surface + m.layout.bulk_temperature, before))
        return;
    for (int i = 0; i < count; ++i) {
        const auto k = static_cast<std::size_t>(i);
        const auto passes = [&](double limit) { return before[i] < limit && surface[i] >= limit; };
        const auto tell = [&](EventKind kind) {
            log_event(w, {.time = w.start + w.h,
                          .kind = kind,
                          .device = device_index(m.heated_pairs[k]),
                          .value = surface[i]});
        };
        if (passes(heat.warn[k])) tell(EventKind::facing_warning);
        if (passes(heat.fail[k])) tell(EventKind::facing_failure);
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
        const int device = m.contact_bytes + static_cast<int>(e);
        if (next != mode && next != EngineMode::cranking) {
            const EventKind kind =
                next == EngineMode::stalled ? EventKind::engine_stalls : EventKind::engine_starts;
            log_event(w, {.time = w.start + w.h,
                          .kind = kind,
                          .device = device_index(device),
                          .torque = state[0],
                          .value = speed});
        }
        if (next != mode) w.scratch.carries = false;  // another law from now on
        if (next != EngineMode::running) state[0] = state[1] = 0;
        at[0] = static_cast<double>(static_cast<int>(next));
        at[2] = start;
    }
}

// A wheel with missing teeth tells each tooth from the others.
void pick_up_slowly(Work& w, const SensorSlots& slots, const double* begin_speeds, const double* end_speeds) {
    const ModelData& m = w.model;
    for (std::size_t i = 0; i < m.sensors.size(); ++i) {
        const int mass = m.sensors[i].mass;
        SensorState state{slots.position[i], slots.since_edge[i], slots.reading[i], 0};
        advance_pickup(m.description.sensors[i], state, begin_speeds[mass], end_speeds[mass], w.h,
                       w.operators.sensor_faults[i].missing_teeth);
        slots.position[i] = state.position;
        slots.since_edge[i] = state.since_edge;
        slots.reading[i] = state.reading;
    }
}

void disturb_readings(Work& w, const SensorSlots& slots) {
    const auto count = static_cast<std::uint64_t>(read_integer(w.next) + 1);
    const std::uint64_t seed = noise_seed + w.model.options.seed;
    for (std::size_t i = 0; i < w.model.sensors.size(); ++i) {
        const SensorFaults& faults = w.operators.sensor_faults[i];
        SensorState state{0, 0, slots.reading[i], slots.output[i]};
        sensor_output(state, faults, faults.noise > 0 ? noise(seed, i, count) : 0);
        slots.output[i] = state.output;
    }
}

// While the block still holds the speeds that the step began with.
void advance_sensors(Work& w, const double* end_speeds) {
    const ModelData& m = w.model;
    const int count = static_cast<int>(m.sensors.size());
    if (count == 0) return;
    const double* begin_speeds = w.next + m.layout.speeds;
    const SensorSlots slots = sensor_slots(m.layout, m.sensors.size(), w.next);
    if (w.operators.teeth_missing) {
        pick_up_slowly(w, slots, begin_speeds, end_speeds);
    } else {
        const PickupNumbers& p = m.pickups;
        const PickupTerms terms{p.teeth.data(),          p.pitch.data(), p.directional.data(),
                                p.drop_out_speed.data(), p.mass.data(),  count};
        m.kernel.loops.pick_up(terms, begin_speeds, end_speeds, w.h, slots.position, slots.since_edge,
                               slots.reading);
    }
    if (w.operators.sensors_disturbed) {
        disturb_readings(w, slots);
    } else {
        copy_few(slots.reading, count, slots.output);
    }
}

// Residual of [Algin] eq. (15) at the sample, as a length, relative to that of all torques in it.
double torque_residual(Work& w, const Mode& mode, const Sample& s) {
    const ModelData& m = w.model;
    if (mode.tree) return s.torque_residual;
    if (mode.row_count == 0) return 0;
    double* const rest = w.scratch.vector_a;
    // q, f, M stand side by side.
    m.kernel.multiply(mode.balance, padded(mode.row_count), mode.order + m.forces + mode.row_count,
                      s.f - mode.order, nullptr, rest);
    return std::sqrt(m.kernel.loops.share_of_squares(rest, mode.row_count, s.f, m.forces + mode.row_count));
}

double constraint_violation(const Mode& mode, const double* speeds) {
    return largest_of(mode.row_count, [&](int r) { return slip_fast(mode.row_links[r], speeds); });
}

}  // namespace

Work begin_step(const ModelData& m, OperatorsData& operators, State& state, Outputs& outputs,
                ScratchData& scratch) SHIFTRIG_REALTIME {
    double* block = state.block.data();
    auto* contact = reinterpret_cast<unsigned char*>(block + m.layout.contact);
    const double h = m.options.step_size;
    const double time = static_cast<double>(read_integer(block)) * h;
    reset(outputs, scratch, m.forces);
    scratch.first = &operators.samples[operators.first];
    scratch.last = &operators.samples[1 - operators.first];
    if (is_carried(m, operators, block)) {
        scratch.begin().at = {time, 0, Side::right};
        scratch.stored_before = operators.carried_energy;
    } else {
        operators.carried = false;
        load_sample(m, block, time, scratch.begin());
        scratch.stored_before = stored_energy(m, scratch.begin().z, contact);
    }
    copy_states(contact, m.contact_bytes, scratch.before.data());
    for (std::size_t e = 0; e < m.engines.size(); ++e) {
        scratch.engine_modes[e] =
            static_cast<EngineMode>(static_cast<int>(block[m.layout.engines + 3 * static_cast<int>(e)]));
    }
    outputs.certificate.mode_misses = -static_cast<std::int32_t>(operators.misses);
    return {m, operators, block, block, outputs, scratch, contact, time, h};
}

bool is_begun(const Work& w) SHIFTRIG_REALTIME {
    if (!w.operators.carried) return false;
    const ScratchData& scratch = w.scratch;
    const Sample& s = scratch.begin();
    if (scratch.moving_count == 0) return same_bits(scratch.held.data(), s.load, w.model.actuated_pairs);
    for (int k = 0; k < w.model.actuated_pairs; ++k) {
        const auto i = static_cast<std::size_t>(k);
        if ((scratch.moves[i] ? pair_load(w, k, s.at) : scratch.held[i]) != s.load[k]) return false;
    }
    return true;
}

Work begin_look(const ModelData& m, OperatorsData& operators, const State& state, Outputs& outputs,
                ScratchData& scratch) SHIFTRIG_REALTIME {
    const double* block = state.block.data();
    const auto* contact = reinterpret_cast<const unsigned char*>(block + m.layout.contact);
    const double h = m.options.step_size;
    const double time = static_cast<double>(read_integer(block)) * h;
    reset(outputs, scratch, m.forces);
    scratch.first = &operators.samples[operators.first];
    scratch.last = &operators.samples[1 - operators.first];
    operators.carried = false;
    load_sample(m, block, time, scratch.begin());
    copy_states(contact, m.contact_bytes, scratch.before.data());
    for (std::size_t e = 0; e < m.engines.size(); ++e) {
        scratch.engine_modes[e] =
            static_cast<EngineMode>(static_cast<int>(block[m.layout.engines + 3 * static_cast<int>(e)]));
    }
    outputs.certificate.mode_misses = -static_cast<std::int32_t>(operators.misses);
    return {m, operators, block, nullptr, outputs, scratch, scratch.before.data(), time, h};
}

void accept(Work& w) SHIFTRIG_REALTIME {
    std::swap(w.scratch.first, w.scratch.last);
    w.scratch.begin().at.side = Side::right;
}

void finish_step(Work& w, const Mode& mode) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    ScratchData& s = w.scratch;
    const StateLayout& layout = m.layout;
    double* block = w.next;
    Certificate& certificate = w.outputs.certificate;

    for (int k = 0; k < m.pairs; ++k) block[layout.heat + k] += s.work[k];
    tabulate_contact(w, mode);
    advance_sensors(w, s.begin().z);
    write_integer(block, read_integer(block) + 1);
    copy_state(m, s.begin().z, block + layout.speeds);  // twists follow the speeds
    copy_few(s.begin().auxiliary, m.auxiliary, block + layout.auxiliary);
    advance_engine_modes(w);
    advance_temperatures(w);
    block[layout.energy] += s.input_work;
    block[layout.energy + 1] += s.dissipated;

    s.stored = stored_energy(m, s.begin().z, w.contact);
    certificate.energy_defect = s.stored - s.stored_before - s.input_work + s.dissipated;
    certificate.torque_residual = torque_residual(w, mode, s.begin());
    certificate.constraint_violation = constraint_violation(mode, s.begin().z);
    certificate.mode_misses += static_cast<std::int32_t>(w.operators.misses);
    if (!std::isfinite(s.stored))
        certificate.flags |= Certificate::not_finite;  // a sum over every speed and twist
    tell_step(w, mode);
    fill_outputs(w, mode, s.begin());

    OperatorsData& o = w.operators;
    o.first = static_cast<int>(s.first - o.samples);
    o.carried = s.carries && !engages_or_releases(w, s.begin()) &&
                !(mode.rests && (turns_at_rest(w, s.begin()) || loses_too_much(w, mode, s.begin())));
    o.carried_energy = s.stored;
    copy_few(block + layout.engines, 3 * static_cast<int>(m.engines.size()), o.carried_engines.data());
}

void finish_look(Work& w, const Mode& mode) SHIFTRIG_REALTIME {
    Sample& s = w.scratch.begin();
    tabulate_contact(w, mode);
    w.outputs.certificate.constraint_violation = constraint_violation(mode, s.z);
    w.outputs.certificate.torque_residual = torque_residual(w, mode, s);
    w.outputs.certificate.mode_misses += static_cast<std::int32_t>(w.operators.misses);
    w.outputs.event_count = 0;
    w.scratch.stored = stored_energy(w.model, s.z, w.contact);
    fill_outputs(w, mode, s);
}

}  // namespace shiftrig::plant::detail
