#include "io/recording/mcap_file.h"

#include <zstd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <span>

#include "io/recording/checksum.h"
#include "io/recording/manifest.h"
#include "io/recording/output_file.h"

namespace shiftrig::io {

namespace {

constexpr std::string_view magic("\x89MCAP0\r\n", 8);
constexpr std::size_t chunk_size = 1u << 20;

enum Opcode : std::uint8_t {
    header = 0x01,
    footer = 0x02,
    schema = 0x03,
    channel = 0x04,
    message = 0x05,
    chunk = 0x06,
    message_index = 0x07,
    chunk_index = 0x08,
    statistics = 0x0B,
    metadata = 0x0C,
    metadata_index = 0x0D,
    summary_offset = 0x0E,
    data_end = 0x0F,
};

template <class Integer>
void number(std::string& to, Integer value) {
    for (std::size_t i = 0; i < sizeof(Integer); ++i)
        to.push_back(static_cast<char>(static_cast<std::uint64_t>(value) >> (8 * i)));
}

void text(std::string& to, std::string_view value) {
    number(to, static_cast<std::uint32_t>(value.size()));
    to += value;
}

template <class Map>
void string_map(std::string& to, const Map& entries) {
    std::string body;
    for (const auto& [key, value] : entries) {
        text(body, key);
        text(body, value);
    }
    text(to, body);
}

void record(std::string& to, Opcode opcode, std::string_view content) {
    to.push_back(static_cast<char>(opcode));
    number(to, std::uint64_t{content.size()});
    to += content;
}

std::uint32_t crc_of(std::string_view bytes, std::uint32_t start = 0) {
    return crc32(std::as_bytes(std::span(bytes)), start);
}

}  // namespace

McapFile::McapFile(const std::string& path, const std::string& library)
    : path_(path), file_(open_output(path)) {
    if (!file_) throw RecordingError(path + ": cannot be written: " + std::strerror(errno));
    put(magic);
    std::string content, bytes;
    text(content, "");  // no profile
    text(content, library);
    record(bytes, header, content);
    put(bytes);
}

McapFile::~McapFile() {
    if (file_ && file_ != stdout) std::fclose(file_);
}

void McapFile::put(std::string_view bytes) {
    failed_ |= std::fwrite(bytes.data(), 1, bytes.size(), file_) != bytes.size();
    offset_ += bytes.size();
}

std::uint16_t McapFile::add_channel(const std::string& topic, const std::string& schema_name,
                                    const std::string& json_schema) {
    channels_.push_back({topic, schema_name, json_schema, 0, {}});
    return static_cast<std::uint16_t>(channels_.size() - 1);
}

void McapFile::add_metadata(const std::string& name, const std::map<std::string, std::string>& entries) {
    std::string content, bytes, index;
    text(content, name);
    string_map(content, entries);
    record(bytes, metadata, content);
    number(index, offset_);
    number(index, std::uint64_t{bytes.size()});
    text(index, name);
    record(metadata_index_, metadata_index, index);
    ++metadata_count_;
    put(bytes);
}

// Channel n has schema n + 1: schema 0 means "none".
std::string McapFile::schemas_and_channels() const {
    std::string bytes;
    for (std::size_t i = 0; i < channels_.size(); ++i) {
        std::string content;
        number(content, static_cast<std::uint16_t>(i + 1));
        text(content, channels_[i].schema_name);
        text(content, "jsonschema");
        text(content, channels_[i].schema);
        record(bytes, schema, content);
    }
    for (std::size_t i = 0; i < channels_.size(); ++i) {
        std::string content;
        number(content, static_cast<std::uint16_t>(i));
        number(content, static_cast<std::uint16_t>(i + 1));
        text(content, channels_[i].topic);
        text(content, "json");
        text(content, "");
        record(bytes, channel, content);
    }
    return bytes;
}

void McapFile::add_message(std::uint16_t number_of_channel, std::uint32_t sequence, std::uint64_t time_ns,
                           std::string_view json) {
    if (messages_ == 0) {
        chunk_ = schemas_and_channels();
        first_time_ = time_ns;
    }
    Channel& to = channels_[number_of_channel];
    if (std::all_of(channels_.begin(), channels_.end(), [](const Channel& c) { return c.index.empty(); }))
        chunk_start_ = time_ns;
    chunk_end_ = last_time_ = std::max(last_time_, time_ns);
    to.index.emplace_back(time_ns, chunk_.size());
    std::string content;
    number(content, number_of_channel);
    number(content, sequence);
    number(content, time_ns);  // logged
    number(content, time_ns);  // published
    content += json;
    record(chunk_, message, content);
    ++to.messages;
    ++messages_;
    if (chunk_.size() >= chunk_size) end_chunk();
}

void McapFile::end_chunk() {
    if (chunk_.empty()) return;
    std::string compressed(ZSTD_compressBound(chunk_.size()), '\0');
    const std::size_t size =
        ZSTD_compress(compressed.data(), compressed.size(), chunk_.data(), chunk_.size(), 3);
    if (ZSTD_isError(size)) throw RecordingError(path_ + ": zstd: " + ZSTD_getErrorName(size));
    compressed.resize(size);

    std::string content, bytes;
    number(content, chunk_start_);
    number(content, chunk_end_);
    number(content, std::uint64_t{chunk_.size()});
    number(content, crc_of(chunk_));
    text(content, "zstd");
    number(content, std::uint64_t{size});
    content += compressed;
    record(bytes, chunk, content);
    ChunkIndex index{chunk_start_, chunk_end_, offset_, bytes.size(), 0, size, chunk_.size(), {}};
    put(bytes);

    const std::uint64_t indices_start = offset_;
    for (std::size_t i = 0; i < channels_.size(); ++i) {
        if (channels_[i].index.empty()) continue;
        std::string entries, body;
        for (const auto& [time, at] : channels_[i].index) {
            number(entries, time);
            number(entries, at);
        }
        number(body, static_cast<std::uint16_t>(i));
        text(body, entries);
        index.index_offsets[static_cast<std::uint16_t>(i)] = offset_;
        bytes.clear();
        record(bytes, message_index, body);
        put(bytes);
        channels_[i].index.clear();
    }
    index.index_length = offset_ - indices_start;
    chunks_.push_back(std::move(index));
    chunk_.clear();
}

// The summary section; offsets are those of the file with the section beginning at offset_.
std::string McapFile::summary() {
    std::string bytes = schemas_and_channels(), content;
    number(content, messages_);
    number(content, static_cast<std::uint16_t>(channels_.size()));
    number(content, static_cast<std::uint32_t>(channels_.size()));
    number(content, std::uint32_t{0});  // attachments
    number(content, metadata_count_);
    number(content, static_cast<std::uint32_t>(chunks_.size()));
    number(content, first_time_);
    number(content, last_time_);
    std::string counts;
    for (std::size_t i = 0; i < channels_.size(); ++i) {
        if (channels_[i].messages == 0) continue;
        number(counts, static_cast<std::uint16_t>(i));
        number(counts, channels_[i].messages);
    }
    text(content, counts);
    record(bytes, statistics, content);
    bytes += metadata_index_;
    for (const auto& c : chunks_) {
        content.clear();
        number(content, c.start);
        number(content, c.end);
        number(content, c.offset);
        number(content, c.length);
        std::string offsets;
        for (const auto& [of_channel, at] : c.index_offsets) {
            number(offsets, of_channel);
            number(offsets, at);
        }
        text(content, offsets);
        number(content, c.index_length);
        text(content, "zstd");
        number(content, c.compressed);
        number(content, c.uncompressed);
        record(bytes, chunk_index, content);
    }
    return bytes;
}

void McapFile::close() {
    if (!file_) return;
    if (messages_ == 0) chunk_ = schemas_and_channels();
    end_chunk();
    std::string bytes, content;
    number(content, std::uint32_t{0});  // CRC of the data section: chunks carry their own
    record(bytes, data_end, content);
    put(bytes);

    const std::uint64_t summary_start = offset_;
    const std::string section = summary();
    // The footer's CRC covers the summary and the footer up to the CRC itself.
    std::string tail;
    tail.push_back(static_cast<char>(footer));
    number(tail, std::uint64_t{20});
    number(tail, summary_start);
    number(tail, std::uint64_t{0});  // no summary offsets
    number(tail, crc_of(tail, crc_of(section)));
    put(section);
    put(tail);
    put(magic);
    failed_ |= (file_ == stdout ? std::fflush(file_) : std::fclose(file_)) != 0;
    file_ = nullptr;
    if (failed_) throw RecordingError(path_ + ": cannot be written: " + std::strerror(errno));
}

}  // namespace shiftrig::io
