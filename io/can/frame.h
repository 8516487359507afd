// One CAN frame as every bus of the rig carries it.
#pragma once

#include <array>
#include <cstdint>

#include "plant/realtime.h"

namespace shiftrig::io::can {

struct Frame {
    std::uint32_t id = 0;          // identifier alone: 11 bits, or 29 where `extended`
    bool extended = false;         // 29-bit identifier
    bool fd = false;               // CAN FD: up to 64 bytes
    bool bit_rate_switch = false;  // FD only: data phase at the higher rate
    bool remote = false;           // remote transmission request: a length, no data
    bool error = false;            // a controller's report (SocketCAN error frame), never on the wire
    std::uint8_t length = 0;       // data bytes: 0…8, FD also 12, 16, 20, 24, 32, 48, 64
    std::array<std::uint8_t, 64> data{};
    std::int64_t timestamp_ns = 0;  // when it was on the bus, in the time of the port that received it
    std::int64_t answers_ns =
        0;  // sent: timestamp of the command that this frame is the first to reflect; 0: none

    // The same frame on the wire; when it was there does not matter.
    bool same_as(const Frame& other) const noexcept {
        if (id != other.id || extended != other.extended || fd != other.fd || remote != other.remote ||
            error != other.error || length != other.length || bit_rate_switch != other.bit_rate_switch)
            return false;
        for (std::size_t i = 0; i < length && !remote; ++i)
            if (data[i] != other.data[i]) return false;
        return true;
    }
};

// CAN FD knows only certain lengths: the smallest that holds `bytes` (≤ 64).
constexpr std::uint8_t fd_length(unsigned bytes) noexcept {
    for (const unsigned allowed : {8U, 12U, 16U, 20U, 24U, 32U, 48U})
        if (bytes <= allowed) return static_cast<std::uint8_t>(bytes <= 8 ? bytes : allowed);
    return 64;
}

// Bits on the wire from start of frame to the end of the interframe space, for classic frames counted
// exactly (CRC computed, stuff bits counted): 29-bit frames with 8 bytes take 131…160.
int classic_bits(const Frame& frame) noexcept;
// The most bits a classic frame of this kind can take (a stuff bit after every fourth bit of the stuffed
// part).
int worst_case_classic_bits(bool extended, int data_bytes) noexcept;
// Time on the wire [ns]. FD frames: arbitration at `bit_rate`, data phase at `data_bit_rate` (bit-rate
// switch), worst-case stuffing, so never too short.
std::int64_t duration_ns(const Frame& frame, double bit_rate, double data_bit_rate) SHIFTRIG_REALTIME;

}  // namespace shiftrig::io::can
