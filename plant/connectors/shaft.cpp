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

void name_outputs(detail::ModelBuilder& builder, const std::vector<Shaft>& shafts) {
    for (const Shaft& shaft : shafts) {
        const std::string prefix = "shaft." + shaft.name + ".";
        builder.output(prefix + "torque", Unit::newton_metre, "torque on the first link");
        builder.output(prefix + "twist", Unit::radian, "twist, positive where the first link is ahead");
    }
}

double* show(const detail::Shown& at, const std::vector<Shaft>& shafts, double* next) SHIFTRIG_REALTIME {
    const detail::ModelData& m = at.model();
    const double* twist = at.sample.z + m.masses;
    for (std::size_t e = 0; e < shafts.size(); ++e, ++twist) {  // plain shafts are the first
        const double rate = at.mode.tree ? at.shaft_rate(static_cast<int>(e)) : at.sample.swing[e];
        *next++ = m.structure.shafts[e].stiffness * *twist + m.swing_damping[e] * rate;
        *next++ = *twist;
    }
    return next;
}

}  // namespace shiftrig::plant
