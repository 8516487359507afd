// Masses, clutches and torques of small machines, each in one line.
#pragma once

#include <string>
#include <utility>

#include "plant/description.h"

namespace shiftrig::plant {

inline Mass mass(const std::string& name, double inertia, double speed = 0) {
    return {name, inertia, Motion::rotating, speed};
}

inline Clutch clutch(const std::string& name, const std::string& a, const std::string& b, double capacity,
                     double static_ratio = 1, Actuation actuation = ActuationConstant{}) {
    Clutch c;
    c.name = name;
    c.a = a;
    c.b = b;
    DryFriction friction;
    friction.sliding_capacity = capacity;
    friction.static_ratio = static_ratio;
    c.friction = friction;
    c.actuation = std::move(actuation);
    return c;
}

// Locked where a run begins.
inline Clutch held(const std::string& name, const std::string& a, const std::string& b, double capacity,
                   double static_ratio = 1, Actuation actuation = ActuationConstant{}) {
    Clutch c = clutch(name, a, b, capacity, static_ratio, std::move(actuation));
    c.initially_locked = true;
    return c;
}

// Of the reference tractor.
inline WetPlates powershift_plates() {
    WetPlates p;
    p.surfaces = 8;
    p.outer_radius = 0.110;
    p.inner_radius = 0.085;
    p.piston_area = 0.0150;
    p.return_pressure = 1.2e5;
    p.mu_static = 0.13;
    p.mu_sliding = 0.10;
    p.mu_rise = 0.025;
    p.mu_speed = 0.3;
    p.clearance = 0.25e-3;
    return p;
}

inline Oil reference_oil() {
    Oil oil;
    oil.viscosity_at_zero = 0.5;
    oil.viscosity_decay = 0.0414;
    return oil;
}

inline Gear lossy_gear(const std::string& name, const std::string& a, const std::string& b, double ratio,
                       double efficiency, double bearing = 0, double backward_efficiency = 0) {
    Gear gear;
    gear.name = name;
    gear.a = a;
    gear.b = b;
    gear.ratio = ratio;
    gear.efficiency = efficiency;
    gear.bearing_torque = bearing;
    gear.backward_efficiency = backward_efficiency;
    return gear;
}

inline TorqueSource source(const std::string& mass, Waveform waveform) {
    TorqueSource s;
    s.name = mass + "_torque";
    s.mass = mass;
    s.waveform = std::move(waveform);
    return s;
}

inline Waveform constant(double value, double from = -1e300, double until = 1e300) {
    Waveform::Piece piece;
    piece.from = from;
    piece.until = until;
    piece.offset = value;
    return {{piece}};
}

inline Waveform sine(double amplitude, double frequency, double from = -1e300, double until = 1e300,
                     double phase_time = 0) {
    Waveform::Piece piece;
    piece.from = from;
    piece.until = until;
    piece.amplitude = amplitude;
    piece.frequency = frequency;
    piece.phase_time = phase_time;
    return {{piece}};
}

}  // namespace shiftrig::plant
