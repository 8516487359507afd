// Valves, pistons and pedals over one step. They do not feel the mechanics, so they are advanced first.
#include <algorithm>
#include <limits>
#include <span>

#include "plant/few.h"
#include "plant/forces.h"

namespace shiftrig::plant::detail {
namespace {

StepValues complement(const StepValues& y) noexcept {
    return {1 - y.begin, 1 - y.middle, 1 - y.end};
}

// The load of this pair takes its course within the step.
void let_move(ScratchData& s, int pair) noexcept {
    s.moves[static_cast<std::size_t>(pair)] = 1;
    s.moving[static_cast<std::size_t>(s.moving_count++)] = pair;
}

// The same pressure all the step long.
double held_load(const Work& w, int pair, double pressure) noexcept {
    const auto i = static_cast<std::size_t>(pair);
    const PairCommand& command = w.operators.commands[i];
    return command.fixed ? w.operators.rest_loads[i]
                         : load_from_pressure(w.model.pair_laws[i].friction, pressure * command.scale);
}

// A pedal on its way.
void advance_pedal(Work& w, int pair) noexcept {
    const auto i = static_cast<std::size_t>(pair);
    const PairLaw& law = w.model.pair_laws[i];
    const PairCommand& command = w.operators.commands[i];
    double& position = w.next[law.actuator];
    if (position == command.target) return;  // arrived: its load is known
    StepValues values = advance_lag(law.lag, position, command.target);
    if (law.source == LoadSource::release) values = complement(values);
    if (command.fixed) return;
    w.scratch.loads[i].values = values;
    if (values.begin != values.end) {
        let_move(w.scratch, pair);
    } else {
        w.scratch.held[i] = load_from_engagement(law.friction, values.begin);
    }
}

void take_course(Work& w, int pair, const HydraulicStep& step) noexcept {
    const auto i = static_cast<std::size_t>(pair);
    if (w.operators.commands[i].fixed) return;
    w.scratch.loads[i].hydraulic = step;
    if (step.rests()) {
        w.scratch.held[i] = held_load(w, pair, step.chamber(0));
    } else {
        let_move(w.scratch, pair);
    }
}

// The valve over the step. A piston that it may move joins those that are to share the pump.
void begin_hydraulics(Work& w, int pair) noexcept {
    const auto i = static_cast<std::size_t>(pair);
    ScratchData& s = w.scratch;
    const PairLaw& law = w.model.pair_laws[i];
    const PairCommand& command = w.operators.commands[i];
    const HydraulicOperator& op = w.operators.hydraulics[i];
    const ActuationHydraulic& hydraulic = *law.hydraulic;
    const double return_pressure = law.friction.return_pressure;
    HydraulicState state = read_hydraulic(w.next + law.actuator);
    double pressure = command.target;
    if (hydraulic.solenoid) pressure = solenoid_pressure(*hydraulic.solenoid, state.play, pressure);
    const std::span<double> line(w.next + law.actuator + hydraulic_slots,
                                 static_cast<std::size_t>(law.delay_slots));
    const ValveTargets targets = latch_command(hydraulic, op, state, line, pressure);
    const ValveBefore before{state, targets};
    const StepValues valve = valve_over_step(hydraulic, op, state, targets, command.valve_held);
    if (needs_course(hydraulic, return_pressure, state.piston, valve)) {
        const auto n = static_cast<std::size_t>(s.piston_count++);
        s.piston_pairs[n] = pair;
        s.pistons[n] = begin_piston(hydraulic, return_pressure, op.fill_flow, op.h, state.piston, valve);
        s.piston_valves[n] = before;
    } else {
        take_course(w, pair, end_step(hydraulic, valve, state));
    }
    write_hydraulic(w.next + law.actuator, state);
}

// Where one piston may change its motion, and with it the share of the others, all are looked at more closely.
void sample_valves(Work& w, std::span<PistonCourse> pistons) noexcept {
    ScratchData& s = w.scratch;
    bool needed = false;
    for (const PistonCourse& piston : pistons) needed = needed || !needs_no_samples(piston);
    if (!needed) return;
    for (std::size_t n = 0; n < pistons.size(); ++n) {
        if (is_constant(pistons[n].valve)) continue;
        const auto pair = static_cast<std::size_t>(s.piston_pairs[n]);
        sample_valve(w.operators.hydraulics[pair], s.piston_valves[n], pistons[n]);
    }
}

void end_hydraulics(Work& w, int pair, const PistonCourse& piston) noexcept {
    double* const at = w.next + w.model.pair_laws[static_cast<std::size_t>(pair)].actuator;
    HydraulicState state = read_hydraulic(at);
    take_course(w, pair, end_step(piston, state));
    write_hydraulic(at, state);
}

void move_pistons(Work& w) noexcept {
    ScratchData& s = w.scratch;
    const auto& oil = w.model.description.oil;
    const std::span<PistonCourse> pistons(s.pistons.data(), static_cast<std::size_t>(s.piston_count));
    sample_valves(w, pistons);
    advance_pistons(pistons, oil ? oil->pump_flow : 0);
    for (std::size_t n = 0; n < pistons.size(); ++n) end_hydraulics(w, s.piston_pairs[n], pistons[n]);
}

bool is_quiet(const Work& w, int pair) noexcept {
    const auto i = static_cast<std::size_t>(pair);
    const PairLaw& law = w.model.pair_laws[i];
    const double rest = w.operators.commands[i].rest;
    double* const at = w.next + law.actuator;
    if (at[chamber_slot] != rest) return false;
    if (at[steady_slot] > law.delay_slots) return true;
    if (!is_quiet(*law.hydraulic, law.friction.return_pressure, read_hydraulic(at),
                  static_cast<std::size_t>(law.delay_slots), rest))
        return false;
    at[steady_slot] = law.delay_slots + 1;
    return true;
}

}  // namespace

void latch_commands(Work& w) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    for (int k = 0; k < m.pairs; ++k) {
        const auto i = static_cast<std::size_t>(k);
        const PairLaw& law = m.pair_laws[i];
        PairCommand& command = w.operators.commands[i];
        double& load = w.operators.rest_loads[i];
        command.target = input(w, law.command);
        switch (law.source) {
            case LoadSource::constant:
                load = load_from_engagement(law.friction, 1);
                break;
            case LoadSource::waveform:
                load = 0;
                break;
            case LoadSource::input:
            case LoadSource::apply:
                load = load_from_engagement(law.friction, command.target);
                break;
            case LoadSource::release:
                load = load_from_engagement(law.friction, 1 - command.target);
                break;
            case LoadSource::hydraulic:
                command.scale = 1 - input(w, law.leak);
                command.valve_held = input(w, law.valve_stuck) > 0.5;
                command.rest = law.hydraulic->solenoid || command.valve_held
                                   ? std::numeric_limits<double>::quiet_NaN()
                                   : limited_command(*law.hydraulic, command.target);
                load = load_from_pressure(law.friction, command.target * command.scale);
                break;
            default:
                load = law.full_load;
                continue;  // by nature, not by actuation
        }
        // Faults that override the actuation: stuck open, stuck closed.
        const double fault = input(w, law.stuck);
        command.fixed = fault > 0.5;
        if (command.fixed) load = fault > 1.5 ? law.full_load : 0;
    }
}

