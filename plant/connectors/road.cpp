#include "plant/connectors/road.h"

#include "plant/check.h"
#include "plant/model_builder.h"

namespace shiftrig::plant {

void check_parameters(const Check& check, const Road& road) {
    check.not_negative("mass", road.mass);
    check.not_negative("air_coefficient", road.air_coefficient);
}

void add_law(detail::ModelBuilder& builder, const Road& road) {
    detail::ModelData& m = builder.model;
    m.grade = builder.input("environment.grade", Unit::one, 0, -10, 10, "slope of the road, positive uphill");
    m.road_mass.push_back(m.structure.mass(road.body));
    m.road_force.push_back(builder.external(m.road_mass.back()));
}

}  // namespace shiftrig::plant
