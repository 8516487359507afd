#include "plant/connectors/backlash.h"

#include "plant/assembly.h"
#include "plant/check.h"
#include "plant/format.h"
#include "plant/model_builder.h"
#include "plant/shown.h"

namespace shiftrig::plant {

void check_parameters(const Check& check, const Backlash& b) {
    check.positive("stiffness", b.stiffness);
    check.not_negative("damping", b.damping);
    check.positive("gap", b.gap);
    check.any("initial_twist", b.initial_twist);
}

void assemble(Assembly& assembly, const Backlash& b) {
    assembly.structure.shafts.push_back(
        {b.name, assembly.between(b.a, b.b), b.stiffness, b.damping, b.gap, b.initial_twist});
}

void name_outputs(detail::ModelBuilder& builder, const std::vector<Backlash>& backlashes) {
    for (const Backlash& b : backlashes) {
        const std::string prefix = "backlash." + b.name + ".";
        builder.output(prefix + "torque", builder.effort_unit(b.a), "torque on the first link");
        builder.output(prefix + "twist", builder.way_unit(b.a), "twist, 0 in the middle of the play");
        builder.output(prefix + "state", Unit::one, "0 open, +1 or -1 the flank that is closed");
    }
}

double* show(const detail::Shown& at, const std::vector<Backlash>& devices, double* next) SHIFTRIG_REALTIME {
    const detail::ModelData& m = at.model();
    for (std::size_t i = 0; i < devices.size(); ++i) {  // they are the first shafts with play
        const BacklashLaw& law = m.backlashes[i];
        const double side = detail::flank_side(at.work.contact[law.device]);
        const double twist = at.sample.z[m.masses + law.shaft];
        *next++ = side == 0 ? 0. : flank_torque(law, side, twist, at.sample.swing[law.shaft]);
        *next++ = twist;
        *next++ = side;
    }
    return next;
}

std::string in_words(const Backlash&, const Event& event) {
    const char* flank = event.value > 0 ? "forward" : "backward";
    if (event.kind == EventKind::flank_closes)
        return format("closes its %s flank at %.3f rad/s", flank, event.slip);
    if (event.kind == EventKind::flank_opens)
        return format("opens its %s flank at %.3f rad/s", flank, event.slip);
    return {};
}

}  // namespace shiftrig::plant
