#include <algorithm>
#include <cmath>

#include "tests/plant/dice.h"
#include "tests/plant/random_vehicles.h"

namespace shiftrig {
namespace {

using namespace plant;

WetPlates wet_plates(Dice& dice, double size) {
    WetPlates plates{.surfaces = dice.integer(2, 12),
                     .outer_radius = 0.11 * size,
                     .inner_radius = 0.11 * size * dice.uniform(0.6, 0.85),
                     .return_pressure = dice.uniform(0.3e5, 1.5e5),
                     .mu_sliding = dice.uniform(0.08, 0.12),
                     .mu_rise = dice.uniform(-0.02, 0.03),
                     .mu_speed = dice.logarithmic(0.1, 1),
                     .clearance = dice.logarithmic(1e-4, 5e-4)};
    plates.mu_static = plates.mu_sliding + std::max(0., plates.mu_rise) + dice.uniform(0, 0.02);
    return plates;
}

ActuationHydraulic valve_without_piston(Dice& dice) {
    ActuationHydraulic valve;
    valve.dead_time = 1e-3 * dice.integer(0, 20);
    valve.natural_frequency = dice.uniform(40, 120);
    valve.damping_ratio = dice.uniform(0.5, 0.95);
    valve.slew = dice.logarithmic(50e5, 1000e5);
    valve.maximum_pressure = dice.uniform(8e5, 20e5);
    return valve;
}

// In place of what actuates the clutch so far: pressures that change once to three times.
void press(RandomSystem& system, const std::string& clutch, double maximum, Dice& dice, double seconds) {
    const bool closed = dice.chance(0.5);
    const auto pressure = [&] { return maximum * dice.uniform(0, 1); };
    const std::string input = "clutch." + clutch + ".pressure_command";
    system.inputs.push_back({0, input, closed ? pressure() : 0});
    for (int changes = dice.integer(1, 3); changes > 0; --changes) {
        const double time = 1e-3 * dice.integer(5, static_cast<int>(seconds * 900));
        system.inputs.push_back({time, input, dice.chance(0.3) ? 0 : pressure()});
    }
    std::erase_if(system.inputs, [&](const auto& change) {
        return change.input == "clutch." + clutch + ".release_command" ||
               change.input == "clutch." + clutch + ".application_command";
    });
}

bool has_brake_pedal(const Description& d) {
    return std::any_of(d.clutches.begin(), d.clutches.end(), [](const Clutch& c) {
        const auto* apply = std::get_if<ActuationApply>(&c.actuation);
        return apply && apply->by_driver_brake;
    });
}

}  // namespace

RandomSystem random_vehicle_with_wet_clutches(std::uint64_t seed, double seconds) {
    RandomSystem system = random_vehicle(seed, seconds);
    Dice dice(seed + 0x0e7);
    Description& d = system.description;
    d.oil = Oil{.viscosity_at_zero = dice.logarithmic(0.5, 20), .viscosity_decay = 0.0414};  // at 90 degC
    for (Clutch& c : d.clutches) {
        if (c.radius > 0 || std::holds_alternative<ActuationConstant>(c.actuation) || c.b == "trailer" ||
            !dice.chance(0.7))
            continue;
        const double capacity = std::get<DryFriction>(c.friction).sliding_capacity;
        WetPlates plates = wet_plates(dice, std::cbrt(capacity / 2500));
        const ActuationHydraulic valve = valve_without_piston(dice);
        const double radius = 0.9 * plates.outer_radius;  // about
        plates.piston_area = capacity / ((valve.maximum_pressure - plates.return_pressure) * radius *
                                         plates.surfaces * plates.mu_sliding);
        press(system, c.name, valve.maximum_pressure, dice, seconds);
        c.friction = plates;
        c.actuation = valve;
        c.drag = dice.chance(0.8);
        system.traits += " wet";
    }
    if (!has_brake_pedal(d))
        std::erase_if(system.inputs, [](const auto& change) { return change.input == "driver.brake"; });
    std::stable_sort(system.inputs.begin(), system.inputs.end(),
                     [](const auto& a, const auto& b) { return a.time < b.time; });
    return system;
}

}  // namespace shiftrig
