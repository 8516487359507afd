#include "tests/plant/random_pistons.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <variant>
#include <vector>

#include "tests/plant/dice.h"
#include "tests/plant/random_vehicles.h"

namespace shiftrig {
namespace {

using namespace plant;

class Builder {
  public:
    Builder(std::uint64_t seed, double seconds) : dice_(seed + 0x9157), seconds_(seconds) {
        system_ = dice_.chance(0.5) ? random_system(seed, seconds) : random_vehicle(seed, seconds);
        d().name += " with pistons";
    }

    RandomSystem build() {
        oil();
        for (int i = dice_.integer(1, 3); i > 0; --i) instants_.push_back(instant());
        for (Clutch& c : d().clutches) {
            if (c.radius > 0 || c.b == "trailer" || !dice_.chance(0.85)) continue;
            forget(c);
            make_wet(c);
        }
        pump();
        tidy();
        return std::move(system_);
    }

  private:
    Description& d() { return system_.description; }
    double instant() { return 1e-3 * dice_.integer(2, static_cast<int>(seconds_ * 900)); }
    // In many machines several valves are told something at once.
    double some_instant() {
        return dice_.chance(0.5) ? instants_[static_cast<std::size_t>(
                                       dice_.integer(0, static_cast<int>(instants_.size()) - 1))]
                                 : instant();
    }
    double lightest(const Clutch& c) {
        double least = 1e300;
        for (const Mass& m : d().masses)
            if (m.name == c.a || m.name == c.b) least = std::min(least, m.inertia);
        return least;
    }

    void oil() {
        d().oil = Oil{.viscosity_at_zero = dice_.logarithmic(0.3, 3), .viscosity_decay = 0.0414};
        if (dice_.chance(0.4)) {
            d().oil->initial_temperature = dice_.uniform(-15, 100);
            d().oil->cold_dead_time_factor = dice_.uniform(1, 4);
        }
    }

    // Commands of the actuation that it had.
    void forget(const Clutch& c) {
        std::erase_if(system_.inputs, [&](const auto& change) {
            return change.input == "clutch." + c.name + ".release_command" ||
                   change.input == "clutch." + c.name + ".application_command";
        });
    }

    void make_wet(Clutch& c) {
        const auto& dry = std::get<DryFriction>(c.friction);
        const double capacity = dry.sliding_capacity, size = std::cbrt(capacity / 2500);
        WetPlates plates{.surfaces = dice_.integer(2, 12),
                         .outer_radius = 0.11 * size,
                         .inner_radius = 0.11 * size * dice_.uniform(0.6, 0.85),
                         .return_pressure = dice_.uniform(0.3e5, 2e5),
                         .mu_sliding = dice_.uniform(0.08, 0.12),
                         .mu_rise = dice_.chance(0.3) ? 0 : dice_.uniform(-0.02, 0.03),
                         .mu_speed = dice_.logarithmic(0.1, 1),
                         .clearance = dice_.logarithmic(1e-4, 5e-4)};
        // Friction that falls drives slip apart at the rate slope/J.
        plates.mu_speed =
            std::max(plates.mu_speed, capacity * std::max(0., plates.mu_rise) / plates.mu_sliding *
                                          plates.outer_radius / (150 * lightest(c)));
        plates.mu_static = plates.mu_sliding + std::max(0., plates.mu_rise);
        if (dry.static_ratio > 1) plates.mu_static += dice_.uniform(0, 0.02);
        ActuationHydraulic valve;
        valve.dead_time = 1e-3 * (dice_.chance(0.5) ? dice_.integer(0, 20) : dice_.uniform(0, 20));
        valve.natural_frequency = dice_.uniform(40, 200);
        valve.damping_ratio = dice_.chance(0.2) ? dice_.uniform(1.05, 2) : dice_.uniform(0.4, 0.95);
        valve.slew = dice_.logarithmic(20e5, 2000e5);
        valve.maximum_pressure = dice_.uniform(8e5, 20e5);
        plates.piston_area = capacity / ((valve.maximum_pressure - plates.return_pressure) * 0.9 *
                                         plates.outer_radius * plates.surfaces * plates.mu_sliding);
        if (dice_.chance(0.9)) {
            valve.stroke = 2e-3;
            valve.fill_flow = dice_.logarithmic(3e-5, 5e-4);
            valve.fill_volume = valve.fill_flow * dice_.logarithmic(0.004, 0.08);
            valve.preload_pressure =
                dice_.chance(0.1) ? plates.return_pressure : plates.return_pressure * dice_.uniform(0, 0.95);
            most_asked_ = std::max(most_asked_, valve.fill_flow);
            system_.traits += " piston";
        }
        c.friction = plates;
        c.drag = dice_.chance(0.5);
        command("clutch." + c.name + ".pressure_command", plates, valve);
        c.actuation = valve;
        if (dice_.chance(0.1)) tell(some_instant(), "clutch." + c.name + ".leak", dice_.uniform(0, 0.6));
    }

