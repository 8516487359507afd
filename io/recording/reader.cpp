#include "io/recording/reader.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <utility>

#include "io/lcm/channels.h"

namespace shiftrig::io {

namespace {

// The bit by which `data` differs from what its closing CRC was made of; −1 if no single bit explains it.
// CRC-32 tells all single-bit errors of a record of our size apart.
long flipped_bit(std::vector<std::byte> data) {
    const auto body = std::span(data).first(data.size() - 4);
    std::uint32_t expected = 0;
    for (std::size_t i = 0; i < 4; ++i)
        expected = expected << 8 | static_cast<std::uint32_t>(data[body.size() + i]);
    for (std::size_t bit = 0; bit < 8 * body.size(); ++bit) {
        const std::byte mask{static_cast<unsigned char>(1u << bit % 8)};
        body[bit / 8] ^= mask;
        if (crc32(body) == expected) return static_cast<long>(bit);
        body[bit / 8] ^= mask;
    }
    return -1;
}

// A name from the file, fit for a message.
std::string printable(std::string_view name) {
    std::string text(name.substr(0, 60));
    for (char& c : text)
        if (c < ' ' || c > '~') c = '?';
    return text;
}

// Everything that belongs to one chunked content.
struct Collected {
    std::vector<std::byte> bytes;
    std::int32_t pieces = 0, expected = 0;
    bool whole() const { return expected > 0 && pieces == expected; }
    // False: this piece does not follow the ones before.
    bool add(const record_chunk_t& chunk) {
        constexpr std::int32_t most_pieces = 1 << 16;  // 128 MiB
        if (chunk.index == 0) *this = {{}, 0, chunk.count};
        if (chunk.index != pieces || chunk.count != expected || chunk.count > most_pieces ||
            chunk.length < 0 || static_cast<std::size_t>(chunk.length) > chunk_data_size)
            return false;
        const auto* data = reinterpret_cast<const std::byte*>(chunk.data);
        bytes.insert(bytes.end(), data, data + chunk.length);
        ++pieces;
        return true;
    }
    std::string text() const { return {reinterpret_cast<const char*>(bytes.data()), bytes.size()}; }
};

}  // namespace

struct RecordingReader::Implementation {
    explicit Implementation(const std::string& name) : path(name), source(name) {}

    std::string path;
    LogSource source;
    Manifest manifest;
    LogEvent event;
    std::int64_t number = 0;  // of the next event
    std::int64_t previous_tick = -1;
    std::int64_t ticks = 0, lost = 0;  // so far
    std::int64_t lost_at_end = 0;
    std::string outcome;
    std::vector<double> known[3];  // the tables as of the tick being read, in whole blocks
    Ending ending = Ending::cut_short;
    std::string complaint;
    bool ended = false;

    std::string where() const {
        return previous_tick < manifest.first_tick ? " before the first tick"
                                                   : " after tick " + std::to_string(previous_tick);
    }
    bool stop(Ending how, const std::string& what) {
        ended = true;
        ending = how;
        complaint = how == Ending::complete ? "" : path + ": " + what;
        return false;
    }
    bool damaged(const std::string& what) {
        return stop(Ending::damaged,
                    "is damaged" + where() + ": " + what + " (byte " + std::to_string(event.offset) + ")");
    }

