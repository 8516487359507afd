// Hydrodynamic torque converter; law: laws/converter.h.
#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "plant/connectors/connector.h"

namespace shiftrig::plant {

struct TorqueConverter {
    std::string name, pump, turbine;
    std::vector<std::pair<double, double>> k_over_speed_ratio;  // K = ω/√T [rad/s/√Nm]
    std::vector<std::pair<double, double>> torque_ratio_over_speed_ratio;
};

// ---- what it answers (connector.h)

inline const char* kind(const TorqueConverter&) {
    return "converter";
}
inline std::array<End, 2> ends(const TorqueConverter& c) {
    return {End{"pump", c.pump, false, "pump", EndMotion::rotating},
            End{"turbine", c.turbine, false, "turbine", EndMotion::rotating}};
}
void check_parameters(const Check& check, const TorqueConverter& device);
void add_law(detail::ModelBuilder& builder, const TorqueConverter& device);
void name_outputs(detail::ModelBuilder& builder, const std::vector<TorqueConverter>& devices);
double* show(const detail::Shown& at, const std::vector<TorqueConverter>& devices,
             double* next) SHIFTRIG_REALTIME;

}  // namespace shiftrig::plant
