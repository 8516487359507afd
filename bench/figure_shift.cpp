// The tractor's shift under the plough: errors, costs, sensitivity; and the random machines.
#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

#include "bench/figure_data.h"
#include "bench/shift_methods.h"
#include "tests/plant/comparison.h"

namespace shiftrig::figures {
namespace {

constexpr cases::Shift shifts[] = {cases::Shift::good, cases::Shift::bad, cases::Shift::bad_coulomb};
constexpr const char* shift_names[] = {"good", "bad", "bad coulomb"};
constexpr double truth_step = 5e-6;

// Cheapest of a few runs: other load on the machine only ever adds.
ShiftTrace quickest_plant(const cases::TractorShift& shift, int steps,
                          const std::function<void(plant::Description&)>& change = {}) {
    ShiftTrace best = run_plant(shift, steps, change);
    for (int i = 0; i < 4; ++i) {
        const ShiftTrace again = run_plant(shift, steps, change);
        best.seconds = std::min(best.seconds, again.seconds);
    }
    return best;
}

// Speeds and shaft torques only: a clutch torque jumps, and one sample on the other side of a jump would
// be all that the next-step rule's error shows.
double worst_continuous(const TraceError& e) {
    return *std::max_element(e.relative.begin(), e.relative.begin() + 8);
}

double nanoseconds_per_millisecond(const cases::TractorShift& shift, double seconds) {
    return seconds * 1e9 / (shift.duration * 1e3);
}

}  // namespace

void shift(std::FILE* out) {
    std::fputs("case,time", out);
    for (const char* signal : shift_signals) std::fprintf(out, ",%s,%s reference", signal, signal);
    std::fputs("\n", out);
    for (int c = 0; c < 3; ++c) {
        const auto machine = cases::tractor_shift(shifts[c]);
        const ShiftTrace plant = run_plant(machine, 1), truth = run_reference(machine, truth_step);
        for (std::size_t k = 0; k < plant.rows.size(); ++k) {
            std::fprintf(out, "%s,%.3f", shift_names[c], 1e-3 * static_cast<double>(k));
            for (std::size_t s = 0; s < 11; ++s)
                std::fprintf(out, ",%.8g,%.8g", plant.rows[k][s], truth.rows[k][s]);
            std::fputs("\n", out);
        }
    }
}

void order(std::FILE* out) {
    std::fputs("case,transition,step,error,energy defect,dissipated,fall-backs\n", out);
    for (int c = 0; c < 3; ++c) {
        const auto machine = cases::tractor_shift(shifts[c]);
        const ShiftTrace truth = run_reference(machine, truth_step);
        for (const bool localised : {true, false})
            for (const int steps : {1, 2, 4, 8, 16, 32}) {
                const ShiftTrace trace = run_plant(machine, steps, [&](plant::Description& d) {
                    d.transition = localised ? plant::Transition::localised : plant::Transition::next_step;
                });
                std::fprintf(out, "%s,%s,%g,%.4g,%.4g,%.6g,%d\n", shift_names[c],
                             localised ? "localised" : "next step", 1e-3 / steps,
                             worst_continuous(error(trace, truth)), std::abs(trace.energy_defect),
                             trace.dissipated, trace.fall_backs);
            }
    }
}

void work_precision(std::FILE* out) {
    std::fputs("case,method,setting,error,ns per ms,evaluations\n", out);
    for (int c = 0; c < 3; ++c) {
        const auto machine = cases::tractor_shift(shifts[c]);
        const ShiftTrace truth = run_reference(machine, truth_step);
        const auto plant = [&](const char* name, plant::Method method) {
            for (const int steps : {1, 2, 4, 8}) {
                const ShiftTrace trace =
                    quickest_plant(machine, steps, [&](plant::Description& d) { d.method = method; });
                std::fprintf(out, "%s,%s,%g,%.4g,%.0f,\n", shift_names[c], name, 1e-3 / steps,
                             error(trace, truth).worst, nanoseconds_per_millisecond(machine, trace.seconds));
            }
        };
        plant("plant", plant::Method::automatic);
        const auto textbook = [&](const char* name, TextbookMethod method,
                                  std::initializer_list<double> settings) {
            for (const double setting : settings) {
                auto run = run_textbook(machine, method, setting);
                if (!run) continue;
                for (int i = 0; i < 2; ++i)
                    if (const auto again = run_textbook(machine, method, setting))
                        run->trace.seconds = std::min(run->trace.seconds, again->trace.seconds);
                std::fprintf(out, "%s,%s,%g,%.4g,%.0f,%ld\n", shift_names[c], name, setting,
                             error(run->trace, truth).worst,
                             nanoseconds_per_millisecond(machine, run->trace.seconds),
                             run->force_evaluations);
            }
        };
        textbook("RK4", TextbookMethod::runge_kutta_4, {1, 2, 4, 8});
        textbook("implicit Euler", TextbookMethod::implicit_euler, {1, 4, 16, 64});
        textbook("CVODE BDF", TextbookMethod::cvode_bdf, {1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8});
    }
}

void sensitivity(std::FILE* out) {
    struct Factor {
        const char* name;
        double cases::Estimates::*member;
    };
    using E = cases::Estimates;
    constexpr Factor factors[] = {{"shaft stiffness", &E::shaft_stiffness},
                                  {"shaft damping", &E::shaft_damping},
                                  {"wheel inertia", &E::wheel_inertia},
                                  {"inertias between engine and wheels", &E::other_inertias},
                                  {"engine inertia", &E::engine_inertia},
                                  {"engine lag", &E::engine_lag},
                                  {"torque without boost", &E::turbo_instant},
                                  {"turbo lag", &E::turbo_lag},
                                  {"losses of gears", &E::gear_losses},
                                  {"capacity of Fc", &E::main_capacity},
                                  {"friction of F1…F4", &E::friction},
                                  {"rise of friction at low slip", &E::friction_rise},
                                  {"slip over which it rises", &E::friction_speed},
                                  {"valve dead time", &E::dead_time},
                                  {"valve frequency", &E::valve_frequency},
                                  {"valve damping", &E::valve_damping},
                                  {"valve slew", &E::slew},
                                  {"fill volume", &E::fill_volume},
                                  {"fill flow", &E::fill_flow},
                                  {"preload of the spring", &E::preload},
                                  {"spring at full stroke", &E::return_spring},
                                  {"tyre relaxation length", &E::tyre_relaxation}};
    std::fputs(
        "case,estimate,factor,peak damper torque,peak axle torque,clutch heat,locked at,peak acceleration\n",
        out);
    const auto line = [&](int c, const char* name, double factor, const cases::Estimates& estimates) {
        const auto machine = cases::tractor_shift(shifts[c], estimates);
        const ShiftTrace trace =
            run_plant(machine, 1, [&](plant::Description& d) { cases::add_pistons(d, estimates); });
        double damper = 0, axle = 0, acceleration = 0, locked = -1;
        for (std::size_t k = 0; k < trace.rows.size(); ++k) {
            damper = std::max(damper, std::abs(trace.rows[k][5]));
            axle = std::max(axle, std::abs(trace.rows[k][7]));
            // Mean acceleration of the vehicle over 50 ms, the 10 Hz that a driver feels.
            if (k >= 50)
                acceleration =
                    std::max(acceleration, std::abs(trace.rows[k][4] - trace.rows[k - 50][4]) / 0.05);
        }
        for (const auto& event : trace.events)
            if (event.find("F3 locks") != std::string::npos)
                locked = std::stod(event.substr(2)) - machine.warm_up;
        std::fprintf(out, "%s,%s,%g,%.6g,%.6g,%.6g,%.6g,%.6g\n", shift_names[c], name, factor, damper, axle,
                     trace.clutch_heat, locked, acceleration);
    };
    for (const int c : {0, 1}) {
        line(c, "none", 1, {});
        for (const auto& factor : factors)
            for (const double f : {0.7, 1.3}) {
                cases::Estimates estimates;
                estimates.*factor.member = f;
                line(c, factor.name, f, estimates);
            }
    }
}

void random_systems(std::FILE* out) {
    std::fputs("seed,outcome,worst,worst speed,events,fall-backs\n", out);
    const ComparisonOptions options;
    for (std::uint64_t seed = 1; seed <= 1000; ++seed) {
        const Comparison c = compare(random_system(seed, options.seconds), seed, options);
        std::fprintf(out, "%llu,%s,%.4g,%.4g,%d,%d\n", static_cast<unsigned long long>(seed), name(c.outcome),
                     c.worst, c.worst_speed, c.events, c.fall_backs);
    }
}

}  // namespace shiftrig::figures
