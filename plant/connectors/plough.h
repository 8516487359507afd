// Mouldboard plough behind a body; law: laws/plough.h.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "plant/connectors/connector.h"

namespace shiftrig::plant {

// Plough draft F·(A + B·S + C·S²)·W·T, S in km/h, W in m, T in cm: resists motion and holds at rest.
// Input `environment.draft` scales it 0…1 (plough out … in).
struct Plough {
    std::string name, body;
    double soil_factor = 0, a = 0, b = 0, c = 0;  // ASABE D497
    double width = 0;                             // [m]
    double depth = 0;                             // [m]
};

// ---- what it answers (connector.h)

inline const char* kind(const Plough&) {
    return "plough";
}
inline std::array<End, 1> ends(const Plough& c) {
    return {End{.field = "body", .mass = c.body, .motion = EndMotion::translating}};
}
void check_parameters(const Check& check, const Plough& device);
void assemble(Assembly& assembly, const Plough& device);
void add_law(detail::ModelBuilder& builder, const Plough& device);
void name_outputs(detail::ModelBuilder& builder, const std::vector<Plough>& devices);
double* show(const detail::Shown& at, const std::vector<Plough>& devices, double* next) SHIFTRIG_REALTIME;

}  // namespace shiftrig::plant
