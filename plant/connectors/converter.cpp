#include "plant/connectors/converter.h"

#include "plant/check.h"
#include "plant/model_builder.h"
#include "plant/shown.h"

namespace shiftrig::plant {

void check_parameters(const Check& check, const TorqueConverter& c) {
    check.rising("k_over_speed_ratio", c.k_over_speed_ratio);
    check.rising("torque_ratio_over_speed_ratio", c.torque_ratio_over_speed_ratio);
}

void add_law(detail::ModelBuilder& builder, const TorqueConverter& c) {
    detail::ModelData& m = builder.model;
    const int pump = m.structure.mass(c.pump), turbine = m.structure.mass(c.turbine);
    const int pump_force = builder.external(pump), turbine_force = builder.external(turbine);
    m.converters.push_back({pump, turbine, pump_force, turbine_force});
    m.loses_in_fields = true;
}

void name_outputs(detail::ModelBuilder& builder, const std::vector<TorqueConverter>& converters) {
    for (const TorqueConverter& c : converters) {
        const std::string prefix = "converter." + c.name + ".";
        builder.output(prefix + "pump_torque", Unit::newton_metre, "from the pump into the converter");
        builder.output(prefix + "turbine_torque", Unit::newton_metre, "from the converter to the turbine");
    }
}

double* show(const detail::Shown& at, const std::vector<TorqueConverter>& converters,
             double* next) SHIFTRIG_REALTIME {
    for (std::size_t c = 0; c < converters.size(); ++c) {
        *next++ = at.sample.converter[2 * c];
        *next++ = at.sample.converter[2 * c + 1];
    }
    return next;
}

}  // namespace shiftrig::plant
