// Valves, pistons and pedals over one step. They do not feel the mechanics, so they are advanced first.
#include <algorithm>
#include <span>

#include "plant/forces.h"

namespace shiftrig::plant::detail {
namespace {

double input(const Work& w, int index) noexcept {
    return index < 0 ? 0 : w.operators.input[static_cast<std::size_t>(index)];
}

StepValues constant(double value) noexcept {
    return {value, value, value};
}
StepValues complement(const StepValues& y) noexcept {
    return {1 - y.begin, 1 - y.middle, 1 - y.end};
}

// Faults that override the actuation: stuck open, stuck closed.
bool stuck_pair(const Work& w, const PairLaw& law, PairLoad& load) noexcept {
    const double fault = input(w, law.stuck);
    load.fixed = fault > 0.5;
    if (load.fixed) load.values = constant(fault > 1.5 ? law.full_load : 0);
    return load.fixed;
}

bool changes(const PairLaw& law, const PairLoad& load) noexcept {
    if (load.fixed) return false;
    switch (law.source) {
        case LoadSource::waveform:
            return true;
        case LoadSource::hydraulic:
            return !load.hydraulic.rests();
        case LoadSource::release:
        case LoadSource::apply:
            return load.values.begin != load.values.end;
        default:
            return false;
    }
}

// The load of a pair for the whole step, or its place in the list of those that move.
void keep_load(Work& w, int pair) {
    ScratchData& s = w.scratch;
    const auto i = static_cast<std::size_t>(pair);
    if (s.loads[i].moves) {
        s.moving[static_cast<std::size_t>(s.moving_count++)] = pair;
    } else {
        s.held[i] = pair_load(w, pair, {w.start, 0, Side::right});
    }
}

// The same pressure all the step long.
void hold_pressure(Work& w, int pair, double pressure) {
    const auto i = static_cast<std::size_t>(pair);
    const PairLaw& law = w.model.pair_laws[i];
    PairLoad& load = w.scratch.loads[i];
    const bool fixed = stuck_pair(w, law, load);
    load.moves = false;
    w.scratch.held[i] = fixed ? load.values.begin : load_from_pressure(law.friction, pressure * load.scale);
}

}  // namespace

void advance_actuation(Work& w) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    double* block = w.next;
    double demand = 0;  // on the pump, by all pistons that fill [m³/s]
    for (int k = 0; k < m.pairs; ++k) {
        const PairLaw& law = m.pair_laws[static_cast<std::size_t>(k)];
        if (!law.hydraulic) continue;
        const auto i = static_cast<std::size_t>(k);
        const HydraulicState state = read_hydraulic(block + law.actuator);
        w.scratch.quiet[i] =
            !law.hydraulic->solenoid && input(w, law.valve_stuck) <= 0.5 &&
            is_quiet(*law.hydraulic, state, static_cast<std::size_t>(law.delay_slots), input(w, law.command));
        if (w.scratch.quiet[i]) continue;
        demand += fill_demand(*law.hydraulic, w.operators.hydraulics[i], law.friction.return_pressure, state);
    }
    const double pump = m.description.oil ? m.description.oil->pump_flow : 0;
    const double share = pump > 0 && demand > pump ? pump / demand : 1;