    void tell(double time, const std::string& input, double value) {
        if (time < seconds_) system_.inputs.push_back({time, input, value});
    }
    double ms(int least, int most) { return 1e-3 * dice_.integer(least, most); }

    void command(const std::string& input, const WetPlates& plates, ActuationHydraulic& valve) {
        const double full = valve.maximum_pressure, kiss = plates.return_pressure;
        // Not the very pressure of a spring that does not stiffen: whether that fills is for rounding to say.
        const bool stiffens = valve.preload_pressure < kiss;
        const auto partly = [&] {
            return dice_.uniform(stiffens ? valve.preload_pressure : 0.7 * kiss, kiss);
        };
        const auto pressed = [&] { return dice_.uniform(kiss, full); };
        const auto low = [&] { return dice_.chance(0.5) ? 0 : dice_.uniform(0, kiss); };
        double now = dice_.chance(0.55) ? 0 : dice_.chance(0.2) ? partly() : pressed();
        valve.initial = now;
        double t = some_instant();
        for (int i = dice_.integer(1, 3); i > 0 && t < seconds_; --i) {
            switch (dice_.integer(0, 6)) {
                case 0:  // fill pulse, kiss point, pressure
                    tell(t, input, pressed());
                    tell(t += ms(3, 40), input, kiss * dice_.uniform(0.8, 1.3));
                    tell(t += ms(3, 60), input, now = pressed());
                    break;
                case 1:  // a step, up or down
                    tell(t, input, now = now > kiss ? low() : pressed());
                    break;
                case 2: {  // stairs
                    const double to = now > kiss ? low() : pressed(), from = now;
                    const int steps = dice_.integer(3, 20);
                    const double each = ms(1, 6);
                    for (int k = 1; k <= steps; ++k, t += each)
                        tell(t, input, from + (to - from) * k / steps);
                    now = to;
                    break;
                }
                case 3: {  // a wave through the return pressure, told every few milliseconds
                    const double swing = kiss * dice_.uniform(0.2, 1), mean = kiss * dice_.uniform(0.6, 1.4);
                    const double turn = 2 * std::numbers::pi * dice_.uniform(3, 25), each = ms(1, 4);
                    for (int k = dice_.integer(10, 40); k > 0; --k, t += each)
                        tell(t, input, now = std::max(0., mean + swing * std::sin(turn * t)));
                    break;
                }
                case 4:  // half way, and on
                    tell(t, input, partly());
                    tell(t += ms(5, 60), input, now = dice_.chance(0.7) ? pressed() : 0);
                    break;
                case 5:  // a dip
                    tell(t, input, low());
                    tell(t += ms(1, 25), input, now = pressed());
                    break;
                default:  // on, off, on again before it is empty
                    tell(t, input, pressed());
                    tell(t += ms(2, 50), input, low());
                    tell(t += ms(2, 40), input, now = pressed());
            }
            t += ms(2, 60);
        }
    }

    void pump() {
        if (most_asked_ == 0 || dice_.chance(0.3)) return;
        const double viscosity =
            d().oil->viscosity_at_zero * std::exp(-d().oil->viscosity_decay * d().oil->initial_temperature);
        d().oil->pump_flow =
            most_asked_ / (1 + viscosity / d().oil->fill_viscosity) * dice_.uniform(0.2, 1.6);
        system_.traits += " pump";
    }

    void tidy() {
        // A pedal that no brake listens to any more is no input.
        const bool pedal = std::any_of(d().clutches.begin(), d().clutches.end(), [](const Clutch& c) {
            const auto* apply = std::get_if<ActuationApply>(&c.actuation);
            return apply && apply->by_driver_brake;
        });
        auto& inputs = system_.inputs;
        if (!pedal) std::erase_if(inputs, [](const auto& change) { return change.input == "driver.brake"; });
        std::stable_sort(inputs.begin(), inputs.end(),
                         [](const auto& a, const auto& b) { return a.time < b.time; });
    }

    Dice dice_;
    double seconds_;
    RandomSystem system_;
    std::vector<double> instants_;
    double most_asked_ = 0;  // by one piston [m³/s]
};

}  // namespace

RandomSystem random_machine_with_pistons(std::uint64_t seed, double seconds) {
    return Builder(seed, seconds).build();
}

}  // namespace shiftrig
