#include <gtest/gtest.h>

#include "io/lcm/channels.h"
#include "io/recording/csv.h"
#include "io/recording/field.h"
#include "io/recording/replay.h"
#include "recorded_shift.h"

namespace shiftrig::io {
namespace {

using namespace synthetic;

ReplayResult replay_file(const std::string& path, const ReplayOptions& options = {}) {
    RecordingReader reader(path);
    const plant::Model model = rebuild_model(reader.manifest(), options.tolerance > 0);
    const ReplayResult result = replay(reader, model, options);
    EXPECT_TRUE(!result.agrees() || reader.ending() == Ending::complete) << reader.complaint();
    return result;
}

std::string words(const ReplayResult& result) {
    if (!result.first) return "agrees";
    return "tick " + std::to_string(result.first->tick) + " " + result.first->signal + ": " +
           result.first->recorded + " / " + result.first->replayed;
}

// Where the value of a signal stands in the file, in the record written at `tick`; 0: it was not written then.
std::size_t place_of(const std::string& path, Table table, std::size_t signal, std::int64_t tick) {
    LogSource source(path);
    LogEvent event;
    record_signals_t signals;
    while (source.next(event))
        if (event.channel == channel::record_signals && decode(event.data, signals) == Decoded::whole &&
            signals.seq == tick && signals.table == static_cast<std::int16_t>(table) &&
            static_cast<std::size_t>(signals.block) == signal / signals_per_block)
            return static_cast<std::size_t>(event.offset) + event_log_header_size + event.channel.size() + 8 +
                   24 + 4 + 8 * (signal % signals_per_block);
    return 0;
}

// Overwrites a value and makes the checksum right again, as a program of other bits would have written it.
void forge(const std::string& path, Table table, std::size_t signal, std::int64_t tick, double value) {
    LogSource source(path);
    LogEvent event;
    record_signals_t signals;
    std::vector<std::byte> forged;
    while (source.next(event)) {
        std::vector<std::byte> data(event.data.begin(), event.data.end());
        if (event.channel == channel::record_signals && decode(event.data, signals) == Decoded::whole &&
            signals.seq == tick && signals.table == static_cast<std::int16_t>(table) &&
            static_cast<std::size_t>(signals.block) == signal / signals_per_block) {
            signals.value[signal % signals_per_block] = value;
            signals.encode(data.data(), 0, static_cast<int>(data.size()));
            const std::uint32_t crc = crc32(std::span(data).first(data.size() - 4));
            for (std::size_t i = 0; i < 4; ++i)
                data[data.size() - 4 + i] = static_cast<std::byte>(crc >> (24 - 8 * i));
        }
        append_log_event(forged, event.number, event.time_us, event.channel, data);
    }
    write_file(path, {reinterpret_cast<const char*>(forged.data()), forged.size()});
}

int index_of(const std::vector<plant::Signal>& signals, const std::string& name) {
    for (std::size_t i = 0; i < signals.size(); ++i)
        if (signals[i].name == name) return static_cast<int>(i);
    ADD_FAILURE() << "no signal " << name;
    return 0;
}

class Replayed : public testing::TestWithParam<std::pair<plant::KernelKind, int>> {};

TEST_P(Replayed, EveryTickOfAShiftAgreesBitForBit) {
    TemporaryFile file(".lcmlog");
    ShiftOptions options;
    options.kernel = GetParam().first;
    options.substeps = GetParam().second;
    const auto summary = record_shift(file.path, options);
    ASSERT_EQ(summary.lost, 0);
    const auto result = replay_file(file.path);
    EXPECT_TRUE(result.agrees()) << words(result);
    EXPECT_EQ(result.compared, 1500);
    RecordProperty("bytes_per_simulated_minute", static_cast<int>(summary.bytes * 40));
}

INSTANTIATE_TEST_SUITE_P(KernelsAndSubsteps, Replayed,
                         testing::Values(std::pair{plant::KernelKind::portable, 1},
                                         std::pair{plant::KernelKind::automatic, 1},
                                         std::pair{plant::KernelKind::portable, 4}));

TEST(Replay, ShiftIsInTheRecording) {
    TemporaryFile file(".lcmlog");
    record_shift(file.path);
    RecordingReader reader(file.path);
    const auto devices = reader.manifest().devices;
    bool locked = false;
    for (RecordedTick tick; reader.next(tick);)
        for (const auto& event : tick.events)
            locked = locked || (event.kind == plant::EventKind::lock &&
                                devices[static_cast<std::size_t>(event.device)] == "F3");
    EXPECT_TRUE(locked);
}

TEST(Replay, OneChangedOutputIsNamedWithTickAndBothValues) {
    TemporaryFile file(".lcmlog");
    record_shift(file.path);
    std::size_t signal = 0;
    {
        RecordingReader reader(file.path);
        signal = static_cast<std::size_t>(index_of(reader.manifest().outputs, "mass.engine.speed"));
    }
    forge(file.path, Table::outputs, signal, 777, 12.5);
    const auto result = replay_file(file.path);
    ASSERT_TRUE(result.first);
    EXPECT_EQ(result.first->tick, 777);
    EXPECT_EQ(result.first->signal, "mass.engine.speed_rad_s");
    EXPECT_EQ(result.first->recorded, "12.5");
    EXPECT_FALSE(result.first->damaged);
    EXPECT_NEAR(std::stod(result.first->replayed), 180, 30);
}

TEST(Replay, ChangedInputShowsInTheOutputs) {
    TemporaryFile file(".lcmlog");
    record_shift(file.path);
    std::size_t signal = 0;
    {
        RecordingReader reader(file.path);
        signal = static_cast<std::size_t>(index_of(reader.manifest().inputs, "clutch.F3.pressure_command"));
    }
    forge(file.path, Table::inputs, signal, 200, 12.5e5);
    const auto result = replay_file(file.path);
    ASSERT_TRUE(result.first);
    EXPECT_GE(result.first->tick, 200);
    EXPECT_LT(result.first->tick, 500);
}

TEST(Replay, FlippedBitOfAnInputIsNamedEvenIfThePlantWouldNotNotice) {
    TemporaryFile file(".lcmlog");
    record_shift(file.path);
    std::size_t place = 0;
    {
        RecordingReader reader(file.path);
        const auto signal =
            static_cast<std::size_t>(index_of(reader.manifest().inputs, "clutch.F3.pressure_command"));
        place = place_of(file.path, Table::inputs, signal, 300);
    }
    ASSERT_GT(place, 0u);
    std::string bytes = read_file(file.path);
    bytes[place + 7] = static_cast<char>(bytes[place + 7] ^ 1);  // the last bit of the mantissa
    write_file(file.path, bytes);
    const auto result = replay_file(file.path);
    ASSERT_TRUE(result.first);
    EXPECT_EQ(words(result), "tick 300 clutch.F3.pressure_command_pa: 1200000.0000000002 / 1200000");
    EXPECT_TRUE(result.first->damaged);
}

// The rig loses ticks where the log thread falls behind; the replay goes on from the state after the gap.
TEST(Replay, GoesOnBehindAGap) {
    TemporaryFile file(".lcmlog");
    ShiftOptions options;
    options.starve_the_log = true;
    const auto summary = record_shift(file.path, options);
    ASSERT_GT(summary.lost, 0);
    const auto result = replay_file(file.path);
    EXPECT_FALSE(result.first) << words(result);
    EXPECT_FALSE(result.agrees()) << "what was lost proves nothing";
    EXPECT_EQ(result.lost, summary.lost);
    EXPECT_EQ(result.ticks, 1500 - summary.lost);
    // The log thread may fall behind more than once; the first tick after each gap only gives its state.
    std::int64_t gaps = 0;
    RecordingReader reader(file.path);
    for (RecordedTick tick; reader.next(tick);) gaps += tick.lost_before > 0 ? 1 : 0;
    EXPECT_GE(gaps, 1);
    EXPECT_EQ(result.compared, result.ticks - gaps);
}

TEST(Replay, CountsTicksLostBehindTheLastOneKept) {
    TemporaryFile file(".lcmlog");
    ShiftOptions options;
    options.starve_the_log = options.stop_at_a_loss = true;
    const auto summary = record_shift(file.path, options);
    ASSERT_EQ(summary.lost, 1);
    const auto result = replay_file(file.path);
    EXPECT_FALSE(result.first) << words(result);
    EXPECT_EQ(result.compared, result.ticks) << "without a gap in between";
    EXPECT_EQ(result.lost, 1);
    EXPECT_FALSE(result.agrees());
}

TEST(Replay, OfARunStoppedBeforeItsFirstTickAgrees) {
    TemporaryFile file(".lcmlog");
    ShiftOptions options;
    options.ticks = 0;
    record_shift(file.path, options);
    EXPECT_TRUE(replay_file(file.path).agrees());
}

TEST(Replay, AnotherKernelAgreesWithinATolerance) {
    TemporaryFile file(".lcmlog");
    record_shift(file.path);
    RecordingReader reader(file.path);
    Manifest other = reader.manifest();
    other.kernel = "automatic";
    const plant::Model model = rebuild_model(other, true);
    ReplayOptions options;
    options.tolerance = 1e-6;
    const auto result = replay(reader, model, options);
    EXPECT_TRUE(result.agrees()) << words(result);
}

TEST(Replay, OtherParametersGiveATableOfDeviations) {
    TemporaryFile file(".lcmlog");
    record_shift(file.path);
    RecordingReader reader(file.path);
    ModelFile changed = recorded_model_file(reader.manifest());
    changed.description.masses.at(0).inertia *= 1.2;  // the engine's
    const plant::Model model = build_as_recorded(changed, reader.manifest());
    ReplayOptions options;
    options.stop_at_first = false;
    const auto result = replay(reader, model, options);
    EXPECT_EQ(result.compared, 1500);
    const auto engine = static_cast<std::size_t>(index_of(reader.manifest().outputs, "mass.engine.speed"));
    EXPECT_GT(result.deviations.at(engine).worst, 0.1);
    EXPECT_LT(result.deviations.at(engine).worst, 50);
    EXPECT_EQ(result.deviations.at(engine).count, 1500);
}

TEST(Replay, MachineOfAnotherStructureIsRefused) {
    TemporaryFile file(".lcmlog");
    record_shift(file.path);
    RecordingReader reader(file.path);
    const ModelFile other = read_model(SHIFTRIG_SOURCE_DIR "/config/two_mass.yaml");
    const plant::Model model = build_model(other);
    EXPECT_THROW(replay(reader, model), RecordingError);
}

// The plant's own run, written as a real machine's data would be: 100 Hz, bar and rpm. What is left is the sampling.
TEST(FieldReplay, FitsTheMachineThatMadeTheData) {
    TemporaryFile recording(".lcmlog"), field(".csv");
    record_shift(recording.path);
    RecordingReader reader(recording.path);
    const Manifest& m = reader.manifest();
    const auto value = [](const std::vector<plant::Signal>& signals, const std::vector<double>& values,
                          const char* name) {
        return values.at(static_cast<std::size_t>(index_of(signals, name)));
    };
    std::string text =
        "time_s;driver.throttle;environment.draft;clutch.F2.pressure_command_bar;clutch.F3.pressure_command_"
        "bar;"
        "mass.engine.speed_rpm;mass.vehicle.speed_kmh;boost_bar\n";
    for (RecordedTick tick; reader.next(tick);) {
        if (tick.tick >= 190 || (tick.tick + 1) % 10 != 0)
            continue;  // before the shift: no heat, no piston to know
        const double cells[] = {1e-9 * static_cast<double>(tick.sim_time_ns),
                                value(m.inputs, tick.inputs, "driver.throttle"),
                                value(m.inputs, tick.inputs, "environment.draft"),
                                1e-5 * value(m.inputs, tick.inputs, "clutch.F2.pressure_command"),
                                1e-5 * value(m.inputs, tick.inputs, "clutch.F3.pressure_command"),
                                30 / std::acos(-1.0) * value(m.outputs, tick.outputs, "mass.engine.speed"),
                                3.6 * value(m.outputs, tick.outputs, "mass.vehicle.speed"),
                                1.5};
        for (const double& cell : cells) text += std::to_string(cell) + (&cell == &cells[7] ? "\n" : ";");
    }
    write_file(field.path, text);
    ModelFile file = recorded_model_file(m);
    const plant::Model model = build_as_recorded(file, m);
    const FieldFit fit = replay_field(read_field_csv(field.path), model, {"Fc", "F2"});
    ASSERT_EQ(fit.fits.size(), 2u);
    EXPECT_EQ(fit.fits[0].written, "mass.engine.speed_rpm");
    EXPECT_EQ(fit.fits[0].unit, plant::Unit::radian_per_second);
    EXPECT_GT(fit.fits[0].rms, 0);
    EXPECT_LE(fit.fits[0].rms, fit.fits[0].worst);
    // Twists and turbo are not in the data, so the engine starts some rad/s off and comes back.
    EXPECT_LT(fit.fits[0].worst, 10);
    EXPECT_LT(fit.fits[1].worst, 0.2);
    EXPECT_EQ(fit.driven.size(), 4u);
    EXPECT_EQ(fit.ignored, std::vector<std::string>{"boost_bar"});
}

TEST(FieldReplay, WrongDataIsNamedWithItsLine) {
    TemporaryFile field(".csv");
    const auto error = [&](const std::string& text) {
        write_file(field.path, text);
        try {
            read_field_csv(field.path);
        } catch (const InputError& e) {
            return std::string(e.what()).substr(field.path.size());
        }
        return std::string("(no error)");
    };
    EXPECT_EQ(error("t,a\n"), ":1:1: the first column is \"t\"; must be time_s");
    EXPECT_EQ(error("time_s,a\n0,1\n0.1\n"), ":3: 1 values; the header has 2");
    EXPECT_EQ(error("time_s,a\n0,1\n0.1,x\n"), ":3: a = \"x\"; must be a number");
    EXPECT_EQ(error("time_s,a\n0,1\n0,1\n"), ":3:1: time_s = 0; must be later than the row before");
    EXPECT_EQ(error("time_s,a\n0,1\n"), ": has fewer than two rows");
    EXPECT_EQ(error(""), ": is empty");
}

TEST(FieldReplay, AColumnInAnotherUnitIsRefused) {
    TemporaryFile field(".csv");
    const plant::Model model = build_model(read_model(SHIFTRIG_SOURCE_DIR "/config/tractor.yaml"));
    const auto error = [&](const std::string& columns) {
        write_file(field.path, "time_s," + columns + "\n0,1,1\n0.01,1,1\n");
        try {
            replay_field(read_field_csv(field.path), model, {});
        } catch (const InputError& e) {
            return std::string(e.what()).substr(field.path.size());
        }
        return std::string("(no error)");
    };
    const std::string speed = "mass.engine.speed_rpm";
    EXPECT_EQ(error("driver.throttle," + speed), "(no error)");
    EXPECT_EQ(
        error("clutch.F2.pressure_command_rpm," + speed),
        ":1: clutch.F2.pressure_command_rpm must be written with its unit: clutch.F2.pressure_command ends "
        "in _pa or _bar");
    EXPECT_EQ(
        error("clutch.Fc.release_command_kg," + speed),
        ":1: clutch.Fc.release_command_kg must be written with its unit: clutch.Fc.release_command ends in "
        "no suffix or _percent");
    EXPECT_EQ(
        error("driver.throttle,mass.engine.speed_bar"),
        ":1: mass.engine.speed_bar must be written with its unit: mass.engine.speed ends in _rad_s or _rpm");
    EXPECT_EQ(
        error("driver.throttle,mass.engine.speed"),
        ":1: mass.engine.speed must be written with its unit: mass.engine.speed ends in _rad_s or _rpm");
}

TEST(FieldReplay, ARecordingShorterThanHalfAStepFitsNothing) {
    TemporaryFile field(".csv");
    plant::BuildOptions options;
    options.step_size = 0.05;
    const plant::Model model = build_model(read_model(SHIFTRIG_SOURCE_DIR "/config/two_mass.yaml"), options);
    const auto error = [&](const std::string& end) {
        write_file(field.path, "time_s,mass.engine.speed_rad_s\n0,100\n" + end + ",100\n");
        try {
            replay_field(read_field_csv(field.path), model, {});
        } catch (const InputError& e) {
            return std::string(e.what()).substr(field.path.size());
        }
        return std::string("(no error)");
    };
    EXPECT_EQ(error("0.02"), ": lasts 0.02 s, less than half a step of 0.05 s: nothing can be compared");
    EXPECT_EQ(error("0.03"), "(no error)");
}

TEST(FieldReplay, NoTwoColumnsAreOfOneSignal) {
    TemporaryFile field(".csv");
    const plant::Model model = build_model(read_model(SHIFTRIG_SOURCE_DIR "/config/tractor.yaml"));
    const auto error = [&](const std::string& columns) {
        write_file(field.path, "time_s,mass.engine.speed_rpm," + columns + "\n0,1,1,1\n0.01,1,1,1\n");
        try {
            replay_field(read_field_csv(field.path), model, {});
        } catch (const InputError& e) {
            return std::string(e.what()).substr(field.path.size());
        }
        return std::string("(no error)");
    };
    EXPECT_EQ(error("driver.throttle,driver.throttle"),
              ":1: driver.throttle: a column before it is of the same signal");
    EXPECT_EQ(error("driver.throttle,mass.engine.speed_rad_s"),
              ":1: mass.engine.speed_rad_s: a column before it is of the same signal");
    EXPECT_EQ(error("remark,remark"), "(no error)");
}

TEST(FieldReplay, InputsBeyondTheirRangeAreLimitedAndCounted) {
    TemporaryFile field(".csv");
    const plant::Model model = build_model(read_model(SHIFTRIG_SOURCE_DIR "/config/tractor.yaml"));
    const auto fit = [&](const char* rows) {
        write_file(field.path, std::string("time_s,driver.throttle_percent,mass.engine.speed_rpm\n") + rows);
        return replay_field(read_field_csv(field.path), model, {});
    };
    const FieldFit beyond = fit("0,100,900\n0.1,130,950\n0.2,110,950\n0.3,100,950\n");
    ASSERT_EQ(beyond.limited.size(), 1u);
    EXPECT_EQ(beyond.limited[0].written, "driver.throttle_percent");
    EXPECT_EQ(beyond.limited[0].rows, 2u);
    EXPECT_EQ(beyond.limited[0].rule, "must be within 0 and 100");
    const FieldFit within = fit("0,100,900\n0.1,100,950\n0.2,100,950\n0.3,100,950\n");
    EXPECT_TRUE(within.limited.empty());
    EXPECT_EQ(within.fits.at(0).rms, beyond.fits.at(0).rms);
}

TEST(Csv, NumbersReadBackToTheBit) {
    TemporaryFile file(".csv");
    const std::vector<double> values = {0.1, -0.0, 1.0 / 3, 5e-324, 1.7976931348623157e308};
    std::vector<plant::Signal> columns;
    for (int i = 0; i < 5; ++i)
        columns.push_back(signal("clutch.F" + std::to_string(i) + ".pressure", plant::Unit::pascal));
    CsvWriter csv(file.path, columns);
    csv.begin_row(0.001);
    csv.add(values);
    csv.end_row();
    csv.close();
    const std::string text = read_file(file.path);
    EXPECT_TRUE(text.starts_with("time_s,clutch.F0.pressure_pa,"));
    std::size_t at = text.find('\n') + 1;
    EXPECT_EQ(std::stod(text.substr(at)), 0.001);
    for (const double value : values) {
        at = text.find(',', at) + 1;
        const double read = std::strtod(text.c_str() + at, nullptr);
        EXPECT_EQ(std::memcmp(&read, &value, sizeof value), 0) << value;
    }
}

}  // namespace
}  // namespace shiftrig::io
