// Every kind of connector, once: its name and where it ends. Whoever needs something of all of them (the regularity
// rule, unique names, the drawing) asks here, so that a new kind is one line in one list and its two functions above it.
#pragma once

#include <array>
#include <string>

#include "plant/description.h"

namespace shiftrig::plant {

// One link of a connector: the member of its struct that names the mass.
struct End {
    const char* field;
    const std::string& mass;
    bool may_be_housing = false;  // where it is empty
    const char* role = "";        // in a drawing, where the ends are not alike
};

inline const char* kind(const Shaft&) {
    return "shaft";
}
inline std::array<End, 2> ends(const Shaft& s) {
    return {End{"a", s.a}, End{"b", s.b}};
}

inline const char* kind(const Backlash&) {
    return "backlash";
}
inline std::array<End, 2> ends(const Backlash& s) {
    return {End{"a", s.a}, End{"b", s.b}};
}

inline const char* kind(const Damper&) {
    return "damper";
}
inline std::array<End, 2> ends(const Damper& k) {
    return {End{"a", k.a}, End{"b", k.b, true}};
}

inline const char* kind(const Clutch& c) {
    return c.b.empty() ? "brake" : "clutch";
}
inline std::array<End, 2> ends(const Clutch& c) {
    return {End{"a", c.a}, End{"b", c.b, true}};
}

inline const char* kind(const Freewheel&) {
    return "freewheel";
}
inline std::array<End, 2> ends(const Freewheel& f) {
    return {End{"a", f.a}, End{"b", f.b, true}};
}

inline const char* kind(const Gear&) {
    return "gear";
}
inline std::array<End, 2> ends(const Gear& g) {
    return {End{"a", g.a}, End{"b", g.b}};
}

inline const char* kind(const Planetary&) {
    return "planetary row";
}
inline std::array<End, 3> ends(const Planetary& p) {
    return {End{"sun", p.sun, false, "sun"}, End{"ring", p.ring, false, "ring"},
            End{"carrier", p.carrier, false, "carrier"}};
}

inline const char* kind(const BrixiusTyre&) {
    return "tyre";
}
inline std::array<End, 2> ends(const BrixiusTyre& t) {
    return {End{"wheel", t.wheel}, End{"body", t.body}};
}

inline const char* kind(const TorqueConverter&) {
    return "converter";
}
inline std::array<End, 2> ends(const TorqueConverter& c) {
    return {End{"pump", c.pump, false, "pump"}, End{"turbine", c.turbine, false, "turbine"}};
}

inline const char* kind(const Engine&) {
    return "engine";
}
inline std::array<End, 1> ends(const Engine& e) {
    return {End{"mass", e.mass}};
}

inline const char* kind(const TorqueSource&) {
    return "source";
}
inline std::array<End, 1> ends(const TorqueSource& s) {
    return {End{"mass", s.mass}};
}

inline const char* kind(const Road&) {
    return "road";
}
inline std::array<End, 1> ends(const Road& r) {
    return {End{"body", r.body}};
}

inline const char* kind(const Plough&) {
    return "plough";
}
inline std::array<End, 1> ends(const Plough& p) {
    return {End{"body", p.body}};
}

// Calls with every connector of the machine, kind by kind.
template <class Function>
void for_each_connector(const Description& d, const Function& function) {
    const auto each = [&](const auto&... kinds) {
        const auto all = [&](const auto& devices) {
            for (const auto& device : devices) function(device);
        };
        (all(kinds), ...);
    };
    each(d.shafts, d.backlashes, d.dampers, d.clutches, d.freewheels, d.gears, d.planetaries, d.tyres,
         d.converters, d.engines, d.sources, d.roads, d.ploughs);
}

}  // namespace shiftrig::plant
