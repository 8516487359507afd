#include "io/recording/records.h"

#include <algorithm>
#include <cstring>

#include "io/lcm/channels.h"

namespace shiftrig::io {

void RecordEncoder::append_chunks(std::vector<std::byte>& buffer, ChunkKind kind,
                                  std::span<const std::byte> content, std::int64_t tick,
                                  std::int64_t sim_time_ns) {
    const std::size_t count =
        std::max<std::size_t>(1, (content.size() + chunk_data_size - 1) / chunk_data_size);
    for (std::size_t i = 0; i < count; ++i) {
        const auto piece = content.subspan(i * chunk_data_size,
                                           std::min(chunk_data_size, content.size() - i * chunk_data_size));
        record_chunk_t chunk{};
        chunk.kind = static_cast<std::int32_t>(kind);
        chunk.index = static_cast<std::int32_t>(i);
        chunk.count = static_cast<std::int32_t>(count);
        chunk.length = static_cast<std::int32_t>(piece.size());
        std::memcpy(chunk.data, piece.data(), piece.size());
        append(buffer, channel::record_chunk, chunk, tick, sim_time_ns);
    }
}

}  // namespace shiftrig::io
