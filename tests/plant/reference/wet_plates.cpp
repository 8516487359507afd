#include "tests/plant/reference/wet_plates.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <utility>
#include <variant>
#include <vector>

#include "tests/plant/reference/piston.h"

namespace shiftrig::reference {
namespace {

using namespace plant;

// What the oil's temperature, the same all the time, does.
struct OilNow {
    double viscosity = 0;  // [Pa s]
    double dead_time = 1, valve_frequency = 1, fill_flow = 1;
};

OilNow oil_now(const Oil& oil) {
    OilNow now;
    const double at = oil.initial_temperature;
    now.viscosity = oil.viscosity_at_zero * std::exp(-oil.viscosity_decay * at);
    // ln η is linear in the temperature.
    const double cold =
        std::clamp((oil.warm_temperature - at) / (oil.warm_temperature - oil.cold_temperature), 0., 1.);
    now.dead_time = std::lerp(1, oil.cold_dead_time_factor, cold);
    now.valve_frequency = std::lerp(1, oil.cold_valve_frequency_factor, cold);
    now.fill_flow = oil.fill_viscosity / (oil.fill_viscosity + now.viscosity);
    return now;
}

struct Wet {
    std::size_t pair = 0;  // its place among them
    WetPlates p;
    std::shared_ptr<const ValvePressure> valve;
    std::shared_ptr<const Pistons> pistons;
    int piston = -1;  // none: the valve's pressure acts at once
    Told leak;

    double radius() const {
        const double o = p.outer_radius, i = p.inner_radius;
        return 2. / 3 * (o * o * o - i * i * i) / (o * o - i * i);
    }
    double pressure(When when) const {
        const double chamber =
            piston < 0 ? valve->at(when.t) : pistons->chamber(static_cast<std::size_t>(piston), when);
        return (1 - leak.at(when.inside)) * chamber;
    }
    double load(When when) const {
        return std::max(0., pressure(when) - p.return_pressure) * p.piston_area * radius() * p.surfaces;
    }
    double friction(double slip) const {
        return p.mu_sliding + p.mu_rise * std::exp(-std::abs(slip) * radius() / p.mu_speed);
    }
};

std::shared_ptr<const ValvePressure> valve_of(const ActuationHydraulic& hydraulic, const OilNow& oil,
                                              const Told& command) {
    ActuationHydraulic now = hydraulic;
    now.dead_time *= oil.dead_time;
    now.natural_frequency *= oil.valve_frequency;
    const auto within = [&](double pressure) { return std::clamp(pressure, 0., hydraulic.maximum_pressure); };
    std::vector<std::pair<double, double>> later;
    for (const auto& [time, pressure] : command.changes)
        if (time > 0) later.emplace_back(time, within(pressure));
    return std::make_shared<const ValvePressure>(now, within(command.at(0)), later);
}

std::function<double(double)> open_drag(const WetPlates& p, const Oil& oil, double viscosity) {
    const double o = std::pow(p.outer_radius, 4), n = std::pow(p.inner_radius, 4);
    const double drag = p.surfaces * std::numbers::pi * viscosity * (o - n) / (2 * p.clearance);
    return [drag, most = oil.drag_speed_limit](double slip) { return drag * std::clamp(slip, -most, most); };
}

}  // namespace

void add_wet_plates(System& system, const Description& d, const Tell& told, double until) {
    const OilNow oil = d.oil ? oil_now(*d.oil) : OilNow{};
    std::vector<Wet> all;
    std::vector<Piston> pistons;
    for (std::size_t i = 0; i < d.clutches.size(); ++i) {
        const Clutch& c = d.clutches[i];
        if (!std::holds_alternative<WetPlates>(c.friction)) continue;
        const auto& hydraulic = std::get<ActuationHydraulic>(c.actuation);
        const std::string prefix = "clutch." + c.name + ".";
        Wet wet;
        wet.pair = i;
        wet.p = std::get<WetPlates>(c.friction);
        wet.valve = valve_of(hydraulic, oil, told(prefix + "pressure_command", hydraulic.initial));
        wet.leak = told(prefix + "leak", 0);
        wet.valve->breaks(system.breaks);
        if (hydraulic.stroke > 0 && hydraulic.fill_volume > 0) {
            wet.piston = static_cast<int>(pistons.size());
            pistons.push_back({wet.valve, hydraulic.preload_pressure, wet.p.return_pressure,
                               hydraulic.fill_volume, hydraulic.fill_flow * oil.fill_flow});
        }
        all.push_back(wet);
    }
    const auto filling =
        std::make_shared<const Pistons>(pistons, d.oil ? d.oil->pump_flow : 0, pistons.empty() ? 0 : until);
    filling->breaks(system.breaks);
    for (Wet& wet : all) {
        const Clutch& c = d.clutches[wet.pair];
        Friction& f = system.frictions[wet.pair];
        wet.pistons = filling;
        if (c.drag) f.open = open_drag(wet.p, *d.oil, oil.viscosity);
        const double full =
            (std::get<ActuationHydraulic>(c.actuation).maximum_pressure - wet.p.return_pressure) *
            wet.p.piston_area * wet.radius() * wet.p.surfaces;
        f.nominal = full * wet.p.mu_static;
        f.sliding = [wet](When when, const Vector&, double slip) {
            return wet.load(when) * wet.friction(slip);
        };
        f.holding = [wet](When when, const Vector&) { return wet.load(when) * wet.p.mu_static; };
        const double mobility = f.column.cwiseAbs2().cwiseQuotient(system.inertia).sum();
        system.law_rate = std::max(system.law_rate,
                                   full * std::abs(wet.p.mu_rise) * wet.radius() / wet.p.mu_speed * mobility);
        system.shown.push_back({"clutch." + c.name + ".pressure", System::Unit::pascal, false,
                                [wet](When when, const Vector&) { return wet.pressure(when); }});
    }
}

}  // namespace shiftrig::reference
