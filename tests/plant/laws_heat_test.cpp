// Lags of pedals and heat of facings against closed forms.
#include <gtest/gtest.h>

#include <cmath>

#include "plant/laws/heat.h"
#include "plant/laws/lag.h"

namespace shiftrig::plant {
namespace {

TEST(Lag, IsExactForAHeldCommandAndLimitsIt) {
    const LagOperator op = lag_operator(0.08, 1e-3);
    double y = 0.2;
    const StepValues values = advance_lag(op, y, 7);
    EXPECT_EQ(values.begin, 0.2);
    EXPECT_NEAR(values.middle, 1 - 0.8 * std::exp(-0.5e-3 / 0.08), 1e-15);
    EXPECT_NEAR(y, 1 - 0.8 * std::exp(-1e-3 / 0.08), 1e-15);
    EXPECT_NEAR(values.at(0.25), 1 - 0.8 * std::exp(-0.25e-3 / 0.08), 2e-8);
    const LagOperator none = lag_operator(0, 1e-3);
    EXPECT_EQ(advance_lag(none, y, 0.3).begin, 0.3);
}

FacingHeat reference_heat() {
    FacingHeat p;
    p.surface_capacity = 120;
    p.bulk_capacity = 1400;
    p.surface_to_bulk = 400;
    p.bulk_to_oil = 120;
    return p;
}

TEST(Heat, SettlesAtTheConductances) {
    const HeatOperator op = heat_operator(reference_heat(), 0.1);
    HeatState state{90, 90};
    for (int n = 0; n < 5000; ++n) advance_heat(op, state, 1200, 90);
    EXPECT_NEAR(state.bulk, 90 + 1200. / 120, 1e-9);
    EXPECT_NEAR(state.surface, state.bulk + 1200. / 400, 1e-9);
}

TEST(Heat, OneLongStepEqualsManyShortOnes) {
    const HeatOperator once = heat_operator(reference_heat(), 1.0),
                       often = heat_operator(reference_heat(), 1e-3);
    HeatState a{90, 90}, b = a;
    advance_heat(once, a, 50e3, 80);
    for (int n = 0; n < 1000; ++n) advance_heat(often, b, 50e3, 80);
    EXPECT_NEAR(a.surface, b.surface, 1e-9);
    EXPECT_NEAR(a.bulk, b.bulk, 1e-9);
    // Energy: what went in is stored or went to the oil (checked by one step small against the flow).
    HeatState c{90, 90};
    advance_heat(often, c, 50e3, 90);
    EXPECT_NEAR(120 * (c.surface - 90) + 1400 * (c.bulk - 90), 50, 1e-3);
}

TEST(Heat, WithoutConductancesHeatStays) {
    FacingHeat p = reference_heat();
    p.surface_to_bulk = p.bulk_to_oil = 0;
    const HeatOperator op = heat_operator(p, 0.5);
    HeatState state{20, 20};
    advance_heat(op, state, 240, 90);
    EXPECT_NEAR(state.surface, 21, 1e-12);
    EXPECT_NEAR(state.bulk, 20, 1e-12);
}

}  // namespace
}  // namespace shiftrig::plant