    w.scratch.moving_count = 0;
    for (int k = 0; k < m.pairs; ++k) {
        const auto i = static_cast<std::size_t>(k);
        const PairLaw& law = m.pair_laws[i];
        PairLoad& load = w.scratch.loads[i];
        load.scale = 1;
        if (law.source >= LoadSource::rolling) {  // by nature, not by actuation
            load.moves = load.fixed = false;
            w.scratch.held[i] = law.full_load;
            continue;
        }
        switch (law.source) {
            case LoadSource::constant:
                load.values = constant(1);
                break;
            case LoadSource::input:
                load.values = constant(input(w, law.command));
                break;
            case LoadSource::release:
                load.values = complement(advance_lag(law.lag, block[law.actuator], input(w, law.command)));
                break;
            case LoadSource::apply:
                load.values = advance_lag(law.lag, block[law.actuator], input(w, law.command));
                break;
            case LoadSource::hydraulic: {
                HydraulicState state = read_hydraulic(block + law.actuator);
                load.scale = 1 - input(w, law.leak);
                if (w.scratch.quiet[i]) {
                    hold_pressure(w, k, state.chamber);
                    continue;
                }
                const ActuationHydraulic& hydraulic = *law.hydraulic;
                double command = input(w, law.command);
                if (hydraulic.solenoid) command = solenoid_pressure(*hydraulic.solenoid, state.play, command);
                load.hydraulic = advance_hydraulics(
                    hydraulic, w.operators.hydraulics[i], law.friction.return_pressure, state,
                    std::span<double>(block + law.actuator + hydraulic_slots,
                                      static_cast<std::size_t>(law.delay_slots)),
                    command, share, input(w, law.valve_stuck) > 0.5);
                write_hydraulic(block + law.actuator, state);
                break;
            }
            default:
                break;
        }
        stuck_pair(w, law, load);
        load.moves = changes(law, load);
        keep_load(w, k);
    }
}

void hold_actuation(Work& w) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    const double* block = w.state;
    w.scratch.moving_count = 0;
    for (int k = 0; k < m.pairs; ++k) {
        const auto i = static_cast<std::size_t>(k);
        const PairLaw& law = m.pair_laws[i];
        PairLoad& load = w.scratch.loads[i];
        load.scale = 1;
        if (law.source >= LoadSource::rolling) {
            load.moves = load.fixed = false;
            w.scratch.held[i] = law.full_load;
            continue;
        }
        switch (law.source) {
            case LoadSource::constant:
                load.values = constant(1);
                break;
            case LoadSource::input:
                load.values = constant(input(w, law.command));
                break;
            case LoadSource::release:
                load.values = constant(1 - block[law.actuator]);
                break;
            case LoadSource::apply:
                load.values = constant(block[law.actuator]);
                break;
            case LoadSource::hydraulic:
                load.scale = 1 - input(w, law.leak);
                hold_pressure(w, k, read_hydraulic(block + law.actuator).chamber);
                continue;
            default:
                break;
        }
        stuck_pair(w, law, load);
        load.moves = law.source == LoadSource::waveform && !load.fixed;
        keep_load(w, k);
    }
}

double chamber_pressure(const double* block, const PairLaw& law) SHIFTRIG_REALTIME {
    return read_hydraulic(block + law.actuator).chamber;
}

double pair_load(const Work& w, int pair, const Instant& at) SHIFTRIG_REALTIME {
    const auto i = static_cast<std::size_t>(pair);
    const PairLaw& law = w.model.pair_laws[i];
    const PairLoad& load = w.scratch.loads[i];
    if (load.fixed) return load.values.begin;
    if (law.source == LoadSource::waveform) {
        return load_from_engagement(law.friction, waveform(*law.profile, at.time, at.side));
    }
    if (law.source == LoadSource::hydraulic) {
        // The chamber jumps where the piston arrives: from the left it is still the spring's pressure.
        const HydraulicStep& step = load.hydraulic;
        const bool before = at.fraction < step.filled_from ||
                            (at.side == Side::left && step.jumps() && at.fraction <= step.filled_from);
        const double pressure = before
                                    ? step.spring_begin + (step.spring_end - step.spring_begin) * at.fraction
                                    : step.valve.at(at.fraction);
        return load_from_pressure(law.friction, pressure * load.scale);
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
    if (!w.scratch.loads[static_cast<std::size_t>(pair)].moves || at.fraction >= 1) return false;
    return pair_load(w, pair, instant_at(w, at.fraction + a_little, Side::left)) > 0;
}

double load_edge(const Work& w, int pair, double from, double until) SHIFTRIG_REALTIME {
    if (!w.scratch.loads[static_cast<std::size_t>(pair)].moves) return 1;
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
