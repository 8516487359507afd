#include "plant/connectors/engine.h"

#include "plant/assembly.h"
#include "plant/check.h"
#include "plant/format.h"
#include "plant/laws/engine.h"
#include "plant/model_builder.h"
#include "plant/shown.h"

namespace shiftrig::plant {

void check_parameters(const Check& check, const Engine& e) {
    check.rising("full_load", e.full_load);
    check.positive("governor_slope", e.governor_slope);
    check.positive("low_idle", e.low_idle);
    if (!(e.high_idle > e.low_idle))
        check.fail("high_idle", "= " + number(e.high_idle) + "; must be > low_idle");
    check.not_negative("friction_constant", e.friction_constant);
    check.not_negative("friction_per_speed", e.friction_per_speed);
    check.not_negative("actuator_lag", e.actuator_lag);
    check.not_negative("turbo_lag", e.turbo_lag);
    if (!(e.turbo_instant_fraction > 0 && e.turbo_instant_fraction <= 1)) {
        check.fail("turbo_instant_fraction", "= " + number(e.turbo_instant_fraction) + "; must be in (0, 1]");
    }
    check.not_negative("fade_to", e.fade_to);
    check.not_negative("fade_from", e.fade_from);
    if (e.fade_from > 0 && !(e.fade_to < e.fade_from))
        check.fail("fade_to", "= " + number(e.fade_to) + "; must be < fade_from");
    for (const auto& point : e.full_load) {
        if (point.second < 0) check.fail("full_load", "= " + number(point.second) + "; must be >= 0");
    }
    check.not_negative("stall_speed", e.stall_speed);
    if (e.cylinders < 1) check.fail("cylinders", "= " + std::to_string(e.cylinders) + "; must be >= 1");
}

void assemble(Assembly& assembly, const Engine& e) {
    // The most of a stalled one; without a stall speed it has stalled where it is turned backwards.
    const double friction = engine_friction(e, e.stall_speed > 0 ? e.stall_speed : e.low_idle);
    if (friction <= 0) return;
    assembly.structure.pairs.push_back(
        {e.name + ".friction", PairKind::engine_friction, {assembly.link(e.mass, 1), Link{}}, friction});
}

void add_pair_law(detail::ModelBuilder& builder, const Engine& e) {
    builder.model.throttle =
        builder.input("driver.throttle", Unit::one, 0, 0, 1, "sets the engine's no-load speed");
    const int pair = builder.pair(e.name + ".friction");
    if (pair >= 0) builder.law(pair).source = detail::LoadSource::engine;
}

void add_law(detail::ModelBuilder& builder, const Engine& e) {
    detail::ModelData& m = builder.model;
    const std::string prefix = "engine." + e.name + ".";
    detail::EngineLaw law;
    law.mass = m.structure.mass(e.mass);
    law.force = builder.external(law.mass);
    law.pair = builder.pair(e.name + ".friction");
    law.peak = largest_value(e.full_load);
    law.full_load = Curve(e.full_load);
    law.start = builder.flag(prefix + "start", "rising edge starts a stalled engine");
    law.speed_request_enable = builder.flag(prefix + "speed_request_enable", "1: hold the speed request");
    law.speed_request =
        builder.input(prefix + "speed_request", Unit::radian_per_second, 0, 0, 1e4, "speed control");
    law.torque_limit = builder.input(prefix + "torque_limit", Unit::one, 1, 0, 1, "of the full-load peak");
    law.fuel_cut = builder.flag(prefix + "fuel_cut", "1: no fuel");
    m.engines.push_back(law);
    m.auxiliary += 2;  // torque and boost
    builder.tells_events(e.name);
}

void name_outputs(detail::ModelBuilder& builder, const std::vector<Engine>& engines) {
    for (const Engine& e : engines) {
        builder.output("engine." + e.name + ".torque", Unit::newton_metre, "net torque on the crankshaft");
        builder.output("engine." + e.name + ".load", Unit::one, "of full load at this speed");
        builder.output("engine." + e.name + ".stalled", Unit::one, "1: stalled");
    }
}

double* show(const detail::Shown& at, const std::vector<Engine>& engines, double* next) SHIFTRIG_REALTIME {
    const double* mode = at.work.state + at.model().layout.engines;
    for (std::size_t e = 0; e < engines.size(); ++e, mode += 3) {
        const double torque = at.sample.engine_torque[e], full = at.sample.engine_full_load[e];
        *next++ = torque;
        *next++ = full > 0 ? torque / full : 0.;
        *next++ = static_cast<EngineMode>(static_cast<int>(*mode)) == EngineMode::stalled ? 1. : 0.;
    }
    return next;
}

std::string in_words(const Engine&, const Event& event) {
    if (event.kind == EventKind::engine_stalls) return format("stalls at %.1f rad/s", event.value);
    if (event.kind == EventKind::engine_starts) return format("runs at %.1f rad/s", event.value);
    return {};
}

}  // namespace shiftrig::plant
