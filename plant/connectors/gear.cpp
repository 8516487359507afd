#include "plant/connectors/gear.h"

#include "plant/assembly.h"
#include "plant/check.h"
#include "plant/few.h"
#include "plant/model_builder.h"
#include "plant/shown.h"

namespace shiftrig::plant {

namespace {

bool loses_alike(const Gear& g) {
    return g.efficiency == 1 && (g.backward_efficiency == 0 || g.backward_efficiency == 1);
}

}  // namespace

void check_parameters(const Check& check, const Gear& g) {
    check.not_zero("ratio", g.ratio);
    check.share("efficiency", g.efficiency);
    if (g.backward_efficiency != 0) check.share("backward_efficiency", g.backward_efficiency);
    check.not_negative("bearing_torque", g.bearing_torque);
    check.any("backward_bearing_torque", g.backward_bearing_torque);
    // Two lines that never meet: both directions of power would agree with the same torques.
    if (loses_alike(g) && g.backward_bearing_torque >= 0 && g.backward_bearing_torque != g.bearing_torque)
        check.fail("backward_bearing_torque", "= " + number(g.backward_bearing_torque) +
                                                  "; must be bearing_torque where both efficiencies are 1");
    for (const auto& option : g.options) check.not_zero("options", option.second);
}

void assemble(Assembly& assembly, const Gear& g) {
    const double backward = g.backward_efficiency > 0 ? g.backward_efficiency : g.efficiency;
    const double bearing = g.backward_bearing_torque >= 0 ? g.backward_bearing_torque : g.bearing_torque;
    assembly.structure.meshes.push_back({g.name, false, assembly.mass(g.a), assembly.mass(g.b), -1, g.ratio,
                                         g.efficiency, backward, g.bearing_torque, bearing});
}

// One quantity of all gears after the other: loops write them so.
void name_outputs(detail::ModelBuilder& builder, const std::vector<Gear>& gears) {
    for (const Gear& g : gears)
        builder.output("gear." + g.name + ".torque", builder.effort_unit(g.a),
                       "torque from the first link into the gear");
    for (const Gear& g : gears)
        builder.output("gear." + g.name + ".direction", Unit::one,
                       "x: +1 the first link drives, -1 it is driven, 0 at rest");
    for (const Gear& g : gears)
        builder.output("gear." + g.name + ".power", Unit::watt, "power into the first link");
}

double* show(const detail::Shown& at, const std::vector<Gear>& devices, double* next) SHIFTRIG_REALTIME {
    const detail::ModelData& m = at.model();
    const auto gears = static_cast<int>(devices.size());  // they are the first meshes
    const double *const torque = at.sample.torque + m.pairs, *const speeds = at.sample.z;
    const double* const direction = at.work.operators.table.direction;
    next = detail::copy_few(torque, gears, next);
    detail::copy_few(direction, gears, next);
    for (const int k : m.lossless_gears) next[k] = at.flow(k);
    next += gears;
    const Mesh* const meshes = m.structure.meshes.data();
    for (int k = 0; k < gears; ++k) next[k] = torque[k] * speeds[meshes[k].first];
    return next + gears;
}

}  // namespace shiftrig::plant
