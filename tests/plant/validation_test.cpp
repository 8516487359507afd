// What the plant refuses to build: each refusal word for word, and the neighbour that it accepts.
#include <gtest/gtest.h>

#include "plant/plant.h"
#include "tests/plant/machines.h"
#include "tests/plant/parts.h"

namespace shiftrig::plant {
namespace {

std::string refusal(const Description& d) {
    try {
        Model::build(d);
        return "";
    } catch (const ModelError& error) {
        return error.what();
    }
}

// ---- clutches ---------------------------------------------------------------------------------------

Description wet_clutch(double preload, double stroke) {
    ActuationHydraulic valve;
    valve.natural_frequency = 60;
    valve.damping_ratio = 0.8;
    valve.slew = 150e5;
    valve.maximum_pressure = 18e5;
    valve.preload_pressure = preload;
    valve.stroke = stroke;
    valve.fill_volume = 30e-6;
    valve.fill_flow = 20e-3 / 60;
    Description d;
    d.masses = {mass("left", 1), mass("right", 2)};
    d.clutches = {clutch("F2", "left", "right", 1)};
    d.clutches[0].friction = powershift_plates();
    d.clutches[0].actuation = valve;
    return d;
}

// A spring that weakens while it is pressed would throw the piston to full stroke, with no pressure to balance it on the way.
TEST(Validation, TheReturnSpringOfAPistonDoesNotWeakenAlongItsStroke) {
    EXPECT_EQ(refusal(wet_clutch(1.2e5, 2e-3)), "");
    EXPECT_EQ(refusal(wet_clutch(5e5, 2e-3)),
              "clutch \"F2\": preload_pressure = 500000; must be <= return_pressure");
    EXPECT_EQ(refusal(wet_clutch(5e5, 0)), "") << "without a piston nobody asks for it";
}

}  // namespace
}  // namespace shiftrig::plant
