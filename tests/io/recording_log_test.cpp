#include <gtest/gtest.h>
#include <lcm/lcm.h>

#include <random>

#include "io/lcm/channels.h"
#include "synthetic_recording.h"

namespace shiftrig::io {
namespace {

using namespace synthetic;

// Reads until the end; how it ended is the reader's to say.
std::vector<RecordedTick> read_all(RecordingReader& reader) {
    std::vector<RecordedTick> ticks;
    RecordedTick tick;
    while (reader.next(tick)) ticks.push_back(tick);
    return ticks;
}

// The one line for a file that cannot be opened, or how the reading ended.
std::string complaint_about(const std::string& path) {
    try {
        RecordingReader reader(path);
        read_all(reader);
        return reader.complaint();
    } catch (const RecordingError& error) {
        return error.what();
    }
}

TEST(Checksums, HaveTheirPublishedValues) {
    const std::string check = "123456789";  // the check value of every CRC catalogue
    EXPECT_EQ(crc32(std::as_bytes(std::span(check))), 0xCBF43926u);
    EXPECT_EQ(
        crc32(std::as_bytes(std::span(check)).subspan(4), crc32(std::as_bytes(std::span(check)).first(4))),
        0xCBF43926u);
    // FIPS 180-4, the examples of one and two blocks.
    EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    EXPECT_EQ(sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
              "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
}

class RoundTrip : public testing::TestWithParam<const char*> {};

TEST_P(RoundTrip, EveryBitOfEveryTickComesBack) {
    TemporaryFile file(GetParam());
    RecordingOptions options;
    options.keyframe_interval = 100;
    Manifest with_clock = manifest();
    with_clock.wall_clock = true;
    const auto summary = write(file.path, 1000, options, with_clock);
    EXPECT_EQ(summary.ticks, 1000);
    EXPECT_EQ(summary.lost, 0);
    EXPECT_EQ(summary.error, "");
    EXPECT_EQ(summary.bytes, static_cast<std::int64_t>(std::filesystem::file_size(file.path)));

    RecordingReader reader(file.path);
    const Manifest& m = reader.manifest();
    EXPECT_EQ(m.model_text, with_clock.model_text);
    EXPECT_EQ(m.scenario_text, with_clock.scenario_text);
    EXPECT_EQ(m.overrides, with_clock.overrides);
    EXPECT_EQ(m.seed, with_clock.seed);
    EXPECT_EQ(m.initial_state, with_clock.initial_state);
    EXPECT_EQ(m.outputs.at(99).name, "mass.m99.speed");
    EXPECT_EQ(m.outputs.at(99).unit, plant::Unit::radian_per_second);

    Tick expected;
    const auto ticks = read_all(reader);
    EXPECT_EQ(reader.ending(), Ending::complete) << reader.complaint();
    ASSERT_EQ(ticks.size(), 1000u);
    for (int n = 0; n < 1000; ++n) {
        const RecordedTick& tick = ticks[static_cast<std::size_t>(n)];
        fill(expected, n);
        ASSERT_EQ(tick.tick, n);
        ASSERT_TRUE(same_bits(tick.inputs, expected.inputs) && same_bits(tick.outputs, expected.outputs) &&
                    same_bits(tick.rig, expected.rig))
            << "tick " << n;
        ASSERT_EQ(tick.events.size(), expected.events.size());
        if (!tick.events.empty()) {
            EXPECT_EQ(tick.events.back().time, expected.events.back().time);
            EXPECT_EQ(tick.events.back().torque, expected.events.back().torque);
            EXPECT_EQ(tick.events.back().device, 1);
            EXPECT_EQ(tick.events.back().value, expected.events.back().value);
            EXPECT_EQ(tick.events.back().members, expected.events.back().members);
        }
        EXPECT_EQ(tick.closing.torque_residual, expected.record.certificate.torque_residual);
        EXPECT_EQ(tick.closing.messages_lost, n / 7);
        ASSERT_TRUE(tick.timing.has_value());
        EXPECT_EQ(tick.timing->lateness_ns, n);
        EXPECT_EQ(!tick.state.empty(), n % 100 == 99);
        if (!tick.state.empty()) {
            EXPECT_EQ(tick.state, expected.state);
        }
    }
}

INSTANTIATE_TEST_SUITE_P(PlainAndCompressed, RoundTrip, testing::Values(".lcmlog", ".lcmlog.zst"));

TEST(Recording, SignalsThatDoNotChangeCostNothing) {
    TemporaryFile file(".lcmlog");
    write(file.path, 50);
    LogSource source(file.path);
    LogEvent event;
    int second_block = 0, first_block = 0;
    while (source.next(event)) {
        record_signals_t signals;
        if (event.channel != channel::record_signals || decode(event.data, signals) != Decoded::whole)
            continue;
        if (signals.table == 1) ++(signals.block == 0 ? first_block : second_block);
    }
    EXPECT_EQ(first_block, 50);
    EXPECT_EQ(second_block, 6);  // ticks 0 to 5
}

TEST(Recording, SameRunGivesTheSameFile) {
    TemporaryFile a(".lcmlog"), b(".lcmlog");
    write(a.path, 300);
    write(b.path, 300);
    EXPECT_TRUE(read_file(a.path) == read_file(b.path));
}

// What a run came to; one of the version before does not say.
TEST(Recording, SaysWhatItsRunCameTo) {
    const auto told = [](const char* outcome) {
        TemporaryFile file(".lcmlog");
        {
            RecordingWriter writer(file.path);
            writer.begin(manifest());
            Tick t;
            fill(t, 0);
            writer.tick(t.record);
            if (outcome) writer.came_to(outcome);
        }
        RecordingReader reader(file.path);
        EXPECT_EQ(read_all(reader).size(), 1u);
        EXPECT_EQ(reader.complaint(), "");
        const std::string line = reader.unfinished();
        return std::pair(reader.outcome(), line.empty() ? line : line.substr(file.path.size()));
    };
    using Told = std::pair<std::string, std::string>;
    EXPECT_EQ(told("completed"), Told("completed", ""));
    EXPECT_EQ(told("stopped"), Told("stopped", ": its run did not come to its end (outcome \"stopped\")"));
    EXPECT_EQ(told(nullptr), Told("", ""));

    std::string older = manifest().to_json();
    older.replace(older.find("\"shiftrig_recording\": 3"), 23, "\"shiftrig_recording\": 2");
    EXPECT_EQ(Manifest::from_json(older).kernel, "portable");
    older.replace(older.find("\"shiftrig_recording\": 2"), 23, "\"shiftrig_recording\": 1");
    try {
        Manifest::from_json(older);
        ADD_FAILURE();
    } catch (const RecordingError& error) {
        EXPECT_STREQ(error.what(), "is a recording of format 1, this program reads formats 2 and 3");
    }
}

TEST(WrongRecording, GoingOnBehindItsOutcome) {
    TemporaryFile file(".lcmlog");
    RecordEncoder encoder(manifest().start_utime);
    std::vector<std::byte> log;
    const auto append = [&](ChunkKind kind, const auto& content) {
        encoder.append_chunks(log, kind, std::as_bytes(std::span(content)), -1, 0);
    };
    append(ChunkKind::manifest, manifest().to_json());
    append(ChunkKind::model, manifest().model_text);
    append(ChunkKind::scenario, manifest().scenario_text);
    append(ChunkKind::state, manifest().initial_state);
    const std::string word = "stopped";
    append(ChunkKind::outcome, word);
    append(ChunkKind::outcome, word);
    write_file(file.path, {reinterpret_cast<const char*>(log.data()), log.size()});
    const std::string said = complaint_about(file.path);
    EXPECT_NE(said.find(": is damaged before the first tick: it goes on behind its outcome"),
              std::string::npos)
        << said;
}

TEST(Recording, LcmsOwnLibraryReadsIt) {
    TemporaryFile file(".lcmlog");
    write(file.path, 20);
    lcm_eventlog_t* log = lcm_eventlog_create(file.path.c_str(), "r");
    ASSERT_NE(log, nullptr);
    std::int64_t number = 0, ticks = 0;
    while (lcm_eventlog_event_t* event = lcm_eventlog_read_next_event(log)) {
        EXPECT_EQ(event->eventnum, number++);
        record_tick_t tick;
        if (std::string(event->channel) == channel::record_tick) {
            EXPECT_EQ(tick.decode(event->data, 0, event->datalen), event->datalen);
            EXPECT_EQ(event->timestamp, manifest().start_utime + 1000 * (ticks + 1));
            EXPECT_EQ(tick.seq, ticks++);
        }
        lcm_eventlog_free_event(event);
    }
    lcm_eventlog_destroy(log);
    EXPECT_EQ(ticks, 20);
}

// Room for a handful of ticks and a log thread that sleeps: what does not fit is marked, and a state
// follows.
TEST(Recording, LostTicksAreMarkedAndFollowedByAState) {
    TemporaryFile file(".lcmlog");
    RecordingOptions options;
    options.queue_bytes = 1;  // the least: 4 ticks
    options.flush_interval = std::chrono::hours(1);
    RecordingWriter writer(file.path, options);
    writer.begin(manifest());
    Tick t;
    std::int64_t kept = 0;
    for (int n = 0; n < 10; ++n) {
        fill(t, n);
        kept += writer.tick(t.record);
    }
    EXPECT_EQ(kept, 4);
    writer.wait_for_room();
    fill(t, 10);
    EXPECT_TRUE(writer.tick(t.record));
    const auto summary = writer.end();
    EXPECT_EQ(summary.ticks, 5);
    EXPECT_EQ(summary.lost, 6);

    RecordingReader reader(file.path);
    const auto ticks = read_all(reader);
    EXPECT_EQ(reader.ending(), Ending::complete) << reader.complaint();
    ASSERT_EQ(ticks.size(), 5u);
    EXPECT_EQ(ticks[4].tick, 10);
    EXPECT_EQ(ticks[4].lost_before, 6);
    EXPECT_EQ(ticks[4].state, t.state);
    EXPECT_TRUE(same_bits(ticks[4].outputs, t.outputs));
}

TEST(Recording, IsBegunOnce) {
    TemporaryFile file(".lcmlog");
    RecordingWriter writer(file.path);
    writer.begin(manifest());
    EXPECT_THROW(writer.begin(manifest()), std::logic_error);
    Tick t;
    fill(t, 0);
    EXPECT_TRUE(writer.tick(t.record));
    EXPECT_EQ(writer.end().ticks, 1);
    EXPECT_THROW(writer.begin(manifest()), std::logic_error);
    RecordingReader reader(file.path);
    EXPECT_EQ(read_all(reader).size(), 1u);
    EXPECT_EQ(reader.ending(), Ending::complete) << reader.complaint();
}

TEST(Recording, FullDiskEndsTheLogButNotTheRun) {
    RecordingWriter writer("/dev/full");
    EXPECT_THROW(
        {
            try {
                writer.begin(manifest());
            } catch (const RecordingError& error) {
                EXPECT_STREQ(error.what(), "/dev/full: cannot be written: No space left on device");
                throw;
            }
        },
        RecordingError);
}

// ---- what is wrong with a file, in one line ------------------------------------------------------------

TEST(WrongRecording, FileThatIsNotThere) {
    EXPECT_EQ(complaint_about("/nowhere/x.lcmlog"),
              "/nowhere/x.lcmlog: cannot be read: No such file or directory");
}

TEST(WrongRecording, Directory) {
    EXPECT_EQ(complaint_about("/"), "/: is a directory, not a recording");
}

TEST(WrongRecording, EmptyFile) {
    TemporaryFile file(".lcmlog");
    write_file(file.path, "");
    EXPECT_EQ(complaint_about(file.path), file.path + ": is empty");
}

TEST(WrongRecording, TextFile) {
    TemporaryFile file(".lcmlog");
    write_file(file.path, "time_s,mass.engine.speed_rad_s\n");
    EXPECT_EQ(complaint_about(file.path),
              file.path + ": is not an LCM event log (it does not begin with ED A1 DA 01)");
}

TEST(WrongRecording, LogOfSomebodyElse) {
    TemporaryFile file(".lcmlog");
    std::vector<std::byte> bytes;
    append_log_event(bytes, 0, 1, "POSE", std::vector<std::byte>(40));
    write_file(file.path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    EXPECT_EQ(complaint_about(file.path),
              file.path + ": is an LCM event log, but no recording of shiftrig (its first channel is POSE)");
}

TEST(WrongRecording, ChunkOfAnotherLayout) {
    TemporaryFile file(".lcmlog");
    std::vector<std::byte> bytes;
    append_log_event(bytes, 0, 1, channel::record_chunk, std::vector<std::byte>(40));
    write_file(file.path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    EXPECT_EQ(complaint_about(file.path),
              file.path + ": was written with another layout of record_chunk_t than this program's");
}

// A loop of F0 and others that the machine does not have; members of a pair that locks.
TEST(WrongRecording, LoopWhoseMembersAreNoDevices) {
    const auto complaint = [](plant::EventKind kind, int device, std::uint64_t members) {
        TemporaryFile file(".lcmlog");
        Tick tick;
        {
            RecordingWriter writer(file.path);
            writer.begin(manifest());
            fill(tick, 0);
            plant::Event event{.kind = kind, .device = static_cast<std::int16_t>(device), .members = members};
            tick.events.assign(1, event);
            tick.record.events = tick.events;
            writer.tick(tick.record);
            writer.end();
        }
        return complaint_about(file.path);
    };
    constexpr auto tie_up = plant::EventKind::tie_up;
    EXPECT_EQ(complaint(tie_up, 0, 7), "");
    EXPECT_EQ(complaint(tie_up, 1, 3 | std::uint64_t{1} << plant::most_members), "");
    for (const std::string& said : {complaint(tie_up, 0, 8), complaint(tie_up, 2, 2),
                                    complaint(tie_up, -1, 1), complaint(plant::EventKind::lock, 0, 1)})
        EXPECT_NE(said.find("an event of a loop with unknown members"), std::string::npos) << said;
}

TEST(WrongRecording, WithoutItsClosingRecord) {
    TemporaryFile file(".lcmlog");
    write(file.path, 5);
    const std::string bytes = read_file(file.path);
    const std::size_t end = event_log_header_size + std::string(channel::record_end).size() +
                            static_cast<std::size_t>(record_end_t().getEncodedSize());
    write_file(file.path, bytes.substr(0, bytes.size() - end));
    EXPECT_EQ(complaint_about(file.path),
              file.path + ": is cut short after tick 4: its closing record is missing");
    write_file(file.path, bytes.substr(0, bytes.size() - 1));
    EXPECT_EQ(complaint_about(file.path), file.path + ": is cut short after tick 4, within a record");
}

TEST(WrongRecording, GoingOnBehindItsClosingRecord) {
    for (const char* ending : {".lcmlog", ".lcmlog.zst"}) {
        TemporaryFile file(ending);
        write(file.path, 5);
        const std::string bytes = read_file(file.path);
        for (const std::string& more : {bytes, std::string("x"), std::string(100, '\0')}) {
            write_file(file.path, bytes + more);
            EXPECT_EQ(complaint_about(file.path),
                      file.path + ": goes on behind its closing record, with what is no part of it");
        }
    }
}

TEST(WrongRecording, CutAnywhereItGivesOneLineAndOnlySoundTicks) {
    TemporaryFile file(".lcmlog"), cut(".lcmlog");
    write(file.path, 8);
    const std::string bytes = read_file(file.path);
    for (std::size_t size = 0; size < bytes.size(); size += 37) {
        write_file(cut.path, bytes.substr(0, size));
        const std::string line = complaint_about(cut.path);
        ASSERT_TRUE(line.starts_with(cut.path + ": ")) << "cut to " << size << ": " << line;
        ASSERT_EQ(line.find('\n'), std::string::npos);
        try {
            RecordingReader reader(cut.path);
            Tick expected;
            std::int64_t n = 0;
            for (const auto& tick : read_all(reader)) {
                fill(expected, n++);
                ASSERT_TRUE(same_bits(tick.outputs, expected.outputs));
            }
            ASSERT_EQ(reader.ending(), Ending::cut_short);
        } catch (const RecordingError&) {  // cut before the first tick
        }
    }
}

// One bit anywhere: the reader says so, and where a signal's value was hit it names the signal and both values.
TEST(WrongRecording, EveryFlippedBitIsFound) {
    TemporaryFile file(".lcmlog"), flipped(".lcmlog");
    Manifest small = manifest();
    small.model_text = "x";
    small.initial_state.resize(100);
    small.outputs.resize(20);
    write(file.path, 3, {}, small);
    const std::string bytes = read_file(file.path);
    std::mt19937 random(1);
    int named = 0;
    for (int trial = 0; trial < 2000; ++trial) {
        const std::size_t bit = random() % (8 * bytes.size());
        std::string wrong = bytes;
        wrong[bit / 8] = static_cast<char>(wrong[bit / 8] ^ (1 << bit % 8));
        write_file(flipped.path, wrong);
        bool found = false;
        try {
            RecordingReader reader(flipped.path);
            for (const auto& tick : read_all(reader))
                for (const auto& damage : tick.damages) {
                    found = true;
                    ++named;
                    EXPECT_NE(std::memcmp(&damage.found, &damage.written, sizeof(double)), 0);
                    EXPECT_LT(damage.signal, 20u);
                }
            found = found || reader.ending() != Ending::complete;
        } catch (const RecordingError&) {
            found = true;
        }
        ASSERT_TRUE(found) << "bit " << bit << " of byte " << bit / 8;
    }
    EXPECT_GT(named, 20);
}

TEST(WrongRecording, FlippedSignalIsNamedWithBothValues) {
    TemporaryFile file(".lcmlog");
    write(file.path, 10);
    std::string bytes = read_file(file.path);
    // The record of table 1, block 0 at tick 6, value 5.
    LogSource source(file.path);
    LogEvent event;
    record_signals_t signals;
    std::size_t value_at = 0;
    while (value_at == 0 && source.next(event))
        if (event.channel == channel::record_signals && decode(event.data, signals) == Decoded::whole &&
            signals.seq == 6 && signals.table == 1 && signals.block == 0)
            value_at = static_cast<std::size_t>(event.offset) + event_log_header_size + event.channel.size() +
                       8 + 24 + 4 + 5 * 8;
    ASSERT_GT(value_at, 0u);
    bytes[value_at] = static_cast<char>(bytes[value_at] ^ 0x80);  // the sign
    write_file(file.path, bytes);
    RecordingReader reader(file.path);
    const auto ticks = read_all(reader);
    ASSERT_EQ(ticks.size(), 10u);
    ASSERT_EQ(ticks[6].damages.size(), 1u);
    const Damage& damage = ticks[6].damages[0];
    EXPECT_EQ(damage.tick, 6);
    EXPECT_EQ(reader.signal(damage.table, damage.signal).name, "mass.m5.speed");
    EXPECT_EQ(damage.written, std::sin(6 + 0.5));
    EXPECT_EQ(damage.found, -std::sin(6 + 0.5));
    EXPECT_EQ(ticks[6].outputs[5], damage.written);  // repaired
}

}  // namespace
}  // namespace shiftrig::io
