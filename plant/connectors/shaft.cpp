#include "plant/connectors/shaft.h"

#include "plant/assembly.h"
#include "plant/check.h"
#include "plant/model_builder.h"
#include "plant/shown.h"

namespace shiftrig::plant {

void check_parameters(const Check& check, const Shaft& e) {
    check.positive("stiffness", e.stiffness);
    check.not_negative("damping", e.damping);
    check.any("initial_twist", e.initial_twist);
}

void assemble(Assembly& assembly, const Shaft& s) {
    assembly.structure.shafts.push_back(
        {s.name, assembly.between(s.a, s.b), s.stiffness, s.damping, 0, s.initial_twist});
}

// One quantity of all shafts after the other: loops write them so.
void name_outputs(detail::ModelBuilder& builder, const std::vector<Shaft>& shafts) {
    for (const Shaft& shaft : shafts)
        builder.output("shaft." + shaft.name + ".torque", builder.effort_unit(shaft.a),
                       "torque on the first link");
    for (const Shaft& shaft : shafts) {
        builder.output("shaft." + shaft.name + ".twist", builder.way_unit(shaft.a),
                       "twist, positive where the first link is ahead");
    }
}

double* show(const detail::Shown& at, const std::vector<Shaft>& shafts, double* next) SHIFTRIG_REALTIME {
    const detail::ModelData& m = at.model();
    return m.kernel.loops.show_shafts(
        {m.shaft_stiffness.data(), m.swing_damping.data(), at.sample.z + m.masses, at.sample.swing,
         static_cast<int>(shafts.size())},
        next);  // plain shafts are the first
}

}  // namespace shiftrig::plant
