#include "io/recording/event_log.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zstd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "io/recording/manifest.h"

namespace shiftrig::io {

namespace {

template <class Integer>
void put_big_endian(std::byte* at, Integer value) {
    for (std::size_t i = 0; i < sizeof(Integer); ++i)
        at[i] = static_cast<std::byte>(value >> (8 * (sizeof(Integer) - 1 - i)));
}

template <class Integer>
Integer get_big_endian(const std::byte* at) {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < sizeof(Integer); ++i) value = value << 8 | static_cast<std::uint64_t>(at[i]);
    return static_cast<Integer>(value);
}

bool ends_with_zst(const std::string& path) {
    return path.ends_with(".zst");
}

constexpr std::array<std::byte, 4> zstd_magic = {std::byte{0x28}, std::byte{0xB5}, std::byte{0x2F},
                                                 std::byte{0xFD}};

}  // namespace

void append_log_event(std::vector<std::byte>& buffer, std::int64_t number, std::int64_t time_us,
                      std::string_view channel, std::span<const std::byte> data) {
    const std::size_t start = buffer.size();
    buffer.resize(start + event_log_header_size + channel.size() + data.size());
    std::byte* at = buffer.data() + start;
    put_big_endian(at, event_log_sync);
    put_big_endian(at + 4, number);
    put_big_endian(at + 12, time_us);
    put_big_endian(at + 20, static_cast<std::uint32_t>(channel.size()));
    put_big_endian(at + 24, static_cast<std::uint32_t>(data.size()));
    std::memcpy(at + event_log_header_size, channel.data(), channel.size());
    std::memcpy(at + event_log_header_size + channel.size(), data.data(), data.size());
}

// ---- writing ------------------------------------------------------------------------------------------

struct LogSink::Compressor {
    ZSTD_CStream* stream = ZSTD_createCStream();
    std::vector<std::byte> out = std::vector<std::byte>(ZSTD_CStreamOutSize());
    ~Compressor() { ZSTD_freeCStream(stream); }
};

LogSink::LogSink(const std::string& path) : path_(path) {
    file_ = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    if (file_ < 0) throw RecordingError(path + ": cannot be written: " + std::strerror(errno));
    if (ends_with_zst(path)) compressor_ = std::make_unique<Compressor>();
}

LogSink::~LogSink() {
    close();
}

bool LogSink::write(std::span<const std::byte> bytes) {
    if (file_ < 0 || !error_.empty()) return false;
    return compressor_ ? compress(bytes, false) : put(bytes.data(), bytes.size());
}

bool LogSink::close() {
    if (file_ < 0) return error_.empty();
    if (compressor_ && error_.empty()) compress({}, true);
    if (::close(file_) != 0 && error_.empty()) error_ = path_ + ": " + std::strerror(errno);
    file_ = -1;
    return error_.empty();
}

// Every write ends in a flush of the compressor: what has been handed over can be unpacked.
bool LogSink::compress(std::span<const std::byte> bytes, bool last) {
    ZSTD_inBuffer in{bytes.data(), bytes.size(), 0};
    for (std::size_t left = 1; left != 0;) {
        ZSTD_outBuffer out{compressor_->out.data(), compressor_->out.size(), 0};
        left = ZSTD_compressStream2(compressor_->stream, &out, &in, last ? ZSTD_e_end : ZSTD_e_flush);
        if (ZSTD_isError(left)) {
            error_ = path_ + ": zstd: " + ZSTD_getErrorName(left);
            return false;
        }
        if (!put(compressor_->out.data(), out.pos)) return false;
    }
    return true;
}

bool LogSink::put(const std::byte* data, std::size_t size) {
    while (size > 0) {
        const ssize_t written = ::write(file_, data, size);
        if (written < 0) {
            if (errno == EINTR) continue;
            error_ = path_ + ": cannot be written: " + std::strerror(errno);
            return false;
        }
        data += written;
        size -= static_cast<std::size_t>(written);
        bytes_ += written;
    }
    return true;
}

// ---- reading ------------------------------------------------------------------------------------------

