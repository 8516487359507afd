// Encoding and decoding of the records of a recording. Every record type ends in `crc`, the CRC-32 of all
// its encoded bytes before that field.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "io/recording/checksum.h"
#include "io/recording/event_log.h"
#include "shiftrig/record_chunk_t.hpp"
#include "shiftrig/record_end_t.hpp"
#include "shiftrig/record_event_t.hpp"
#include "shiftrig/record_gap_t.hpp"
#include "shiftrig/record_signals_t.hpp"
#include "shiftrig/record_tick_t.hpp"
#include "shiftrig/record_timing_t.hpp"

namespace shiftrig::io {

inline constexpr std::size_t signals_per_block = 64;
inline constexpr std::size_t chunk_data_size = 2048;
inline constexpr std::size_t largest_record = 2304;  // encoded bytes of a record_chunk_t, rounded up

enum class ChunkKind : std::int32_t {
    manifest = 1,
    model = 2,
    scenario = 3,
    state = 4,
    assembly = 5,
    history = 6,
    outcome = 7,
};

inline constexpr std::size_t block_count(std::size_t signals) {
    return (signals + signals_per_block - 1) / signals_per_block;
}

// Writes records one after another into a buffer, numbering the events and stamping them.
class RecordEncoder {
  public:
    // The log time of a record is start + simulated time, so that players keep the pace of the run.
    explicit RecordEncoder(std::int64_t start_utime) : start_utime_(start_utime) {}

    template <class Record>
    void append(std::vector<std::byte>& buffer, const char* channel, Record& record, std::int64_t tick,
                std::int64_t sim_time_ns) {
        record.utime = sim_time_ns / 1000;
        record.sim_time_ns = sim_time_ns;
        record.seq = tick;
        std::array<std::byte, largest_record> bytes;
        const int size = record.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
        const auto body = std::span(bytes).first(static_cast<std::size_t>(size) - 4);
        const std::uint32_t crc = crc32(body);
        for (std::size_t i = 0; i < 4; ++i)
            bytes[body.size() + i] = static_cast<std::byte>(crc >> (24 - 8 * i));
        append_log_event(buffer, number_++, start_utime_ + record.utime, channel,
                         std::span(bytes).first(static_cast<std::size_t>(size)));
    }

    // `content` as record_chunk_t, at least one.
    void append_chunks(std::vector<std::byte>& buffer, ChunkKind kind, std::span<const std::byte> content,
                       std::int64_t tick, std::int64_t sim_time_ns);

  private:
    std::int64_t start_utime_;
    std::int64_t number_ = 0;
};

enum class Decoded { whole, other_layout, damaged };

template <class Record>
Decoded decode(std::span<const std::byte> data, Record& record) {
    const int size = static_cast<int>(data.size());
    if (record.decode(data.data(), 0, size) != size) {
        // A flipped bit in the fingerprint looks like another layout; the CRC tells the two apart no better.
        return Decoded::other_layout;
    }
    return crc32(data.first(data.size() - 4)) == static_cast<std::uint32_t>(record.crc) ? Decoded::whole
                                                                                        : Decoded::damaged;
}

}  // namespace shiftrig::io
