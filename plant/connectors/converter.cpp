#include "plant/connectors/converter.h"

#include "plant/check.h"
#include "plant/laws/converter.h"
#include "plant/math/table.h"
#include "plant/model_builder.h"
#include "plant/shown.h"

namespace shiftrig::plant {
namespace {

// Overrun takes the same tables from 0 to 1: what stands beyond would be read by nobody.
void check_table(const Check& check, const char* field, const Table& table, bool may_be_zero) {
    check.rising(field, table);
    for (const auto& [ratio, value] : table) {
        if (!(ratio >= 0 && ratio <= 1))
            check.fail(field, "has the speed ratio " + number(ratio) + "; must be within 0 and 1");
        if (!(value > 0) && !(may_be_zero && value == 0))
            check.fail(field, "is " + number(value) + " at speed ratio " + number(ratio) + "; must be " +
                                  (may_be_zero ? ">= 0" : "> 0"));
    }
}

// Speed ratio at which the converter passes the greatest share of its power. Torque ratios are linear between points, so the
// share R(ν) ν is a parabola there.
double most_efficient(const Table& torque_ratio) {
    double best = 1;
    const auto consider = [&](double ratio) {
        if (ratio * interpolate(torque_ratio, ratio) > best * interpolate(torque_ratio, best)) best = ratio;
    };
    for (std::size_t i = 0; i < torque_ratio.size(); ++i) {
        const auto [x, r] = torque_ratio[i];
        consider(x);
        if (i + 1 == torque_ratio.size()) continue;
        const auto [next_x, next_r] = torque_ratio[i + 1];
        const double slope = (next_r - r) / (next_x - x);
        const double top = slope < 0 ? 0.5 * (x - r / slope) : x;
        if (top > x && top < next_x) consider(top);
    }
    return best;
}

}  // namespace

void check_parameters(const Check& check, const TorqueConverter& c) {
    const char* const torque_ratio = "torque_ratio_over_speed_ratio";
    check_table(check, "k_over_speed_ratio", c.k_over_speed_ratio, false);
    check_table(check, torque_ratio, c.torque_ratio_over_speed_ratio, true);
    const double at = most_efficient(c.torque_ratio_over_speed_ratio);
    const double torque = interpolate(c.torque_ratio_over_speed_ratio, at);
    if (at * torque > 1 + 1e-9)
        check.fail(torque_ratio, "is " + number(torque) + " at speed ratio " + number(at) +
                                     ", more power than goes in; their product must be <= 1");
}

void add_law(detail::ModelBuilder& builder, const TorqueConverter& c) {
    detail::ModelData& m = builder.model;
    const int pump = m.structure.mass(c.pump), turbine = m.structure.mass(c.turbine);
    const int pump_force = builder.external(pump), turbine_force = builder.external(turbine);
    m.converters.push_back({pump, turbine, pump_force, turbine_force, converter_knots(c)});
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
