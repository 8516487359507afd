// Each kind of expectation, held and broken; the whole line that a broken one gives.
#include "analysis/expectations.h"

#include <gtest/gtest.h>

namespace {

using namespace shiftrig;
using analysis::broken_expectations;

struct Case {
    io::ScenarioFile scenario;
    analysis::Run run;
    analysis::Scorecard card;

    Case() {
        scenario.path = "s.yaml";
        analysis::Column speed{{"mass.vehicle.speed", plant::Unit::metre_per_second, 0, 0, 0, ""}, {}};
        for (int i = 0; i <= 1000; ++i) {
            run.time.push_back(i * 1e-3);
            speed.value.push_back(i < 500 ? 2 : 3);
        }
        run.columns.push_back(speed);
        analysis::Change lock;
        lock.event.time = 0.4;
        lock.device = "F3";
        lock.kind = "lock";
        lock.text = "t=0.4 F3 locks";
        run.changes.push_back(lock);
        analysis::ShiftScore score;
        score.shift.from = "F2";
        score.shift.to = "F3";
        score.shift.asked_at = 0.2;
        score.shift.ended_at = 0.4;
        score.metrics = {{"duration_s", "", 0.2, {}}, {"clutch_energy_j", "F3", 6000.0, {}}};
        card.shifts.push_back(score);
    }
    std::vector<std::string> broken() const { return broken_expectations(scenario, run, card); }
    io::SignalBound bound(double from, double until, double minimum, double maximum) const {
        io::SignalBound b;
        b.quantity = {
            "mass.vehicle.speed_kmh", "mass.vehicle.speed", plant::Unit::metre_per_second, 1 / 3.6, 9, 3};
        b.window = {from, until};
        b.minimum = minimum / 3.6;
        b.maximum = maximum / 3.6;
        return b;
    }
};

constexpr double inf = std::numeric_limits<double>::infinity();
using Lines = std::vector<std::string>;

TEST(Expectations, NothingExpectedIsNeverBroken) {
    EXPECT_EQ(Case().broken(), Lines{});
}

TEST(Expectations, ABoundIsToldInTheScenariosUnitWithItsFirstInstant) {
    Case c;
    c.scenario.expect.signals = {c.bound(0, inf, -inf, 8)};
    EXPECT_EQ(c.broken(), Lines{"s.yaml:9:3: at 0.500 s: mass.vehicle.speed_kmh = 10.8; expected at most 8"});
    c.scenario.expect.signals = {c.bound(0, 0.499, 7, 8)};
    EXPECT_EQ(c.broken(), Lines{});
}

TEST(Expectations, TheFinalStateIsTheLastTick) {
    Case c;
    c.scenario.expect.signals = {c.bound(inf, inf, 7, 8)};
    EXPECT_EQ(
        c.broken(),
        Lines{"s.yaml:9:3: at 1.000 s: mass.vehicle.speed_kmh = 10.8; expected from 7 to 8 in the end"});
}

TEST(Expectations, AnUnknownSignalAndAnEmptyWindowAreBroken) {
    Case c;
    c.scenario.expect.signals = {c.bound(2, 3, 0, 100)};
    EXPECT_EQ(c.broken(),
              Lines{"s.yaml:9:3: mass.vehicle.speed_kmh: the run has no tick from 2.000 s to 3.000 s"});
    c.scenario.expect.signals[0].quantity.signal = "mass.moon.speed";
    EXPECT_EQ(c.broken(), Lines{"s.yaml:9:3: mass.vehicle.speed_kmh: the run has no such signal"});
}

TEST(Expectations, NotANumberBreaksEveryBound) {
    Case c;
    c.run.columns[0].value.back() = std::nan("");
    c.scenario.expect.signals = {c.bound(inf, inf, -1e9, 1e9)};
    EXPECT_EQ(c.broken().size(), 1U);
}

TEST(Expectations, EventsMustAndMustNotHappenInTheirWindow) {
    Case c;
    c.scenario.expect.events = {{"lock", "F3", {0.3, 0.5}, true, 4, 5},
                                {"lock", "F3", {0.5, 0.6}, false, 5, 5}};
    EXPECT_EQ(c.broken(), Lines{});
    c.scenario.expect.events = {{"lock", "F3", {0.5, 0.6}, true, 4, 5}, {"lock", "", {}, false, 5, 5}};
    EXPECT_EQ(c.broken(), (Lines{"s.yaml:4:5: lock of F3 must happen from 0.500 s to 0.600 s; it did not",
                                 "s.yaml:5:5: lock must not happen; found t=0.4 F3 locks"}));
}

TEST(Expectations, ShiftsAreExactlyThoseWritten) {
    Case c;
    c.scenario.expect.shifts_given = true;
    c.scenario.expect.shifts = {{"F2->F3", true, 6, 5}};
    EXPECT_EQ(c.broken(), Lines{});
    c.scenario.expect.shifts = {{"F2->F3", false, 6, 5}, {"F3->F4", true, 7, 5}};
    EXPECT_EQ(c.broken(), (Lines{"s.yaml:6:5: shift F2->F3 at 0.200 s completed; expected not completed",
                                 "s.yaml:7:5: shift F3->F4 expected; the run ended at 1.000 s without it"}));
    c.scenario.expect.shifts = {};
    c.scenario.expect.no_shifts_line = 6;
    EXPECT_EQ(c.broken(), Lines{"s.yaml:6: shift F2->F3 at 0.200 s found; none expected"});
}

TEST(Expectations, AMetricIsHeldForEveryShiftNamed) {
    Case c;
    c.scenario.expect.metrics = {{"", "clutch_energy_j.F3", -inf, 5000, 8, 7}};
    EXPECT_EQ(c.broken(),
              Lines{"s.yaml:8:7: F2->F3 at 0.200 s: clutch_energy_j.F3 = 6000; expected at most 5000"});
    c.scenario.expect.metrics = {{"F2->F3", "clutch_energy_j.F3", -inf, 7000, 8, 7},
                                 {"", "clutch_energy_j.F9", -inf, 1, 9, 7}};
    EXPECT_EQ(c.broken(), Lines{"s.yaml:9:7: clutch_energy_j.F9: no shift of the run has it"});
}

}  // namespace
