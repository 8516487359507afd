// Small machines that several plant tests share, written as descriptions by hand.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "plant/description.h"

namespace shiftrig::plant::machines {

inline DryFriction dry(double capacity, double static_ratio = 1) {
    DryFriction friction;
    friction.sliding_capacity = capacity;
    friction.static_ratio = static_ratio;
    return friction;
}

inline Clutch clutch(std::string name, std::string a, std::string b, double capacity = 1000,
                     double static_ratio = 1) {
    Clutch c;
    c.name = std::move(name);
    c.a = std::move(a);
    c.b = std::move(b);
    c.friction = dry(capacity, static_ratio);
    c.actuation = ActuationConstant{};
    return c;
}

inline Gear gear(std::string name, std::string a, std::string b, double ratio, double efficiency = 1) {
    Gear g;
    g.name = std::move(name);
    g.a = std::move(a);
    g.b = std::move(b);
    g.ratio = ratio;
    g.efficiency = efficiency;
    return g;
}

inline Planetary row(std::string name, std::string sun, std::string ring, std::string carrier, double ratio,
                     double efficiency = 1) {
    Planetary p;
    p.name = std::move(name);
    p.sun = std::move(sun);
    p.ring = std::move(ring);
    p.carrier = std::move(carrier);
    p.ratio = ratio;
    p.efficiency = efficiency;
    return p;
}

inline Mass mass(std::string name, double inertia, Motion motion = Motion::rotating) {
    Mass m;
    m.name = std::move(name);
    m.inertia = inertia;
    m.motion = motion;
    return m;
}

inline Shaft shaft(std::string name, std::string a, std::string b, double stiffness, double damping) {
    Shaft s;
    s.name = std::move(name);
    s.a = std::move(a);
    s.b = std::move(b);
    s.stiffness = stiffness;
    s.damping = damping;
    return s;
}

// The WT gearbox of [Algin] Fig. 9 (config/wt_gearbox.yaml): three rows, clutches C1, C2, brakes C3…C5.
inline Description wt_gearbox() {
    Description d;
    d.name = "wt_gearbox";
    for (const char* name : {"input", "sun23", "ring1", "node_a", "node_b", "output"})
        d.masses.push_back(mass(name, 0.5));
    // node_a: carrier 1 and ring 2; node_b: carrier 2 and ring 3.
    d.planetaries = {row("row1", "input", "ring1", "node_a", -1.779, 0.97),
                     row("row2", "sun23", "node_a", "node_b", -3.151, 0.97),
                     row("row3", "sun23", "node_b", "output", -2.409, 0.97)};
    d.clutches = {clutch("C1", "input", "sun23"), clutch("C2", "input", "node_b"), clutch("C3", "ring1", ""),
                  clutch("C4", "node_a", ""), clutch("C5", "node_b", "")};
    d.input_mass = "input";
    d.output_mass = "output";
    d.gear_paths = {{"I", {"C1", "C5"}}, {"II", {"C1", "C4"}}, {"III", {"C1", "C3"}}, {"IV", {"C1", "C2"}},
                    {"V", {"C2", "C3"}}, {"VI", {"C2", "C4"}}, {"R", {"C3", "C5"}}};
    return d;
}

// [Algin] Fig. 5: four masses, clutch F1, brake F2, planetary row D, shaft and damper between 3 and 4.
inline Description article_fig5(double u = -2) {
    Description d;
    d.name = "article_fig5";
    d.masses = {mass("J1", 0.5), mass("J2", 0.5), mass("J3", 0.5), mass("J4", 0.5)};
    d.clutches = {clutch("F1", "J1", "J2"), clutch("F2", "J2", "")};
    d.planetaries = {row("D", "J1", "J2", "J3", u)};
    d.shafts = {shaft("E", "J3", "J4", 5000, 0)};
    Damper k;
    k.name = "K";
    k.a = "J3";
    k.b = "J4";
    k.damping = 2;
    d.dampers = {k};
    d.input_mass = "J1";
    d.output_mass = "J4";
    return d;
}

}  // namespace shiftrig::plant::machines
