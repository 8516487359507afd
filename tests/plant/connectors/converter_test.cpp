// A converter in a machine: what its knots cost a step.
#include "plant/connectors/converter.h"

#include <gtest/gtest.h>

#include "plant/samples.h"
#include "tests/plant/machines.h"
#include "tests/plant/rig.h"

namespace shiftrig::plant {
namespace {

// A pump that is driven against a turbine on a spring to the housing, which comes to rest strained by the stall torque.
Rig stalled() {
    Description d;
    d.masses = {machines::mass("pump", 1.5), machines::mass("turbine", 0.05), machines::mass("m", 0.2)};
    TorqueConverter c;
    c.name = "converter", c.pump = "pump", c.turbine = "turbine";
    c.k_over_speed_ratio = {{0, 6.6}, {0.65, 7.1}, {0.93, 9.5}, {1, 12.4}};
    c.torque_ratio_over_speed_ratio = {{0, 2.5}, {0.85, 1}, {1, 1}};
    d.converters = {c};
    d.shafts = {machines::shaft("s", "turbine", "m", 5e4, 0), machines::shaft("mount", "m", "", 2e4, 3)};
    TorqueSource source;
    source.name = source.mass = "pump";
    source.input = true;
    d.sources = {source};
    return Rig(d);
}

// Was the last step taken in parts?
bool was_divided(Rig& rig) {
    return rig.scratch.data().part_mode != nullptr;
}

TEST(Converter, OfAStalledTurbineNoStepIsDividedByRounding) {
    Rig rig = stalled();
    rig.in("source.pump.torque") = 300;
    rig.run(20);
    EXPECT_NEAR(rig.out("mass.turbine.speed"), 0, 1e-9);
    int divided = 0;
    for (int n = 0; n < 4000; ++n) {
        rig.step();
        divided += was_divided(rig);
    }
    EXPECT_EQ(divided, 0);
}

TEST(Converter, AStepIsDividedWhereItsTablesBend) {
    Rig rig = stalled();
    rig.in("source.pump.torque") = 300;
    int divided = 0;
    while (rig.state.time() < 0.5) {  // the pump runs up, the turbine swings forward and back
        rig.step();
        divided += was_divided(rig);
    }
    EXPECT_GT(divided, 1);
}

}  // namespace
}  // namespace shiftrig::plant
