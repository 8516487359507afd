// The bytes of an MCAP file: records of one opcode byte, a 64-bit length and the content, little-endian,
// strings with a 32-bit length before them [MCAP]. Only what a recording needs.
#pragma once

#include <cstdint>
#include <cstdio>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace shiftrig::io {

class McapFile {
  public:
    // "-" is standard output. Throws RecordingError.
    McapFile(const std::string& path, const std::string& library);
    ~McapFile();
    McapFile(const McapFile&) = delete;
    McapFile& operator=(const McapFile&) = delete;

    // Returns the channel's number. `schema` is a JSON Schema. Before the first message.
    std::uint16_t add_channel(const std::string& topic, const std::string& schema_name,
                              const std::string& schema);
    void add_metadata(const std::string& name, const std::map<std::string, std::string>& entries);
    void add_message(std::uint16_t channel, std::uint32_t sequence, std::uint64_t time_ns,
                     std::string_view json);
    void close();  // summary, index and footer; throws RecordingError if anything could not be written

  private:
    struct Channel {
        std::string topic, schema_name, schema;
        std::uint64_t messages = 0;
        std::vector<std::pair<std::uint64_t, std::uint64_t>> index;  // of the open chunk: time, offset
    };
    struct ChunkIndex {
        std::uint64_t start, end, offset, length, index_length, compressed, uncompressed;
        std::map<std::uint16_t, std::uint64_t> index_offsets;
    };
    void put(std::string_view bytes);
    void end_chunk();
    std::string schemas_and_channels() const;
    std::string summary();

    std::string path_;
    std::FILE* file_ = nullptr;
    std::uint64_t offset_ = 0;
    bool failed_ = false;
    std::vector<Channel> channels_;
    std::vector<ChunkIndex> chunks_;
    std::string metadata_index_;
    std::uint32_t metadata_count_ = 0;
    std::string chunk_;  // open, not yet compressed
    std::uint64_t chunk_start_ = 0, chunk_end_ = 0, first_time_ = 0, last_time_ = 0, messages_ = 0;
};

}  // namespace shiftrig::io
