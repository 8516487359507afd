#include "io/can/frame.h"

#include <cmath>

namespace shiftrig::io::can {

namespace {

constexpr int kTrailer =
    1 + 1 + 1 + 7 + 3;  // CRC delimiter, ACK slot and delimiter, end of frame, interframe space

// Sends the stuffed part of a frame bit by bit: counts the bits with their stuff bits, computes the CRC-15.
class BitCounter {
  public:
    void put(unsigned bit) noexcept {
        const unsigned top = (crc_ >> 14) & 1U;
        crc_ = (crc_ << 1) & 0x7FFFU;
        if (bit != top) crc_ ^= 0x4599U;
        stuffed(bit);
    }
    void put(std::uint32_t value, int bits) noexcept {
        for (int i = bits - 1; i >= 0; --i) put((value >> i) & 1U);
    }
    void finish() noexcept {
        const unsigned crc = crc_;
        for (int i = 14; i >= 0; --i) stuffed((crc >> i) & 1U);
    }
    int bits() const noexcept { return bits_; }

  private:
    // After five equal bits the opposite one is inserted, and counts as the first of the next run.
    void stuffed(unsigned bit) noexcept {
        ++bits_;
        run_ = (bit == last_) ? run_ + 1 : 1;
        last_ = bit;
        if (run_ == 5) {
            ++bits_;
            last_ = 1U - bit;
            run_ = 1;
        }
    }
    unsigned crc_ = 0, last_ = 2;
    int run_ = 0, bits_ = 0;
};

}  // namespace

int classic_bits(const Frame& frame) noexcept {
    BitCounter wire;
    wire.put(0);  // start of frame
    const unsigned rtr = frame.remote ? 1 : 0;
    if (frame.extended) {
        wire.put(frame.id >> 18, 11);
        wire.put(1);  // substitute remote request
        wire.put(1);  // identifier extension
        wire.put(frame.id & 0x3FFFF, 18);
        wire.put(rtr);
        wire.put(0, 2);  // reserved
    } else {
        wire.put(frame.id, 11);
        wire.put(rtr);
        wire.put(0);  // identifier extension
        wire.put(0);  // reserved
    }
    const unsigned length = frame.length > 8 ? 8 : frame.length;
    wire.put(length, 4);
    for (unsigned i = 0; i < length && !frame.remote; ++i) wire.put(frame.data[i], 8);
    wire.finish();
    return wire.bits() + kTrailer;
}

int worst_case_classic_bits(bool extended, int data_bytes) noexcept {
    // Start of frame to CRC is stuffed; the first stuff bit needs five bits, each further one four.
    const int stuffed = (extended ? 39 : 19) + 8 * data_bytes + 15;
    return stuffed + (stuffed - 1) / 4 + kTrailer;
}

std::int64_t duration_ns(const Frame& frame, double bit_rate, double data_bit_rate) SHIFTRIG_REALTIME {
    if (!frame.fd) return std::llround(classic_bits(frame) * 1e9 / bit_rate);
    // ISO 11898-1: SOF, identifier and control bits up to BRS; then ESI, DLC, data, stuff count (4), CRC (17
    // or 21, with a fixed stuff bit before every fourth).
    const double header = frame.extended ? 36 : 17;
    const double checked = 1 + 4 + 8.0 * frame.length;
    const double crc = frame.length > 16 ? 4 + 21 + 7 : 4 + 17 + 6;
    const double slow = header + std::floor((header - 1) / 4) + kTrailer;
    const double fast = checked + std::ceil(checked / 4) + crc;
    return std::llround(1e9 * (slow / bit_rate + fast / (frame.bit_rate_switch ? data_bit_rate : bit_rate)));
}

}  // namespace shiftrig::io::can
