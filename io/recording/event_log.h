// The frame of an LCM event log, as lcm-logger writes it: before every event 28 bytes, big-endian:
//   uint32 sync 0xEDA1DA01 | int64 number | int64 time [µs] | int32 channel length | int32 data length
// then the channel's name and the data. Written and read here without the LCM library, so that a damaged
// or foreign file costs a message and not a crash.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace shiftrig::io {

inline constexpr std::uint32_t event_log_sync = 0xEDA1DA01;
inline constexpr std::size_t event_log_header_size = 28;
// Longer ones are refused when reading (LCM itself allows 63 bytes of channel name).
inline constexpr std::uint32_t event_log_channel_limit = 255;
inline constexpr std::uint32_t event_log_data_limit = 16u << 20;

void append_log_event(std::vector<std::byte>& buffer, std::int64_t number, std::int64_t time_us,
                      std::string_view channel, std::span<const std::byte> data);

struct LogEvent {
    std::int64_t number = 0;
    std::int64_t time_us = 0;
    std::string_view channel;  // valid until the next read
    std::span<const std::byte> data;
    std::int64_t offset = 0;  // of the event in the (uncompressed) log [bytes]
};

// A file to append to; a name ending in .zst compresses. No exceptions after the constructor.
class LogSink {
  public:
    explicit LogSink(const std::string& path);  // throws RecordingError
    ~LogSink();
    LogSink(const LogSink&) = delete;
    LogSink& operator=(const LogSink&) = delete;
    // Hands the bytes to the kernel: whoever reads the file afterwards finds them, even if this process is
    // killed. False: failed, error() says why; later calls do nothing.
    bool write(std::span<const std::byte> bytes);
    bool close();  // ends the compressed frame
    const std::string& error() const noexcept { return error_; }
    std::int64_t bytes() const noexcept { return bytes_; }  // in the file

  private:
    bool compress(std::span<const std::byte> bytes, bool last);
    bool put(const std::byte* data, std::size_t size);
    std::string path_, error_;
    int file_ = -1;
    std::int64_t bytes_ = 0;
    struct Compressor;
    std::unique_ptr<Compressor> compressor_;
};

// Reads event after event. Anything that is not a whole event ends the reading with an error that names
// the byte; a clean end has none.
class LogSource {
  public:
    explicit LogSource(const std::string& path);  // throws RecordingError: cannot be opened, empty, not a log
    ~LogSource();
    LogSource(const LogSource&) = delete;
    LogSource& operator=(const LogSource&) = delete;
    // False at the end: error() is empty if the file ends after a whole event.
    bool next(LogEvent& event);
    const std::string& error() const noexcept { return error_; }
    // The error is that the file stops within an event (and is whole up to there).
    bool cut_short() const noexcept { return cut_short_; }

  private:
    std::size_t get(std::byte* data, std::size_t size);  // fewer only at the end
    bool fail(const std::string& what);
    std::string path_, error_;
    std::FILE* file_ = nullptr;
    std::int64_t offset_ = 0;
    bool cut_short_ = false;
    std::vector<std::byte> buffer_;
    struct Decompressor;
    std::unique_ptr<Decompressor> decompressor_;
};

}  // namespace shiftrig::io