    void read_header();
    bool next_event();
    template <class Record>
    bool decode_record(const char* type, Record& record);
    bool take_outcome(const record_chunk_t& chunk);
    bool take_signals(RecordedTick& tick);
    bool take_closing(RecordedTick& tick, std::int32_t blocks);
    bool next(RecordedTick& tick);
};

RecordingReader::RecordingReader(const std::string& path)
    : implementation_(std::make_unique<Implementation>(path)) {
    implementation_->read_header();
}
RecordingReader::~RecordingReader() = default;
RecordingReader::RecordingReader(RecordingReader&&) noexcept = default;
const Manifest& RecordingReader::manifest() const noexcept {
    return implementation_->manifest;
}
const std::string& RecordingReader::path() const noexcept {
    return implementation_->path;
}
Ending RecordingReader::ending() const noexcept {
    return implementation_->ending;
}
const std::string& RecordingReader::complaint() const noexcept {
    return implementation_->complaint;
}
bool RecordingReader::next(RecordedTick& tick) {
    return !implementation_->ended && implementation_->next(tick);
}

const std::string& RecordingReader::outcome() const noexcept {
    return implementation_->outcome;
}
std::string RecordingReader::unfinished() const {
    const std::string& outcome = implementation_->outcome;
    if (outcome.empty() || outcome == "completed") return "";
    return path() + ": its run did not come to its end (outcome \"" + outcome + "\")";
}

std::int64_t RecordingReader::lost_at_end() const noexcept {
    return implementation_->lost_at_end;
}

const plant::Signal& RecordingReader::signal(Table table, std::size_t index) const {
    const Manifest& m = implementation_->manifest;
    const auto& signals = table == Table::inputs ? m.inputs : table == Table::outputs ? m.outputs : m.rig;
    return signals.at(index);
}

// ---- before the first tick ------------------------------------------------------------------------------

void RecordingReader::Implementation::read_header() {
    Collected collected[6];  // by kind: manifest, model, scenario, state, assembly, history
    std::vector<std::int64_t> opening_times;
    while (!collected[3].whole()) {
        if (!source.next(event)) {
            if (!source.error().empty()) throw RecordingError(source.error());
            throw RecordingError(path + ": is cut short before its first tick");
        }
        if (event.channel != channel::record_chunk) {
            if (number == 0)
                throw RecordingError(
                    path + ": is an LCM event log, but no recording of shiftrig (its first channel is " +
                    printable(event.channel) + ")");
            damaged("channel " + printable(event.channel) + " among the opening records");
            throw RecordingError(complaint);
        }
        record_chunk_t chunk;
        const Decoded decoded = decode(event.data, chunk);
        if (decoded == Decoded::other_layout)
            throw RecordingError(path +
                                 ": was written with another layout of record_chunk_t than this program's");
        const bool sound =
            decoded == Decoded::whole && event.number == number && chunk.kind >= 1 && chunk.kind <= 6;
        if (!sound || !collected[chunk.kind - 1].add(chunk)) {
            damaged("an opening record");
            throw RecordingError(complaint);
        }
        if (chunk.utime < 0 || event.time_us < 0) {
            damaged("the time of an opening record");
            throw RecordingError(complaint);
        }
        opening_times.push_back(event.time_us - chunk.utime);
        ++number;
    }
    try {
        manifest = Manifest::from_json(collected[0].text());
    } catch (const RecordingError& error) {
        throw RecordingError(path + ": " + error.what());
    }
    for (const auto time : opening_times)
        if (time != manifest.start_utime) {
            damaged("the time of an opening record");
            throw RecordingError(complaint);
        }
    manifest.model_text = collected[1].text();
    manifest.scenario_text = collected[2].text();
    manifest.initial_state = collected[3].bytes;
    manifest.assembly = collected[4].bytes;
    manifest.history = collected[5].bytes;
    previous_tick = manifest.first_tick - 1;
    const std::size_t sizes[3] = {manifest.inputs.size(), manifest.outputs.size(), manifest.rig.size()};
    for (int t = 0; t < 3; ++t) known[t].assign(block_count(sizes[t]) * signals_per_block, 0.0);
}

// ---- tick by tick ---------------------------------------------------------------------------------------

bool RecordingReader::Implementation::next_event() {
    if (!source.next(event)) {
        if (source.error().empty())
            return stop(Ending::cut_short, "is cut short" + where() + ": its closing record is missing");
        if (source.cut_short())
            return stop(Ending::cut_short, "is cut short" + where() + ", within a record");
        return stop(Ending::damaged, source.error().substr(path.size() + 2) + "," + where());
    }
    if (event.number != number)
        return damaged("event " + std::to_string(event.number) + " follows event " +
                       std::to_string(number - 1));
    ++number;
    return true;
}

template <class Record>
bool RecordingReader::Implementation::decode_record(const char* type, Record& record) {
    switch (decode(event.data, record)) {
        case Decoded::other_layout:
            return damaged(std::string("not a ") + type + " of this program's layout");
        case Decoded::damaged:
            return damaged(std::string(type) + " fails its checksum");
        case Decoded::whole:
            break;
    }
    if (event.time_us != manifest.start_utime + record.sim_time_ns / 1000 ||
        record.utime != record.sim_time_ns / 1000)
        return damaged(std::string("the time of a ") + type);
    return true;
}

// A word, in one piece.
bool RecordingReader::Implementation::take_outcome(const record_chunk_t& chunk) {
    Collected word;
    if (chunk.count != 1 || chunk.length < 1 || !word.add(chunk)) return damaged("its outcome");
    outcome = printable(word.text());
    return true;
}

bool RecordingReader::Implementation::take_signals(RecordedTick& tick) {
    record_signals_t signals, found;
    std::vector<std::byte> data(event.data.begin(), event.data.end());
    bool repaired = false;
    if (decode(event.data, found) == Decoded::damaged) {
        if (const long bit = flipped_bit(data); bit >= 0) {
            data[static_cast<std::size_t>(bit) / 8] ^= std::byte{static_cast<unsigned char>(1u << bit % 8)};
            repaired = true;
        }
    }
    event.data = data;
    if (!decode_record("record_signals_t", signals)) return false;
    if (signals.table < 0 || signals.table > 2 || signals.block < 0 ||
        static_cast<std::size_t>(signals.block) * signals_per_block >= known[signals.table].size())
        return damaged("signals of a table or block that the manifest does not have");
    const std::size_t first = static_cast<std::size_t>(signals.block) * signals_per_block;
    std::memcpy(known[signals.table].data() + first, signals.value, sizeof signals.value);
    if (!repaired) return true;
    for (std::size_t i = 0; i < signals_per_block; ++i)
        if (std::memcmp(&found.value[i], &signals.value[i], sizeof(double)) != 0) {
            const auto table = static_cast<Table>(signals.table);
            const std::size_t sizes[3] = {manifest.inputs.size(), manifest.outputs.size(),
                                          manifest.rig.size()};
            if (first + i >= sizes[signals.table]) break;  // in the padding behind the last signal
            tick.damages.push_back({signals.seq, table, first + i, found.value[i], signals.value[i]});
            return true;
        }
    return damaged("record_signals_t fails its checksum");
}

bool RecordingReader::Implementation::next(RecordedTick& tick) {
    tick.events.clear();
    tick.timing.reset();
    tick.state.clear();
    tick.damages.clear();
    tick.lost_before = 0;
    std::int32_t blocks = 0;
    Collected state;
    std::int64_t seq = 0;
    bool first = true;
    // All records of a tick carry its number.
    const auto belongs = [&](const auto& record) {
        const bool same = first || record.seq == seq;
        seq = record.seq;
        first = false;
        return same || damaged("records of two ticks are mixed");
    };
    while (next_event()) {
        if (!outcome.empty() && event.channel != channel::record_end)
            return damaged("it goes on behind its outcome");
        if (event.channel == channel::record_signals) {
            if (!take_signals(tick)) return false;
            ++blocks;
        } else if (event.channel == channel::record_event) {
            record_event_t e;
            if (!decode_record("record_event_t", e) || !belongs(e)) return false;
            plant::Event happened;
            happened.time = e.time_s;
            happened.kind = static_cast<plant::EventKind>(e.kind);
            happened.device = static_cast<std::int16_t>(e.device);
            happened.torque = e.torque_nm;
            happened.capacity = e.capacity_nm;
            happened.slip = e.slip_rad_s;
            happened.value = e.value;
            happened.members = std::bit_cast<std::uint64_t>(e.members);
            if (e.device < -1 || e.device >= static_cast<std::int64_t>(manifest.devices.size()) ||
                e.kind < 0 || e.kind > static_cast<std::int32_t>(plant::last_event_kind))
                return damaged("an event of an unknown device or kind");
            const std::uint64_t named = happened.members & ~(std::uint64_t{1} << plant::most_members);
            if (happened.members != 0 &&
                (happened.kind != plant::EventKind::tie_up || e.device < 0 ||
                 static_cast<std::size_t>(e.device) + std::bit_width(named) > manifest.devices.size()))
                return damaged("an event of a loop with unknown members");
            tick.events.push_back(happened);
        } else if (event.channel == channel::record_timing) {
            record_timing_t timing;
            if (!decode_record("record_timing_t", timing) || !belongs(timing)) return false;
            tick.timing = timing;
        } else if (event.channel == channel::record_gap) {
            record_gap_t gap;
            if (!decode_record("record_gap_t", gap) || !belongs(gap)) return false;
            tick.lost_before = gap.lost;
        } else if (event.channel == channel::record_chunk) {
            record_chunk_t chunk;
            if (!decode_record("record_chunk_t", chunk)) return false;
            if (chunk.kind == static_cast<std::int32_t>(ChunkKind::outcome)) {
                if (!first || blocks > 0) return damaged("a tick without its closing record");
                if (!take_outcome(chunk)) return false;
                continue;
            }
            if (!belongs(chunk)) return false;
            if (chunk.kind != static_cast<std::int32_t>(ChunkKind::state) || !state.add(chunk))
                return damaged("a state out of order");
        } else if (event.channel == channel::record_tick) {
            if (!decode_record("record_tick_t", tick.closing) || !belongs(tick.closing)) return false;
            if (state.expected > 0) {
                if (!state.whole() || state.bytes.size() != manifest.initial_state.size())
                    return damaged("a state of another size");
                tick.state = std::move(state.bytes);
            }
            return take_closing(tick, blocks);
        } else if (event.channel == channel::record_end) {
            record_end_t end;
            if (!decode_record("record_end_t", end)) return false;
            if (!first || blocks > 0) return damaged("a tick without its closing record");
            if (end.ticks != ticks || end.lost < lost)
                return damaged("its closing record counts " + std::to_string(end.ticks) + " ticks and " +
                               std::to_string(end.lost) + " lost");
            lost_at_end = end.lost - lost;
            const bool more = source.next(event);
            if (more || !source.error().empty())
                return stop(Ending::damaged, "goes on behind its closing record, with what is no part of it");
            return stop(Ending::complete, "");
        } else {
            return damaged("unknown channel " + printable(event.channel));
        }
    }
    return false;
}

bool RecordingReader::Implementation::take_closing(RecordedTick& tick, std::int32_t blocks) {
    const record_tick_t& closing = tick.closing;
    if (closing.blocks != blocks || closing.events != static_cast<std::int32_t>(tick.events.size()) ||
        closing.seq <= previous_tick || closing.seq - previous_tick - 1 != tick.lost_before)
        return damaged("tick " + std::to_string(closing.seq) + " is not whole");
    tick.tick = closing.seq;
    tick.sim_time_ns = closing.sim_time_ns;
    tick.inputs.assign(known[0].begin(),
                       known[0].begin() + static_cast<std::ptrdiff_t>(manifest.inputs.size()));
    tick.outputs.assign(known[1].begin(),
                        known[1].begin() + static_cast<std::ptrdiff_t>(manifest.outputs.size()));
    tick.rig.assign(known[2].begin(), known[2].begin() + static_cast<std::ptrdiff_t>(manifest.rig.size()));
    previous_tick = closing.seq;
    ++ticks;
    lost += tick.lost_before;
    return true;
}

bool looks_like_recording(const std::string& path) {
    try {
        LogSource source(path);
        return true;
    } catch (const RecordingError&) {
        return false;
    }
}

}  // namespace shiftrig::io
