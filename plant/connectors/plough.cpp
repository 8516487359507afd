#include "plant/connectors/plough.h"

#include "plant/assembly.h"
#include "plant/check.h"
#include "plant/laws/plough.h"
#include "plant/model_builder.h"
#include "plant/shown.h"

namespace shiftrig::plant {

void check_parameters(const Check& check, const Plough& p) {
    check.positive("soil_factor", p.soil_factor);
    check.positive("a", p.a);
    check.not_negative("b", p.b);
    check.not_negative("c", p.c);
    check.positive("width", p.width);
    check.positive("depth", p.depth);
}

void assemble(Assembly& assembly, const Plough& p) {
    assembly.resist(p.body, plough_draft(p, 0, 1));
}

void add_law(detail::ModelBuilder& builder, const Plough& p) {
    detail::ModelData& m = builder.model;
    m.draft = builder.input("environment.draft", Unit::one, 0, 0, 10, "plough 0 out … 1 in the ground");
    const int body = m.structure.mass(p.body);
    m.ploughs.push_back(
        {body, builder.pair(p.body + ".resistance"), builder.external(body), plough_curve(p)});
}

void name_outputs(detail::ModelBuilder& builder, const std::vector<Plough>& ploughs) {
    for (const Plough& p : ploughs)
        builder.output("plough." + p.name + ".draft", Unit::newton, "force that resists the body");
}

// Its share of what resists the body.
double* show(const detail::Shown& at, const std::vector<Plough>&, double* next) SHIFTRIG_REALTIME {
    for (const detail::PloughLaw& law : at.model().ploughs) {
        const double draft = plough_draft(law.curve, at.sample.z[law.mass], at.work.operators.draft);
        const double all = at.sample.sliding[law.pair];
        *next++ = all > 0 ? at.passed(law.pair) * draft / all : 0.;
    }
    return next;
}

}  // namespace shiftrig::plant
