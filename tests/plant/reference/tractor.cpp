#include "tests/plant/reference/tractor.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "tests/plant/reference/valve.h"

namespace shiftrig::cases {
namespace {

using namespace plant;
using reference::ValvePressure;
using reference::Vector;
using reference::When;

constexpr double rpm = std::numbers::pi / 30;
constexpr double bar = 1e5;
constexpr double weight = 14000 * 9.80665;  // [N]
constexpr double wheel_radius = 0.935;
constexpr double mobility = 55;

Clutch powershift_clutch(const char* name, const char* pinion, const Estimates& estimates) {
    Clutch clutch;
    clutch.name = name;
    clutch.a = "input";
    clutch.b = pinion;
    WetPlates plates;
    plates.surfaces = 8;
    plates.outer_radius = 0.110;
    plates.inner_radius = 0.085;
    plates.piston_area = 0.0150;
    plates.return_pressure = 1.2 * bar * estimates.return_spring;
    plates.mu_static = 0.13 * estimates.friction;
    plates.mu_sliding = 0.10 * estimates.friction;
    plates.mu_rise = 0.025 * estimates.friction_rise;
    plates.mu_speed = 0.3 * estimates.friction_speed;
    plates.clearance = 0.25e-3;
    clutch.friction = plates;
    ActuationHydraulic hydraulic;
    hydraulic.dead_time = 0.015 * estimates.dead_time;
    hydraulic.natural_frequency = 60 * estimates.valve_frequency;
    hydraulic.damping_ratio = 0.8 * estimates.valve_damping;
    hydraulic.slew = 150 * bar * estimates.slew;
    hydraulic.maximum_pressure = 18 * bar;
    hydraulic.preload_pressure = 0.8 * bar * estimates.preload;
    clutch.actuation = hydraulic;
    return clutch;
}

double ramp(double t, double from, double until, double low, double high) {
    return low + (high - low) * std::clamp((t - from) / (until - from), 0.0, 1.0);
}

double interpolated(const std::vector<std::pair<double, double>>& table, double x) {
    if (x <= table.front().first) return table.front().second;
    std::size_t i = 1;
    while (i + 1 < table.size() && table[i].first < x) ++i;
    const auto& [x0, y0] = table[i - 1];
    const auto& [x1, y1] = table[i];
    return x >= table.back().first ? table.back().second : y0 + (y1 - y0) * (x - x0) / (x1 - x0);
}

}  // namespace

std::array<double, 2> TractorShift::command(long millisecond) const {
    const double t = 1e-3 * static_cast<double>(millisecond) + 1e-9;
    double f2 = 18, f3 = 0;
    if (shift == Shift::good) {
        f3 = t < 0.10 ? 0 : t < 0.36 ? ramp(t, 0.22, 0.32, 2, 8) : t < 0.9 ? 11.5 : 18;
        f2 = t < 0.25 ? 18 : t < 0.30 ? 7 : t < 0.34 ? 6 : 0;
    } else {
        f3 = t < 0.10 ? 0 : ramp(t, 0.22, 0.26, 2, 18);
        f2 = ramp(t, 0.45, 0.46, 18, 0);
    }
    return {f2 * bar, f3 * bar};
}

TractorShift tractor_shift(Shift shift, const Estimates& estimates) {
    TractorShift result;
    result.shift = shift;
    result.throttle = (1840.0 - 900) / 1291;
    Description& d = result.description;
    d.maximum_parts = 1;  // the order of the scheme is to be seen
    d.name = "tractor, F2 to F3 under the plough";
    const auto rotating = [&](const char* name, double inertia) {
        d.masses.push_back({.name = name, .inertia = inertia});
    };
    const double others = estimates.other_inertias;
    rotating("engine", 2.6 * estimates.engine_inertia);
    rotating("clutch_disc", 0.15 * others);
    rotating("input", 0.30 * others);
    for (const char* pinion : {"pinion_1", "pinion_2", "pinion_3", "pinion_4"})
        rotating(pinion, 0.02 * others);
    rotating("output", 0.25 * others);
    rotating("range_output", 0.05 * others);
    rotating("crown", 1.0 * others);
    rotating("axle_input", 5.0 * others);
    rotating("wheels", 550 * estimates.wheel_inertia);
    d.masses.push_back({.name = "vehicle", .inertia = 14000, .motion = Motion::translating});
    const double k = estimates.shaft_stiffness, c = estimates.shaft_damping;
    d.shafts = {
        {.name = "damper", .a = "clutch_disc", .b = "input", .stiffness = 12000 * k, .damping = 15 * c},
        {.name = "pinion_shaft",
         .a = "range_output",
         .b = "crown",
         .stiffness = 80000 * k,
         .damping = 60 * c},
        {.name = "axle", .a = "axle_input", .b = "wheels", .stiffness = 2.8e6 * k, .damping = 8000 * c}};
    Clutch main;
    main.name = "Fc";
    main.a = "engine";
    main.b = "clutch_disc";
    DryFriction dry;
    dry.sliding_capacity = (shift == Shift::bad_coulomb ? 0.75 * 2400 : 2400) * estimates.main_capacity;
    dry.static_ratio = 1.15;
    main.friction = dry;
    main.actuation = ActuationConstant{};
    d.clutches = {
        main, powershift_clutch("F1", "pinion_1", estimates), powershift_clutch("F2", "pinion_2", estimates),
        powershift_clutch("F3", "pinion_3", estimates), powershift_clutch("F4", "pinion_4", estimates)};
    const auto gear = [&](const char* name, const char* a, const char* b, double u, double eta) {
        Gear g;
        g.name = name;
        g.a = a;
        g.b = b;
        g.ratio = u;
        g.efficiency = 1 - (1 - eta) * estimates.gear_losses;
        d.gears.push_back(g);
    };
    gear("P1", "pinion_1", "output", 41.0 / 30, 0.98);
    gear("P2", "pinion_2", "output", 38.0 / 33, 0.98);
    gear("P3", "pinion_3", "output", 35.0 / 36, 0.98);
    gear("P4", "pinion_4", "output", 32.0 / 39, 0.98);
    gear("range", "output", "range_output", 3.024, 0.9604);
    gear("axle_drive", "crown", "axle_input", 41.0 / 9 * 5, 0.97 * 0.976);
    if (shift == Shift::bad_coulomb) {
        Clutch contact;
        contact.name = "Fw";
        contact.a = "wheels";
        contact.b = "vehicle";
        contact.radius = wheel_radius;
        DryFriction law;
        law.sliding_capacity = 0.50 * weight * wheel_radius;
        law.static_ratio = 1.1;
        contact.friction = law;
        contact.actuation = ActuationConstant{};
        d.clutches.push_back(contact);
        // What the tyre's own rolling and soil resistance would be.
        Clutch rolling;
        rolling.name = "rolling";
        rolling.a = "wheels";
        DryFriction roll;
        roll.sliding_capacity = (0.04 + 1 / mobility) * weight * wheel_radius;
        rolling.friction = roll;
        rolling.actuation = ActuationConstant{};
        d.clutches.push_back(rolling);
    } else {
        BrixiusTyre tyre;
        tyre.name = "tyre";
        tyre.wheel = "wheels";
        tyre.body = "vehicle";
        tyre.radius = wheel_radius;
        tyre.mobility_number = mobility;
        tyre.relaxation_length = 0.6 * estimates.tyre_relaxation;
        tyre.slip_damping_time = 0.05;
        tyre.weight = weight;
        tyre.rolling_coefficient = 0.04;
        d.tyres = {tyre};
    }
    Engine engine;
    engine.name = engine.mass = "engine";
    for (const auto& [speed, torque] : std::initializer_list<std::pair<double, double>>{{700, 550},
                                                                                        {850, 700},
                                                                                        {1000, 880},
                                                                                        {1200, 1060},
                                                                                        {1400, 1170},
                                                                                        {1600, 1201},
                                                                                        {1800, 1144},
                                                                                        {2003, 972},
                                                                                        {2100, 858},
                                                                                        {2154, 729}})
        engine.full_load.emplace_back(speed * rpm, torque);
    engine.governor_slope = 187;
    engine.low_idle = 900 * rpm;
    engine.high_idle = 2191 * rpm;
    engine.friction_constant = 70;
    engine.friction_per_speed = 0.45;
    engine.actuator_lag = 0.04 * estimates.engine_lag;
    engine.turbo_instant_fraction = 0.62 * estimates.turbo_instant;
    engine.turbo_lag = 0.5 * estimates.turbo_lag;
    engine.fade_from = 700 * rpm;
    engine.fade_to = 500 * rpm;
    engine.stall_speed = 400 * rpm;
    d.engines = {engine};
    Plough plough;
    plough.name = "plough";
    plough.body = "vehicle";
    plough.soil_factor = 0.70;
    plough.a = 652;
    plough.c = 5.1;
    plough.width = 3.2;
    plough.depth = 0.23;
    d.ploughs = {plough};

    const double overall = 38.0 / 33 * 3.024 * 41 / 9 * 5;
    result.start_locked = {"Fc", "F2"};
    result.start_speeds = {{"engine", 1800 * rpm}};
    if (shift == Shift::bad_coulomb)
        result.start_locked.push_back("Fw");
    else
        result.start_speeds.emplace_back("vehicle", 1800 * rpm / overall * wheel_radius * (1 - 0.074));
    return result;
}

void add_pistons(Description& description, const Estimates& estimates) {
    for (Clutch& clutch : description.clutches) {
        auto* valve = std::get_if<ActuationHydraulic>(&clutch.actuation);
        if (valve == nullptr) continue;
        valve->stroke = 2e-3;
        valve->fill_volume = 30e-6 * estimates.fill_volume;
        valve->fill_flow = 20e-3 / 60 * estimates.fill_flow;
    }
}

reference::System tractor_system(const TractorShift& shift, const Vector& start_speeds) {
    const Description& d = shift.description;
    Description rigid = d;
    std::vector<Clutch> wet;
    std::erase_if(rigid.clutches, [&](const Clutch& clutch) {
        const bool is_wet = std::holds_alternative<WetPlates>(clutch.friction);
        if (is_wet) wet.push_back(clutch);
        return is_wet;
    });
    rigid.engines.clear();
    rigid.tyres.clear();
    rigid.ploughs.clear();
    reference::System system(rigid);
    for (auto& f : system.frictions)
        f.initially_held = std::find(shift.start_locked.begin(), shift.start_locked.end(), f.name) !=
                           shift.start_locked.end();

    const int n = system.masses;
    const int wheels = system.mass("wheels"), vehicle = system.mass("vehicle"), crank = system.mass("engine");
    const bool has_tyre = !d.tyres.empty();
    const int first_extra = n + system.shafts;
    const int kappa = first_extra, torque = first_extra + has_tyre, boost = torque + 1;
    system.extras = has_tyre + 2;

    for (const Clutch& clutch : wet) {
        const auto& plates = std::get<WetPlates>(clutch.friction);
        const auto& hydraulic = std::get<ActuationHydraulic>(clutch.actuation);
        std::vector<std::pair<double, double>> commands;
        const int index = clutch.name == "F2" ? 0 : clutch.name == "F3" ? 1 : -1;
        double last = index == 0 ? 18 * bar : 0;
        const double initial = last;
        const auto milliseconds = static_cast<long>(std::lround(shift.duration * 1000));
        for (long k = 0; index >= 0 && k < milliseconds; ++k) {
            const double value = shift.command(k)[static_cast<std::size_t>(index)];
            if (value != last) commands.emplace_back(shift.warm_up + 1e-3 * static_cast<double>(k), value);
            last = value;
        }
        const auto pressure = std::make_shared<const ValvePressure>(hydraulic, initial, commands);
        pressure->breaks(system.breaks);
        const double ro = plates.outer_radius, ri = plates.inner_radius;
        const double radius = 2.0 / 3 * (ro * ro * ro - ri * ri * ri) / (ro * ro - ri * ri);
        const double per_pascal = plates.piston_area * radius * plates.surfaces;
        const auto load = [pressure, per_pascal, plates](double t) {
            return per_pascal * std::max(0.0, pressure->at(t) - plates.return_pressure);
        };
        reference::Friction friction;
        friction.name = clutch.name;
        friction.column = Vector::Unit(n, system.mass(clutch.a)) - Vector::Unit(n, system.mass(clutch.b));
        friction.nominal = per_pascal * hydraulic.maximum_pressure * plates.mu_static;
        friction.initially_held = index == 0;
        friction.sliding = [load, plates, radius](When when, const Vector&, double slip) {
            return load(when.t) * (plates.mu_sliding +
                                   plates.mu_rise * std::exp(-std::abs(slip) * radius / plates.mu_speed));
        };
        friction.holding = [load, plates](When when, const Vector&) {
            return load(when.t) * plates.mu_static;
        };
        system.frictions.push_back(friction);
    }

    const double grip = 0.88 * (1 - std::exp(-0.1 * mobility)) * weight;
    const BrixiusTyre tyre = has_tyre ? d.tyres[0] : BrixiusTyre{};
    struct Slip {
        double rate, effective;
    };
    const auto slip = [=](const Vector& z) {
        const double rim = z[wheels] * wheel_radius, v = z[vehicle];
        const double rolling = std::max(std::abs(rim), std::abs(v));
        const double rate = (rim - v - rolling * z[kappa]) / tyre.relaxation_length;
        const double damping = tyre.slip_damping_time * tyre.relaxation_length /
                               (tyre.relaxation_length + tyre.slip_damping_time * rolling);
        return Slip{rate, z[kappa] + damping * rate};
    };
    const Plough plough = d.ploughs[0];
    const auto body_resistance = [=](const Vector& z) {
        const double kmh = 3.6 * std::abs(z[vehicle]);
        const double draft =
            plough.soil_factor * (plough.a + plough.c * kmh * kmh) * plough.width * plough.depth * 100;
        return draft +
               (has_tyre ? weight * (1 / mobility + 0.5 * std::abs(slip(z).effective) / std::sqrt(mobility))
                         : 0);
    };
    const auto pair = [&](const char* name, int mass, double nominal, auto capacity) {
        reference::Friction f;
        f.name = name;
        f.column = Vector::Unit(n, mass);
        f.nominal = nominal;
        f.sliding = [capacity](When, const Vector& z, double) { return capacity(z); };
        f.holding = [capacity](When, const Vector& z) { return capacity(z); };
        system.frictions.push_back(f);
    };
    pair("body", vehicle, 50000, body_resistance);
    if (has_tyre) pair("rolling", wheels, 5000, [](const Vector&) { return 0.04 * weight * wheel_radius; });

    const Engine engine = d.engines[0];
    const double no_load = engine.low_idle + shift.throttle * (engine.high_idle - engine.low_idle);
    const auto demand = [=](double w, double b) {
        const double upper = interpolated(engine.full_load, w) *
                             (engine.turbo_instant_fraction + (1 - engine.turbo_instant_fraction) * b);
        return std::clamp(engine.governor_slope * (no_load - w),
                          -(engine.friction_constant + engine.friction_per_speed * w), upper);
    };
    system.law = [=](When, const Vector& z, Vector& force, Eigen::Ref<Vector> rate) {
        Eigen::Index i = 0;
        if (has_tyre) {
            const Slip s = slip(z);
            const double f = std::copysign(grip * (1 - std::exp(-7.5 * std::abs(s.effective))), s.effective);
            force[vehicle] += f;
            force[wheels] -= f * wheel_radius;
            rate[i++] = s.rate;
        }
        force[crank] += z[torque];
        rate[i++] = (demand(z[crank], z[boost]) - z[torque]) / engine.actuator_lag;
        const double load = std::clamp(z[torque] / interpolated(engine.full_load, z[crank]), 0.0, 1.0);
        rate[i] = (load - z[boost]) / engine.turbo_lag;
    };

    system.start = Vector::Zero(system.size());
    system.start.head(n) = start_speeds;
    if (has_tyre) {
        const double rim = start_speeds[wheels] * wheel_radius, v = start_speeds[vehicle];
        system.start[kappa] = (rim - v) / std::max(std::abs(rim), std::abs(v));
    }
    system.start[torque] = demand(start_speeds[crank], 1);
    system.start[boost] =
        std::clamp(system.start[torque] / interpolated(engine.full_load, start_speeds[crank]), 0.0, 1.0);
    std::sort(system.breaks.begin(), system.breaks.end());
    system.breaks.erase(std::unique(system.breaks.begin(), system.breaks.end(),
                                    [](double a, double b) { return b - a < 1e-9; }),
                        system.breaks.end());
    return system;
}

}  // namespace shiftrig::cases