void advance_actuation(Work& w) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    ScratchData& s = w.scratch;
    // Most stand where their commands want them.
    copy_few(w.operators.rest_loads.data(), m.pairs, s.held.data());
    std::fill(s.moves.begin(), s.moves.end(), static_cast<unsigned char>(0));
    s.moving_count = 0;

    s.piston_count = 0;
    for (const int k : m.hydraulic_pairs) {
        if (!is_quiet(w, k)) begin_hydraulics(w, k);
    }
    if (s.piston_count > 0) move_pistons(w);
    for (const int k : m.pedal_pairs) advance_pedal(w, k);
    for (const int k : m.waveform_pairs) {
        if (!w.operators.commands[static_cast<std::size_t>(k)].fixed) let_move(s, k);
    }
}

void hold_actuation(Work& w) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    ScratchData& s = w.scratch;
    copy_few(w.operators.rest_loads.data(), m.pairs, s.held.data());
    std::fill(s.moves.begin(), s.moves.end(), static_cast<unsigned char>(0));
    s.moving_count = 0;
    for (const int k : m.hydraulic_pairs) {
        s.held[static_cast<std::size_t>(k)] =
            held_load(w, k, chamber_pressure(w.state, m.pair_laws[static_cast<std::size_t>(k)]));
    }
    for (const int k : m.pedal_pairs) {
        const auto i = static_cast<std::size_t>(k);
        if (w.operators.commands[i].fixed) continue;
        const PairLaw& law = m.pair_laws[i];
        const double position = w.state[law.actuator];
        s.held[i] =
            load_from_engagement(law.friction, law.source == LoadSource::release ? 1 - position : position);
    }
    for (const int k : m.waveform_pairs) {
        if (!w.operators.commands[static_cast<std::size_t>(k)].fixed) let_move(s, k);
    }
}

double chamber_pressure(const double* block, const PairLaw& law) SHIFTRIG_REALTIME {
    return block[law.actuator + chamber_slot];
}

double pair_load(const Work& w, int pair, const Instant& at) SHIFTRIG_REALTIME {
    const auto i = static_cast<std::size_t>(pair);
    const PairLaw& law = w.model.pair_laws[i];
    const PairLoad& load = w.scratch.loads[i];
    if (law.source == LoadSource::waveform) {
        return load_from_engagement(law.friction, waveform(*law.profile, at.time, at.side));
    }
    if (law.source == LoadSource::hydraulic) {
        // The chamber jumps where the piston arrives: from the left it is still the spring's pressure.
        const double pressure = load.hydraulic.chamber(at.fraction, at.side == Side::left);
        return load_from_pressure(law.friction, pressure * w.operators.commands[i].scale);
    }
    return load_from_engagement(law.friction, load.values.at(at.fraction));
}

namespace {

constexpr double a_little = 1e-7;  // of a step

Instant instant_at(const Work& w, double fraction, Side side) noexcept {
    return {w.start + fraction * w.h, fraction, side};
}

}  // namespace

bool is_pressed(const Work& w, int pair, const Instant& at) SHIFTRIG_REALTIME {
    if (!w.scratch.moves[static_cast<std::size_t>(pair)] || at.fraction >= 1) return false;
    return pair_load(w, pair, instant_at(w, at.fraction + a_little, Side::left)) > 0;
}

double load_edge(const Work& w, int pair, double from, double until) SHIFTRIG_REALTIME {
    if (!w.scratch.moves[static_cast<std::size_t>(pair)]) return 1;
    double before = from + a_little, after = until - a_little;
    const bool pressed = pair_load(w, pair, instant_at(w, before, Side::left)) > 0;
    if ((pair_load(w, pair, instant_at(w, after, Side::left)) > 0) == pressed) return 1;
    while (after - before > 1e-12) {
        const double middle = 0.5 * (before + after);
        if (middle <= before || middle >= after) break;
        ((pair_load(w, pair, instant_at(w, middle, Side::left)) > 0) == pressed ? before : after) = middle;
    }
    return after;
}

}  // namespace shiftrig::plant::detail
