// The bench as a whole, in one process: standard scenarios, the silent controller, determinism.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "apps/rig/choices.h"
#include "apps/rig/collector.h"
#include "apps/rig/rehearsal.h"
#include "apps/rig/scenario_run.h"

namespace shiftrig::rig {
namespace {

const std::string config = SHIFTRIG_SOURCE_DIR "/config/";

io::ScenarioFile scenario(const std::string& name) {
    return io::read_scenario(config + "scenarios/" + name + ".yaml");
}

// A scenario in the words of a test; it stands where the others do.
io::ScenarioFile inline_scenario(const std::string& text) {
    return io::parse_scenario("model: ../tractor.yaml\nabout: a test\n" + text,
                              config + "scenarios/inline.yaml");
}

constexpr const char* ploughing_in_f2 = R"(
start:
  options: {range: M}
  locked: [Fc, F2]
  speeds: {engine_rpm: 1801}
  inputs: {driver.throttle: 0.7281, driver.lever: 2, environment.draft: 1, clutch.F2.pressure_command_bar: 18}
  settle_s: 5
)";

bool happened(const analysis::Run& run, const std::string& kind, const std::string& device) {
    return std::any_of(run.changes.begin(), run.changes.end(),
                       [&](const auto& change) { return change.kind == kind && change.device == device; });
}

const std::vector<double>& column(const analysis::Run& run, const std::string& name) {
    const auto* found = run.column(name);
    if (!found) throw std::invalid_argument("no column " + name);
    return *found;
}

double highest(const std::vector<double>& values) {
    double most = 0;
    for (const double v : values) most = std::max(most, std::fabs(v));
    return most;
}

double energy(const analysis::ShiftScore& shift, const std::string& clutch) {
    const auto* metric = shift.find("clutch_energy_j." + clutch);
    return metric && metric->value ? *metric->value : std::numeric_limits<double>::quiet_NaN();
}

TEST(Rig, PloughUpshiftTakesLessThan600MillisecondsAnd5KilojoulesInEachClutch) {
    const auto result = run_scenario(scenario("plough_upshift"));
    ASSERT_EQ(result.scorecard.shifts.size(), 1U);
    const auto& shift = result.scorecard.shifts.front();
    EXPECT_EQ(shift.shift.label(), "F2->F3");
    EXPECT_TRUE(shift.shift.completed());
    EXPECT_LT(shift.shift.duration(), 0.6);
    EXPECT_LT(energy(shift, "F2"), 5000);
    EXPECT_LT(energy(shift, "F3"), 5000);
    EXPECT_FALSE(happened(result.run, "break_away", "Fc"));
}

TEST(Rig, FavourableTimingOfTheArticlesShiftKeepsMainClutchAndWheelsClosed) {
    const auto good = run_scenario(scenario("article_fig11_good"));
    for (const char* device : {"Fc", "Fw"}) {
        EXPECT_FALSE(happened(good.run, "break_away", device)) << device;
        EXPECT_EQ(highest(column(good.run, std::string("clutch.") + device + ".state")), 0) << device;
    }
    EXPECT_TRUE(happened(good.run, "lock", "F2"));
}

TEST(Rig, UnfavourableTimingMakesMainClutchAndWheelsSlipAndTheShaftTorquePeak) {
    const auto good = run_scenario(scenario("article_fig11_good"));
    const auto bad = run_scenario(scenario("article_fig11_bad"));
    for (const char* device : {"Fc", "Fw"}) EXPECT_TRUE(happened(bad.run, "break_away", device)) << device;
    for (const char* shaft : {"shaft.E1.torque", "shaft.E2.torque"})
        EXPECT_GT(highest(column(bad.run, shaft)), 1.3 * highest(column(good.run, shaft))) << shaft;
}

TEST(Rig, TractorHeldOnASlopeCreepsLessThanANanometreInTenMinutes) {
    const auto result = run_scenario(scenario("hold_on_slope"));
    const auto& time = result.run.time;
    const auto& distance = column(result.run, "body.vehicle.distance");
    const auto& speed = column(result.run, "mass.vehicle.speed");
    std::size_t stopped = 0;
    for (std::size_t i = 0; i < speed.size(); ++i)
        if (std::fabs(speed[i]) > 1e-3) stopped = i;
    const auto begin = static_cast<std::size_t>(
        std::lower_bound(time.begin(), time.end(), time[stopped] + 60) - time.begin());
    ASSERT_LT(begin, time.size());
    EXPECT_GT(time.back() - time[begin], 590);
    const auto [least, most] =
        std::minmax_element(distance.begin() + static_cast<std::ptrdiff_t>(begin), distance.end());
    EXPECT_LT(*most - *least, 1e-9);
    EXPECT_GT(column(result.run, "environment.grade").back(), 0.149);
}

TEST(Rig, SilentControllerLeadsToTheSafeCommandWithin150MillisecondsAndBackAgain) {
    const auto result = run_scenario(inline_scenario(
        std::string(ploughing_in_f2) + "duration_s: 8\ncontroller: {silent: [{from_s: 1, until_s: 2}]}\n"));
    const auto& run = result.run;
    const auto& safe = column(run, "rig.safe_command");
    const auto& f2 = column(run, "clutch.F2.pressure_command");
    const auto& release = column(run, "clutch.Fc.release_command");
    for (std::size_t i = 0; i < run.time.size(); ++i) {
        const double t = run.time[i];
        if (t < 1.08) {  // the last command came at most one cycle before 1 s
            EXPECT_EQ(safe[i], 0) << t;
        } else if (t > 1.112 && t < 2) {  // 100 ms of silence
            EXPECT_EQ(safe[i], 1) << t;
        } else if (t > 2.2) {
            EXPECT_EQ(safe[i], 0) << t;
        }
        if (t > 1.162 && t < 2) {  // 50 ms of ramp
            EXPECT_EQ(f2[i], 0) << t;
            EXPECT_EQ(release[i], 1) << t;
        }
    }
    EXPECT_EQ(column(run, "clutch.F2.state").back(), 0) << "the gear is not taken again";
    EXPECT_TRUE(happened(run, "safe_command", ""));
    EXPECT_TRUE(happened(run, "commands_return", ""));
}

TEST(Rig, SameRunTwiceLeavesTheSameBits) {
    const auto one = run_scenario(scenario("plough_upshift")),
               other = run_scenario(scenario("plough_upshift"));
    ASSERT_EQ(one.run.columns.size(), other.run.columns.size());
    for (std::size_t c = 0; c < one.run.columns.size(); ++c) {
        if (one.run.columns[c].signal.name == "rig.tick_load") continue;  // what the machine took
        EXPECT_EQ(one.run.columns[c].value, other.run.columns[c].value) << one.run.columns[c].signal.name;
    }
}

// Ticks that build a mode are the longest of a run by far.
TEST(Rig, AfterARehearsalNoTickBuildsAModeAndNoBitIsAnother) {
    Rig plain(make_setup({}, scenario("plough_upshift"))),
        rehearsed(make_setup({}, scenario("plough_upshift")));
    EXPECT_EQ(rehearse(rehearsed, 60'000), 6000);
    int built = 0, built_after_rehearsal = 0;
    for (int i = 0; i < 6000; ++i) {
        plain.tick();
        rehearsed.tick();
        built += plain.certificate().mode_misses;
        built_after_rehearsal += rehearsed.certificate().mode_misses;
        ASSERT_TRUE(std::ranges::equal(plain.state().bytes(), rehearsed.state().bytes())) << "tick " << i;
    }
    EXPECT_GT(built, 3);
    EXPECT_EQ(built_after_rehearsal, 0);
}

TEST(Rig, ControllerElsewhereIsRehearsedWithTheShippedOne) {
    Choices nobody;
    nobody.buses = {"inprocess"};
    nobody.controller = "none";
    Rig rig(make_setup(nobody, scenario("plough_upshift"))),
        commanded(make_setup({}, scenario("plough_upshift")));
    EXPECT_EQ(rehearse(rig, 60'000), 6000);
    commanded.take_modes_of(rig);
    int built = 0;
    for (int i = 0; i < 6000; ++i) {
        commanded.tick();
        built += commanded.certificate().mode_misses;
    }
    EXPECT_EQ(built, 0);
}

TEST(Rig, WithoutAScenarioNothingIsRehearsed) {
    Choices choices;
    choices.model = config + "tractor.yaml";
    Rig rig(make_setup(choices));
    EXPECT_EQ(rehearse(rig, 60'000), 0);
}

TEST(Rig, LockstepInOneProcessIsTheFreeRunBitForBit) {
    Choices lockstep;
    lockstep.lockstep = true;
    const auto one = run_scenario(scenario("plough_upshift")),
               other = run_scenario(scenario("plough_upshift"), lockstep);
    EXPECT_EQ(other.report.unanswered, 0);
    for (const char* name : {"mass.vehicle.speed", "clutch.F3.torque", "clutch.F3.pressure_command"})
        EXPECT_EQ(column(one.run, name), column(other.run, name)) << name;
}

TEST(Rig, CommandThatIsNoNumberOrOutOfRangeIsLimitedAndNoted) {
    Choices choices;
    choices.controller = "none";
    Rig rig(make_setup(choices, inline_scenario(std::string(ploughing_in_f2) + "duration_s: 1\n")));
    const int command = rig.signals().find("clutch.F2.pressure_command");
    const double before = rig.value(command);
    ASSERT_TRUE(rig.request(command, std::numeric_limits<double>::quiet_NaN()));
    rig.tick();
    EXPECT_EQ(rig.value(command), before);
    ASSERT_TRUE(rig.request(command, 1e12));
    rig.tick();
    EXPECT_EQ(rig.value(command), rig.signals().signal(command).maximum);
    EXPECT_EQ(rig.value(rig.signals().find("rig.limited_inputs")), 2);
    EXPECT_FALSE(rig.request(rig.signals().find("mass.vehicle.speed"), 1)) << "an output was set";
}

// The driver's signals act within their ranges as well: the plant limits what it is given, and the recording would tell
// another story.
TEST(Rig, DriverOutOfHisRangeIsLimitedAndNoted) {
    Choices choices;
    choices.controller = "none";
    Rig rig(make_setup(choices, inline_scenario(std::string(ploughing_in_f2) + "duration_s: 1\n")));
    const auto index = [&](const char* name) { return rig.signals().find(name); };
    const auto expect_limited = [&](const char* name, double wanted, double acts) {
        const double before = rig.value(index("rig.limited_inputs"));
        ASSERT_TRUE(rig.request(index(name), wanted)) << name;
        rig.tick();
        EXPECT_EQ(rig.value(index(name)), acts) << name;
        EXPECT_EQ(rig.value(index("rig.limited_inputs")), before + 1) << name;
        ASSERT_EQ(rig.rig_events().size(), 2U) << name;
        EXPECT_EQ(rig.rig_events()[1].kind, RigEventKind::input_limited) << name;
        EXPECT_EQ(rig.rig_events()[1].signal, index(name));
        rig.tick();
        EXPECT_EQ(rig.value(index(name)), acts) << name;
        EXPECT_EQ(rig.value(index("rig.limited_inputs")), before + 1) << name << " is noted once";
    };
    const double nan = std::numeric_limits<double>::quiet_NaN();
    expect_limited("driver.lever", 500, 99);
    expect_limited("driver.lever", nan, 99);
    expect_limited("driver.auto", -1, 0);
    expect_limited("driver.parking_brake", 2, 1);
    expect_limited("driver.clutch_pedal", 5, 1);
    EXPECT_EQ(rig.value(index("clutch.Fc.release_command")), 1);
    expect_limited("driver.clutch_pedal", -std::numeric_limits<double>::infinity(), 0);
}

TEST(Rig, PedalReleasesTheMainClutchWhateverTheControllerSays) {
    const auto result = run_scenario(
        inline_scenario(std::string(ploughing_in_f2) +
                        "duration_s: 2\ntimeline:\n  - {at_s: 0.5, over_s: 0.1, driver.clutch_pedal: 1}\n"));
    EXPECT_EQ(column(result.run, "clutch.Fc.release_command").back(), 1);
    EXPECT_LT(column(result.run, "clutch.Fc.capacity").back(), 1);  // [Nm]: the lag of the release never ends
    EXPECT_NE(column(result.run, "clutch.Fc.state").back(), 0);
}

// A noisy sensor, then two seconds of it.
std::vector<double> noisy_readings(const std::string& seed) {
    Rig rig(make_setup(
        {}, inline_scenario("duration_s: 2\n" + seed + "start: {inputs: {sensor.engine.noise_rpm: 20}}\n")));
    const int reading = rig.signals().find("sensor.engine.speed");
    std::vector<double> readings;
    while (rig.ticks() < 200) {
        rig.tick();
        readings.push_back(rig.value(reading));
    }
    return readings;
}

TEST(Rig, ScenariosSeedIsThatOfTheNoise) {
    const auto unsaid = noisy_readings(""), one = noisy_readings("seed: 1\n"),
               two = noisy_readings("seed: 2\n");
    EXPECT_EQ(unsaid, one);
    EXPECT_EQ(two, noisy_readings("seed: 2\n"));
    int same = 0;
    for (std::size_t i = 0; i < one.size(); ++i) same += one[i] == two[i];
    EXPECT_EQ(same, 0);
}

// Every other command lost, which ones is the seed's to say.
std::vector<double> luck_of_commands(const std::string& seed, const std::string& own) {
    Rig rig(make_setup(
        {}, inline_scenario("duration_s: 1\n" + seed + "bus_faults: {" + own +
                            "faults: [{fault: drop, message: ClutchCommandA, probability: 0.5}]}\n")));
    const int status = rig.signals().find("bus.ClutchCommandA.status");
    std::vector<double> statuses;
    while (rig.ticks() < 1000) {
        rig.tick();
        statuses.push_back(rig.value(status));
    }
    return statuses;
}

TEST(Rig, ScenariosSeedIsThatOfBusFaultsWithoutTheirOwn) {
    const auto unsaid = luck_of_commands("", ""), two = luck_of_commands("seed: 2\n", "");
    EXPECT_EQ(unsaid, luck_of_commands("seed: 1\n", ""));
    EXPECT_NE(unsaid, two);
    EXPECT_EQ(unsaid, luck_of_commands("seed: 2\n", "seed: 1, "));
    EXPECT_EQ(two, luck_of_commands("", "seed: 2, "));
}

TEST(Rig, CertificateOfARunKeepsTheWorstAndCountsTheTicksOfEachFlag) {
    RunCertificate run;
    plant::Certificate tick;
    tick.torque_residual = 2e-15;
    tick.energy_defect = 3;
    tick.mode_lookups = 2'000'000'000;
    tick.flags = 1 | 8;
    run.take(tick);
    tick.torque_residual = 1e-15;
    tick.energy_defect = -1;
    tick.flags = 8;
    run.take(tick);
    EXPECT_EQ(run.torque_residual, 2e-15);
    EXPECT_EQ(run.energy_defect, 2);
    EXPECT_EQ(run.mode_lookups, 4'000'000'000);  // days of them
    EXPECT_EQ(run.flagged, (std::array<std::int64_t, 5>{1, 0, 0, 2, 0}));
    EXPECT_TRUE(run.is_finite());
    tick.flags = 4;
    run.take(tick);
    EXPECT_FALSE(run.is_finite());
    EXPECT_EQ(run.ticks, 3);
}

TEST(Rig, TheCertificatesSignalsAreOfAllSubsteps) {
    Choices choices;
    choices.substeps = 5;
    Rig rig(make_setup(choices, scenario("plough_upshift")));
    const int signal = rig.signals().find("certificate.events");
    ASSERT_GE(signal, 0);
    int located = 0;
    for (int i = 0; i < 6000; ++i) {
        rig.tick();
        ASSERT_EQ(rig.value(signal), rig.certificate().events) << "tick " << i;
        located += rig.certificate().events;
    }
    EXPECT_GT(located, 1);
}

// A `must_not` says nothing about events that were dropped, so every one is counted.
TEST(Rig, EventsThatDoNotFitATickOrTheCollectorAreCounted) {
    std::string text = std::string(ploughing_in_f2) + "duration_s: 1\ntimeline:\n";
    for (int i = 0; i < 300; ++i) text += "  - {at_s: 0.005, driver.throttle: 0.7}\n";
    Rig rig(make_setup({}, inline_scenario(text)));
    CollectorOptions little;
    little.most_events = 100;
    Collector roomy(rig, 20), small(rig, 20, little);
    std::int64_t told = 0, not_kept = 0;
    for (int i = 0; i < 20; ++i) {
        rig.tick();
        roomy.take(rig);
        small.take(rig);
        told += static_cast<std::int64_t>(rig.rig_events().size());
        not_kept += rig.rig_events_not_kept();
    }
    EXPECT_GE(told, 256);
    EXPECT_EQ(not_kept, 300 - 256);
    EXPECT_EQ(roomy.events_left_out(), not_kept);
    EXPECT_EQ(small.events_left_out(), not_kept + told - 100);
}

TEST(Rig, ScenarioThatSetsAnOutputIsRefusedWithItsPlace) {
    try {
        make_setup({}, inline_scenario("duration_s: 1\n"));
        const auto wrong =
            inline_scenario("duration_s: 1\ntimeline:\n  - {at_s: 0.5, mass.vehicle.speed_kmh: 3}\n");
        Rig rig(make_setup({}, wrong));
        FAIL() << "was accepted";
    } catch (const io::InputError& error) {
        EXPECT_EQ(
            std::string(error.what()),
            config + "scenarios/inline.yaml:5:17: mass.vehicle.speed_kmh is an output; it cannot be set");
    }
}

TEST(Rig, BusFaultsThatNoBusCarriesAreRefusedWithTheirPlace) {
    const auto refusal = [](const std::string& model, Choices choices) {
        try {
            Rig rig(make_setup(choices, io::parse_scenario("model: ../" + model +
                                                               "\nduration_s: 1\n"
                                                               "bus_faults:\n"
                                                               "  - {fault: drop, message: ClutchCommandA}\n",
                                                           config + "scenarios/inline.yaml")));
            return std::string();
        } catch (const io::InputError& error) {
            return std::string(error.what());
        }
    };
    const std::string place = config + "scenarios/inline.yaml:4:3: bus_faults: ";
    const std::string no_bus =
        "there is no CAN bus that they could act on; one of the buses must be inprocess, can:INTERFACE or "
        "udpcan:GROUP:PORT";
    Choices nobody, silent, lcm;
    nobody.controller = silent.controller = lcm.controller = "none";
    silent.buses = {"inprocess"};
    lcm.buses = {"lcm:memq://"};
    EXPECT_EQ(refusal("tractor.yaml", {}), "");
    EXPECT_EQ(refusal("tractor.yaml", silent), "");
    EXPECT_EQ(refusal("tractor.yaml", nobody), place + no_bus);
    EXPECT_EQ(refusal("tractor.yaml", lcm), place + no_bus);
    EXPECT_EQ(refusal("two_mass.yaml", {}),
              place + config + "two_mass.yaml has no stanza `can:`, and so no bus that they could act on");
}

std::string refusal_of(const std::string& text) {
    try {
        Rig rig(make_setup({}, inline_scenario(text)));
        return "";
    } catch (const io::InputError& error) {
        const std::string path = config + "scenarios/inline.yaml:";
        const std::string line = error.what();
        return line.starts_with(path) ? line.substr(path.size()) : "without its file: " + line;
    }
}

TEST(Rig, LeverBetweenTwoGearsIsRefused) {
    EXPECT_EQ(refusal_of("duration_s: 1\ntimeline:\n  - {at_s: 0.5, driver.lever: 2.5}\n"),
              "5:17: driver.lever = 2.5; must be a whole number");
    EXPECT_EQ(refusal_of("duration_s: 1\ntimeline:\n  - {at_s: 0.5, over_s: 0.1, driver.lever: 2}\n"),
              "5:30: driver.lever takes whole numbers; with it over_s must be 0");
    EXPECT_EQ(refusal_of("duration_s: 1\nstart: {inputs: {driver.lever: 0.5}}\n"),
              "4:18: driver.lever = 0.5; must be a whole number");
    EXPECT_EQ(refusal_of("duration_s: 1\nstart: {inputs: {driver.lever: 250}}\n"),
              "4:18: driver.lever = 250; must be within -9 and 99");
    EXPECT_EQ(refusal_of("duration_s: 1\nstart: {inputs: {driver.lever: -1}}\n"), "");
}

TEST(Rig, StartThatTheMachineCannotHaveIsRefusedWithItsPlace) {
    EXPECT_EQ(refusal_of("duration_s: 1\nstart:\n  locked: [Fc, F9]\n"),
              "5:3: start \"F9\": locked is no clutch, brake or freewheel of the model");
    EXPECT_EQ(refusal_of("duration_s: 1\nstart:\n  options: {range: Q}\n"),
              "5:3: gear \"range\": no option \"Q\"; there are L, M, H");
    EXPECT_EQ(refusal_of("duration_s: 1\nstart:\n  locked: [Fc]\n  speeds:\n    engine_rpm: 1800\n"
                         "    clutch_disc_rpm: 900\n"),
              "7:5: start \"engine\": speeds contradicts the other speeds through gears and locked devices");
}

}  // namespace
}  // namespace shiftrig::rig