struct LogSource::Decompressor {
    ZSTD_DStream* stream = ZSTD_createDStream();
    std::vector<std::byte> in_bytes = std::vector<std::byte>(ZSTD_DStreamInSize());
    ZSTD_inBuffer in{in_bytes.data(), 0, 0};
    ~Decompressor() { ZSTD_freeDStream(stream); }
};

LogSource::LogSource(const std::string& path) : path_(path) {
    file_ = std::fopen(path.c_str(), "rbe");
    if (!file_) throw RecordingError(path + ": cannot be read: " + std::strerror(errno));
    std::array<std::byte, 4> magic{};
    struct stat info {};
    const bool directory = ::fstat(::fileno(file_), &info) == 0 && S_ISDIR(info.st_mode);
    const std::size_t size = directory ? 0 : std::fread(magic.data(), 1, magic.size(), file_);
    std::string what;
    if (directory)
        what = "is a directory, not a recording";
    else if (size == 0)
        what = "is empty";
    else if (size == 4 && magic == zstd_magic)
        decompressor_ = std::make_unique<Decompressor>();
    else if (size < 4 || get_big_endian<std::uint32_t>(magic.data()) != event_log_sync)
        what = "is not an LCM event log (it does not begin with ED A1 DA 01)";
    if (!what.empty()) {
        std::fclose(file_);
        file_ = nullptr;
        throw RecordingError(path + ": " + what);
    }
    std::rewind(file_);
}

LogSource::~LogSource() {
    if (file_) std::fclose(file_);
}

std::size_t LogSource::get(std::byte* data, std::size_t size) {
    if (!decompressor_) return std::fread(data, 1, size, file_);
    ZSTD_outBuffer out{data, size, 0};
    while (out.pos < size) {
        auto& in = decompressor_->in;
        if (in.pos == in.size) {
            in.size = std::fread(decompressor_->in_bytes.data(), 1, decompressor_->in_bytes.size(), file_);
            in.pos = 0;
        }
        const std::size_t before = out.pos;
        const bool input_ended = in.size == 0;
        const std::size_t left = ZSTD_decompressStream(decompressor_->stream, &out, &in);
        if (ZSTD_isError(left)) {
            fail(std::string("zstd: ") + ZSTD_getErrorName(left));
            break;
        }
        if (input_ended && out.pos == before) break;
    }
    return out.pos;
}

bool LogSource::fail(const std::string& what) {
    if (error_.empty()) error_ = path_ + ": " + what;
    return false;
}

bool LogSource::next(LogEvent& event) {
    if (!error_.empty()) return false;
    const auto at_byte = [&] { return " at byte " + std::to_string(offset_); };
    std::array<std::byte, event_log_header_size> header;
    const std::size_t got = get(header.data(), header.size());
    if (got == 0 || !error_.empty()) return false;
    if (got < header.size()) {
        cut_short_ = true;
        return fail("is cut short within an event" + at_byte());
    }
    if (get_big_endian<std::uint32_t>(header.data()) != event_log_sync)
        return fail("is damaged: no event begins" + at_byte());
    const auto channel_size = get_big_endian<std::uint32_t>(header.data() + 20);
    const auto data_size = get_big_endian<std::uint32_t>(header.data() + 24);
    if (channel_size > event_log_channel_limit || data_size > event_log_data_limit)
        return fail("is damaged: an event of impossible length" + at_byte());
    buffer_.resize(channel_size + data_size);
    if (get(buffer_.data(), buffer_.size()) < buffer_.size()) {
        cut_short_ = error_.empty();
        return fail("is cut short within an event" + at_byte());
    }
    event.number = get_big_endian<std::int64_t>(header.data() + 4);
    event.time_us = get_big_endian<std::int64_t>(header.data() + 12);
    event.channel = {reinterpret_cast<const char*>(buffer_.data()), channel_size};
    event.data = {buffer_.data() + channel_size, data_size};
    event.offset = offset_;
    offset_ += static_cast<std::int64_t>(header.size() + buffer_.size());
    return true;
}

}  // namespace shiftrig::io
