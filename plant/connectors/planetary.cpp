#include "plant/connectors/planetary.h"

#include "plant/assembly.h"
#include "plant/check.h"
#include "plant/model_builder.h"
#include "plant/shown.h"

namespace shiftrig::plant {

void check_parameters(const Check& check, const Planetary& p) {
    check.not_zero("ratio", p.ratio);
    if (p.ratio == 1) check.fail("ratio", "= 1; sun and ring would turn as one whatever the carrier does");
    check.share("efficiency", p.efficiency);
}

void assemble(Assembly& assembly, const Planetary& p) {
    assembly.structure.meshes.push_back({p.name, true, assembly.mass(p.sun), assembly.mass(p.ring),
                                         assembly.mass(p.carrier), p.ratio, p.efficiency, p.efficiency, 0,
                                         0});
}

void name_outputs(detail::ModelBuilder& builder, const std::vector<Planetary>& rows) {
    for (const Planetary& row : rows) {
        const std::string prefix = "row." + row.name + ".";
        builder.output(prefix + "sun", builder.effort_unit(row.sun), "torque from the sun into the row");
        builder.output(prefix + "ring", builder.effort_unit(row.ring), "torque from the ring into the row");
        builder.output(prefix + "carrier", builder.effort_unit(row.carrier),
                       "torque from the carrier into the row");
        builder.output(prefix + "direction", Unit::one, "x: +1 the sun drives, -1 it is driven, 0 at rest");
    }
}

double* show(const detail::Shown& at, const std::vector<Planetary>& rows, double* next) SHIFTRIG_REALTIME {
    const detail::ModelData& m = at.model();
    const Mesh* const meshes = m.structure.meshes.data();
    const double *const torque = at.sample.torque + m.pairs, *const loss = torque + m.meshes;
    const double* const direction = at.work.operators.table.direction;
    for (int k = m.meshes - static_cast<int>(rows.size()); k < m.meshes; ++k) {  // they are the last meshes
        const double u = meshes[k].force_ratio(static_cast<int>(direction[k])), sun = torque[k];
        const double lost = meshes[k].ratio * loss[k];
        *next++ = sun;
        *next++ = -u * sun + lost;
        *next++ = -(1 - u) * sun - lost;
        *next++ = m.lossy[static_cast<std::size_t>(k)] ? direction[k] : at.flow(k);
    }
    return next;
}

}  // namespace shiftrig::plant
