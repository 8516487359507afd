#include "plant/connectors/clutch.h"

#include "plant/assembly.h"
#include "plant/check.h"
#include "plant/few.h"
#include "plant/format.h"
#include "plant/laws/friction.h"
#include "plant/laws/hydraulics.h"
#include "plant/laws/oil.h"
#include "plant/model_builder.h"
#include "plant/shown.h"

namespace shiftrig::plant {
namespace {

// What a friction pair carries at its nominal engagement; only the proportions matter.
double nominal_capacity(const Clutch& clutch) {
    if (const auto* dry = std::get_if<DryFriction>(&clutch.friction)) return dry->sliding_capacity;
    const auto& wet = std::get<WetPlates>(clutch.friction);
    const FrictionLaw law = friction_law(wet);
    const auto& hydraulic = std::get<ActuationHydraulic>(clutch.actuation);  // check_parameters() saw to that
    return static_capacity(law, load_from_pressure(law, hydraulic.maximum_pressure));
}

// Current that the characteristic turns into this pressure.
double current_for(const Solenoid& solenoid, double pressure) {
    Table inverse;
    for (const auto& [current, value] : solenoid.pressure_over_current) {
        if (inverse.empty() || value > inverse.back().first) inverse.push_back({value, current});
    }
    return interpolate(inverse, pressure);
}

// A service brake; nullptr: the driver's pedal does not apply this clutch.
const ActuationApply* by_pedal(const Clutch& clutch) {
    const auto* apply = std::get_if<ActuationApply>(&clutch.actuation);
    return apply && apply->by_driver_brake ? apply : nullptr;
}

}  // namespace

void check_parameters(const Check& check, const Clutch& c) {
    check.not_negative("radius", c.radius);
    if (c.radius > 0 && c.b.empty())
        Check("clutch", c.name).fail("radius", "is given, but there is no road mass b");
    if (const auto* dry = std::get_if<DryFriction>(&c.friction)) {
        check.positive("sliding_capacity", dry->sliding_capacity);
        if (!(dry->static_ratio >= 1)) {
            check.fail("static_ratio", "= " + number(dry->static_ratio) + "; must be >= 1");
        }
        check.any("static_ratio", dry->static_ratio);
        check.any("falling", dry->falling);
        if (dry->falling > 1) check.fail("falling", "= " + number(dry->falling) + "; must be <= 1");
        check.positive("falling_speed", dry->falling_speed);
        if (!dry->factor_over_slip.empty()) check.rising("factor_over_slip", dry->factor_over_slip);
        for (const auto& [slip, factor] : dry->factor_over_slip) {
            if (factor < 0) check.fail("factor_over_slip", "= " + number(factor) + "; must be >= 0");
        }
    } else {
        const auto& wet = std::get<WetPlates>(c.friction);
        if (wet.surfaces < 1) check.fail("surfaces", "= " + std::to_string(wet.surfaces) + "; must be >= 1");
        check.positive("outer_radius", wet.outer_radius);
        check.positive("inner_radius", wet.inner_radius);
        if (!(wet.inner_radius < wet.outer_radius)) {
            check.fail("inner_radius", "= " + number(wet.inner_radius) + "; must be < outer_radius");
        }
        check.positive("piston_area", wet.piston_area);
        check.not_negative("return_pressure", wet.return_pressure);
        check.positive("mu_sliding", wet.mu_sliding);
        check.any("mu_rise", wet.mu_rise);
        if (!(wet.mu_sliding + wet.mu_rise > 0)) check.fail("mu_rise", "makes the sliding friction negative");
        if (const double at_rest = wet.mu_sliding + std::fmax(0, wet.mu_rise); !(wet.mu_static >= at_rest))
            check.fail("mu_static", "= " + number(wet.mu_static) + "; must be >= " + number(at_rest) +
                                        ", what slides at rest (mu_sliding + mu_rise)");
        check.any("mu_static", wet.mu_static);
        check.positive("mu_speed", wet.mu_speed);
        if (c.drag) check.positive("clearance", wet.clearance);
        if (!std::holds_alternative<ActuationHydraulic>(c.actuation)) {
            check.fail("actuation", "of wet plates must be hydraulic: their capacity comes from a pressure");
        }
    }
    if (c.drag && !std::holds_alternative<WetPlates>(c.friction)) {
        check.fail("drag", "needs wet plates: a dry pair has no oil to shear");
    }
    if (const auto* h = std::get_if<ActuationHydraulic>(&c.actuation)) {
        if (!std::holds_alternative<WetPlates>(c.friction)) {
            check.fail("actuation", "by pressure needs wet plates: a dry pair has no piston area");
        }
        check.not_negative("dead_time", h->dead_time);
        if (h->dead_time > 10) check.fail("dead_time", "= " + number(h->dead_time) + "; must be <= 10");
        check.positive("natural_frequency", h->natural_frequency);
        check.positive("damping_ratio", h->damping_ratio);
        check.positive("slew", h->slew);
        check.positive("maximum_pressure", h->maximum_pressure);
        check.not_negative("preload_pressure", h->preload_pressure);
        check.not_negative("stroke", h->stroke);
        check.not_negative("fill_volume", h->fill_volume);
        if (h->fill_volume > 0) check.positive("fill_flow", h->fill_flow);
        // A spring that weakens along the stroke has no stroke that balances a pressure.
        const auto* wet = std::get_if<WetPlates>(&c.friction);
        if (wet && has_piston(*h) && !(h->preload_pressure <= wet->return_pressure))
            check.fail("preload_pressure",
                       "= " + number(h->preload_pressure) + "; must be <= return_pressure");
        if (wet && !(h->maximum_pressure > wet->return_pressure))
            check.fail("maximum_pressure", "= " + number(h->maximum_pressure) +
                                               "; must be > return_pressure, which it works against");
        if (h->solenoid) {
            check.rising("solenoid", h->solenoid->pressure_over_current);
            check.not_negative("hysteresis", h->solenoid->hysteresis);
        }
        check.within("initial", h->initial, 0, h->maximum_pressure);
    } else if (const auto* direct = std::get_if<ActuationDirect>(&c.actuation)) {
        check.waveform("profile", direct->profile);
        check.not_negative("initial", direct->initial);
    } else if (const auto* release = std::get_if<ActuationRelease>(&c.actuation)) {
        check.not_negative("lag", release->lag);
        check.within("initial", release->initial, 0, 1);
    } else if (const auto* apply = std::get_if<ActuationApply>(&c.actuation)) {
        check.not_negative("lag", apply->lag);
        check.within("initial", apply->initial, 0, 1);
    }
    if (c.heat) {
        check.positive("surface_capacity", c.heat->surface_capacity);
        check.positive("bulk_capacity", c.heat->bulk_capacity);
        check.not_negative("surface_to_bulk", c.heat->surface_to_bulk);
        check.not_negative("bulk_to_oil", c.heat->bulk_to_oil);
    }
}

void check_surroundings(const Description& machine, const Clutch& c) {
    const bool needs_oil = c.drag || c.heat;
    if (needs_oil && !machine.oil)
        Check("clutch", c.name).fail(c.drag ? "drag" : "heat", "needs the model's oil");
    const auto* pedal = by_pedal(c);
    if (!pedal) return;
    for (const Clutch& other : machine.clutches) {
        const auto* same = by_pedal(other);
        if (same && same->initial != pedal->initial && &other < &c)
            Check("clutch", c.name)
                .fail("initial", "= " + number(pedal->initial) + "; must be that of \"" + other.name +
                                     "\", which the same pedal applies");
    }
}

void assemble(Assembly& assembly, const Clutch& c) {
    const double b = c.radius > 0 ? -1 / c.radius : -1;
    assembly.structure.pairs.push_back({.name = c.name,
                                        .kind = PairKind::clutch,
                                        .links = {assembly.link(c.a, 1), assembly.link(c.b, b)},
                                        .nominal_capacity = nominal_capacity(c),
                                        .rolling_contact = c.radius > 0,
                                        .initially_locked = c.initially_locked});
}

namespace {

// Commands under way stand in a delay line, one a step.
void check_delay(const Clutch& c, double dead_time, const Description& machine, double h) {
    constexpr double most_steps = 1e6;  // 8 MB
    const double steps = dead_time * std::fmax(1, machine.oil ? machine.oil->cold_dead_time_factor : 1) / h;
    if (!(steps <= most_steps))
        Check(kind(c), c.name)
            .fail("dead_time", "= " + number(dead_time) + "; must be at most " + number(most_steps) +
                                   " steps of " + number(h) + " s in the coldest oil");
}

}  // namespace

void add_pair_law(detail::ModelBuilder& builder, const Clutch& c) {
    using detail::LoadSource;
    const detail::ModelData& m = builder.model;
    detail::PairLaw& law = builder.law(builder.pair(c.name));
    const std::string prefix = "clutch." + c.name + ".";
    if (const auto* dry = std::get_if<DryFriction>(&c.friction)) {
        law.friction = friction_law(*dry);
        law.full_load = load_from_engagement(law.friction, 1);
    } else {
        const auto& wet = std::get<WetPlates>(c.friction);
        law.friction = friction_law(wet);
        if (c.drag) law.drag = drag_factor(wet);
    }
    law.actuator = builder.actuator(0);
    const double h = m.options.step_size;
    if (const auto* direct = std::get_if<ActuationDirect>(&c.actuation)) {
        if (direct->profile.pieces.empty()) {
            law.source = LoadSource::input;
            law.command = builder.input(prefix + "engagement", Unit::one, direct->initial, 0, 1e6,
                                        "share of the nominal capacity");
        } else {
            law.source = LoadSource::waveform;
            law.profile = &direct->profile;
            builder.breakpoints(direct->profile);
        }
    } else if (const auto* release = std::get_if<ActuationRelease>(&c.actuation)) {
        law.source = LoadSource::release;
        law.lag = lag_operator(release->lag, h);
        law.command = builder.input(prefix + "release_command", Unit::one, release->initial, 0, 1,
                                    "0 closed … 1 released");
        builder.actuator(1);
    } else if (const auto* apply = std::get_if<ActuationApply>(&c.actuation)) {
        law.source = LoadSource::apply;
        law.lag = lag_operator(apply->lag, h);
        law.command = apply->by_driver_brake
                          ? builder.input("driver.brake", Unit::one, apply->initial, 0, 1, "service brake")
                          : builder.input(prefix + "application_command", Unit::one, apply->initial, 0, 1,
                                          "0 open … 1 applied");
        builder.actuator(1);
    } else if (const auto* hydraulic = std::get_if<ActuationHydraulic>(&c.actuation)) {
        law.source = LoadSource::hydraulic;
        law.hydraulic = hydraulic;
        law.full_load = load_from_pressure(law.friction, hydraulic->maximum_pressure);
        law.command =
            hydraulic->solenoid
                ? builder.input(prefix + "current_command", Unit::ampere,
                                current_for(*hydraulic->solenoid, hydraulic->initial), 0,
                                hydraulic->solenoid->pressure_over_current.back().first, "solenoid current")
                : builder.input(prefix + "pressure_command", Unit::pascal, hydraulic->initial, 0,
                                hydraulic->maximum_pressure, "valve pressure wanted");
        law.valve_stuck = builder.flag(prefix + "valve_stuck", "fault: 1 holds the valve's outlet pressure");
        law.leak = builder.flag(prefix + "leak", "fault: share of the chamber pressure lost");
        check_delay(c, hydraulic->dead_time, m.description, h);
        law.delay_slots =
            static_cast<int>(delay_slots(*hydraulic, m.description.oil ? &*m.description.oil : nullptr, h));
        builder.actuator(detail::hydraulic_slots + law.delay_slots);
    } else {
        law.source = LoadSource::constant;
    }
    law.stuck = builder.input(prefix + "stuck", Unit::one, 0, 0, 2, "fault: 1 stuck open, 2 stuck closed");
    if (c.heat) law.heat = &*c.heat;
}

// One quantity of all devices after the other: loops write them so.
void name_outputs(detail::ModelBuilder& builder, const std::vector<Clutch>& clutches) {
    const auto each = [&](const char* quantity, const auto& unit, const char* text, const auto& has) {
        for (const Clutch& c : clutches) {
            if (has(c)) builder.output("clutch." + c.name + quantity, unit(c), text);
        }
    };
    const auto every = [](const Clutch&) { return true; };
    const auto always = [](Unit unit) { return [unit](const Clutch&) { return unit; }; };
    const auto effort = [&](const Clutch& c) { return builder.effort_unit(c.a); };
    const auto speed = [&](const Clutch& c) { return builder.speed_unit(c.a); };
    each(".torque", effort, "torque on the first link", every);
    each(".slip", speed, "slip speed, first link minus second", every);
    each(".capacity", effort, "sliding capacity at the present slip", every);
    each(".state", always(Unit::one), "0 locked, 1 slipping, 2 free", every);
    each(".heat_power", always(Unit::watt), "friction power", every);
    each(".heat", always(Unit::joule), "friction heat since start", every);
    each(".pressure", always(Unit::pascal), "chamber pressure",
         [](const Clutch& c) { return std::holds_alternative<ActuationHydraulic>(c.actuation); });
    each(".temperature", always(Unit::celsius), "facing surface",
         [](const Clutch& c) { return c.heat.has_value(); });
}

double* show(const detail::Shown& at, const std::vector<Clutch>& clutches, double* next) SHIFTRIG_REALTIME {
    const detail::ModelData& m = at.model();
    const detail::OperatorsData& operators = at.work.operators;
    const double* const block = at.work.state;
    const detail::Sample& s = at.sample;
    next = m.kernel.loops.show_clutches({s.f, s.torque, s.slip, s.sliding, operators.table.state_code,
                                         block + m.layout.heat, static_cast<int>(clutches.size())},
                                        next);  // they are the first pairs
    for (const int k : m.hydraulic_pairs) {
        const auto i = static_cast<std::size_t>(k);
        *next++ = block[m.pair_laws[i].actuator + detail::chamber_slot] * operators.commands[i].scale;
    }
    return detail::copy_few(block + m.layout.temperatures, static_cast<int>(m.heated_pairs.size()), next);
}

std::string in_words(const Clutch&, const Event& event) {
    if (event.kind == EventKind::facing_warning)
        return format("facing passes its warning temperature: %.0f degC", event.value);
    if (event.kind == EventKind::facing_failure)
        return format("facing passes its failure temperature: %.0f degC", event.value);
    return {};
}

}  // namespace shiftrig::plant
