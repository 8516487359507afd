// CRC-32 (IEEE 802.3, as zlib and MCAP use it) for records, SHA-256 (FIPS 180-4) for texts.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace shiftrig::io {

// `start` is the CRC of what came before, so that long data can be summed in pieces.
std::uint32_t crc32(std::span<const std::byte> data, std::uint32_t start = 0) noexcept;

// 64 hexadecimal digits, the same that sha256sum prints.
std::string sha256(std::string_view text);

}  // namespace shiftrig::io
