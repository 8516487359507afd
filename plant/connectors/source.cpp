#include "plant/connectors/source.h"

#include "plant/check.h"
#include "plant/model_builder.h"

namespace shiftrig::plant {

void check_parameters(const Check& check, const TorqueSource& source) {
    check.waveform("waveform", source.waveform);
    check.not_negative("quadratic", source.quadratic);
}

void add_law(detail::ModelBuilder& builder, const TorqueSource& source) {
    detail::ModelData& m = builder.model;
    detail::SourceLaw law;
    law.mass = m.structure.mass(source.mass);
    law.force = builder.external(law.mass);
    if (source.input)
        law.input = builder.input("source." + source.name + ".torque", builder.effort_unit(source.mass), 0,
                                  -1e9, 1e9, "test-bench torque");
    builder.breakpoints(source.waveform);
    if (!source.waveform.pieces.empty()) m.depends_on_time = true;
    m.sources.push_back(law);
}

}  // namespace shiftrig::plant
