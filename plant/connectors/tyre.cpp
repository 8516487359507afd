#include "plant/connectors/tyre.h"

#include "plant/assembly.h"
#include "plant/check.h"
#include "plant/laws/tyre.h"
#include "plant/model_builder.h"
#include "plant/shown.h"

namespace shiftrig::plant {

void check_parameters(const Check& check, const BrixiusTyre& t) {
    check.positive("radius", t.radius);
    if (!(t.mobility_number >= softest_soil && t.mobility_number <= hardest_soil))
        check.fail("mobility_number", "= " + number(t.mobility_number) + "; must be within " +
                                          number(softest_soil) + " and " + number(hardest_soil));
    check.positive("relaxation_length", t.relaxation_length);
    check.not_negative("slip_damping_time", t.slip_damping_time);
    check.positive("weight", t.weight);
    check.not_negative("rolling_coefficient", t.rolling_coefficient);
}

void assemble(Assembly& assembly, const BrixiusTyre& t) {
    assembly.resist(t.body, t.weight / t.mobility_number);
    assembly.structure.rolling_contacts.push_back(
        {t.name, {assembly.link(t.wheel, 1), assembly.link(t.body, -1 / t.radius)}});
    if (t.rolling_coefficient <= 0) return;
    assembly.structure.pairs.push_back({t.name + ".rolling",
                                        PairKind::rolling,
                                        {assembly.link(t.wheel, 1), Link{}},
                                        t.rolling_coefficient * t.weight * t.radius});
}

void add_pair_law(detail::ModelBuilder& builder, const BrixiusTyre& t) {
    const int pair = builder.pair(t.name + ".rolling");
    if (pair < 0) return;
    builder.law(pair).source = detail::LoadSource::rolling;
    builder.law(pair).full_load = rolling_moment(t);
}

void add_law(detail::ModelBuilder& builder, const BrixiusTyre& t) {
    detail::ModelData& m = builder.model;
    detail::TyreLaw law;
    law.wheel = m.structure.mass(t.wheel);
    law.body = m.structure.mass(t.body);
    law.wheel_force = builder.external(law.wheel);
    law.body_force = builder.external(law.body);
    law.mobility =
        builder.input("environment.mobility_number", Unit::one, t.mobility_number, softest_soil, hardest_soil,
                      "Brixius number of the soil under the first tyre; others in proportion");
    law.share = t.mobility_number / m.description.tyres.front().mobility_number;
    law.resistance = builder.pair(t.body + ".resistance");
    m.tyres.push_back(law);
    m.auxiliary += 1;  // its relaxed slip
    m.loses_in_fields = true;
}

void name_outputs(detail::ModelBuilder& builder, const std::vector<BrixiusTyre>& tyres) {
    for (const BrixiusTyre& t : tyres) {
        builder.output("tyre." + t.name + ".force", Unit::newton, "force of the wheel on the body");
        builder.output("tyre." + t.name + ".slip", Unit::one, "slip, positive when driving");
    }
}

double* show(const detail::Shown& at, const std::vector<BrixiusTyre>& tyres, double* next) SHIFTRIG_REALTIME {
    for (std::size_t t = 0; t < tyres.size(); ++t) {
        *next++ = at.sample.tyre_force[t];
        *next++ = at.sample.tyre_slip[t];
    }
    return next;
}

}  // namespace shiftrig::plant
