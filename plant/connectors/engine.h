// Diesel engine; law: laws/engine.h.
#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "plant/connectors/connector.h"

namespace shiftrig::plant {

// Diesel engine on a mass. full_load is net, as a brake on the crankshaft measures it. Figures of the reference tractor with
// their sources: config/tractor.yaml.
struct Engine {
    std::string name, mass;
    std::vector<std::pair<double, double>> full_load;      // (ω [rad/s], T [Nm]), rising in ω
    double governor_slope = 0;                             // [Nm s/rad]
    double low_idle = 0;                                   // no-load speed at throttle 0 [rad/s]
    double high_idle = 0;                                  // no-load speed at throttle 1 [rad/s]
    double friction_constant = 0, friction_per_speed = 0;  // [Nm], [Nm s/rad]; when motoring
    double actuator_lag = 0;                               // [s]
    double turbo_instant_fraction = 1, turbo_lag = 0;      // [1], [s]
    double fade_from = 0, fade_to = 0;  // below fade_from the curve falls linearly to 0 at fade_to [rad/s]
    double stall_speed = 0;             // below it the engine has stalled until `engine.<name>.start` [rad/s]
    int cylinders = 6;  // of four strokes: its main order is cylinders/2 (warnings.h alone asks)
};

// ---- what it answers (connector.h)

inline const char* kind(const Engine&) {
    return "engine";
}
inline std::array<End, 1> ends(const Engine& c) {
    return {End{.field = "mass", .mass = c.mass, .motion = EndMotion::rotating}};
}
void check_parameters(const Check& check, const Engine& device);
void assemble(Assembly& assembly, const Engine& device);
void add_pair_law(detail::ModelBuilder& builder, const Engine& device);
void add_law(detail::ModelBuilder& builder, const Engine& device);
void name_outputs(detail::ModelBuilder& builder, const std::vector<Engine>& devices);
double* show(const detail::Shown& at, const std::vector<Engine>& devices, double* next) SHIFTRIG_REALTIME;
std::string in_words(const Engine& device, const Event& event);

}  // namespace shiftrig::plant
