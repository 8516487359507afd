// Driven tyre on soil; law: laws/tyre.h.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "plant/connectors/connector.h"

namespace shiftrig::plant {

// Tyre with Brixius traction and relaxation, between a wheel and a translating mass.
struct BrixiusTyre {
    std::string name, wheel, body;
    double radius = 0;  // rolling radius [m]
    double mobility_number =
        0;  // Bn [1]; of the first tyre: initial value of input `environment.mobility_number`
    double relaxation_length = 0;    // σ [m]
    double slip_damping_time = 0;    // τ [s]
    double weight = 0;               // on this contact [N]
    double rolling_coefficient = 0;  // 0.04: rolling moment coeff·W·r as a friction device on the wheel
    // Bn is the soil's strength times what is the tyre's own (width, diameter, weight). The input changes the soil, and with it the
    // numbers of all tyres in proportion.
    // The rest of the motion resistance acts on the body as a friction device (1/Bn + 0.5|s|/√Bn)·W.
};

// Within these the input environment.mobility_number may move.
constexpr double softest_soil = 1, hardest_soil = 1e4;

// ---- what it answers (connector.h)

inline const char* kind(const BrixiusTyre&) {
    return "tyre";
}
inline std::array<End, 2> ends(const BrixiusTyre& t) {
    return {End{.field = "wheel", .mass = t.wheel, .motion = EndMotion::rotating},
            End{.field = "body", .mass = t.body, .motion = EndMotion::translating}};
}
void check_parameters(const Check& check, const BrixiusTyre& device);
void assemble(Assembly& assembly, const BrixiusTyre& device);
void add_pair_law(detail::ModelBuilder& builder, const BrixiusTyre& device);
void add_law(detail::ModelBuilder& builder, const BrixiusTyre& device);
void name_outputs(detail::ModelBuilder& builder, const std::vector<BrixiusTyre>& devices);
double* show(const detail::Shown& at, const std::vector<BrixiusTyre>& devices,
             double* next) SHIFTRIG_REALTIME;

}  // namespace shiftrig::plant
