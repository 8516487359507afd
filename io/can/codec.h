// One DBC signal as a flat descriptor: where its bits are and what they mean. Reading or writing it is
// shifts and masks over at most nine bytes.
#pragma once

#include <cstdint>

#include "io/can/dbc.h"
#include "plant/realtime.h"

namespace shiftrig::io::can {

// What the largest raw values of a J1939 parameter stand for ([J1939-71] table of transmitted values).
enum class Validity : std::uint8_t { valid, error, not_available };

struct SignalCodec {
    std::uint8_t first_byte = 0, byte_count = 0;
    std::uint8_t shift = 0;   // of the raw value within those bytes
    std::uint8_t length = 0;  // bits
    bool big_endian = false;
    bool is_signed = false;
    bool j1939 = false;  // the top of the range is reserved for error and not available
    dbc::ValueType type = dbc::ValueType::integer;
    double factor = 1, offset = 0;
    double smallest = 0, largest = 0;  // raw values that mean a number (as real numbers)

    SignalCodec() = default;
    SignalCodec(const dbc::Signal& signal, bool reserved_top);

    // The bits, right-aligned.
    std::uint64_t raw(const std::uint8_t* data) const SHIFTRIG_REALTIME;
    void put(std::uint8_t* data, std::uint64_t raw) const SHIFTRIG_REALTIME;

    // Raw value to physical value and back. Too large or small a value is limited, and `limited` says so; NaN
    // becomes "not available" (without J1939: the raw value of 0).
    double physical(std::uint64_t raw) const SHIFTRIG_REALTIME;
    std::uint64_t from_physical(double value, bool& limited) const SHIFTRIG_REALTIME;

    Validity validity(std::uint64_t raw) const SHIFTRIG_REALTIME;
    std::uint64_t not_available() const SHIFTRIG_REALTIME { return mask(); }
    std::uint64_t mask() const SHIFTRIG_REALTIME {
        return length >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << length) - 1;
    }
};

// The message checksum of TSC1 (SPN 4207, [J1939-71]): over the first seven bytes, the counter (SPN 4206) and
// the four bytes of the identifier; three bits.
unsigned tsc1_checksum(std::uint32_t id, const std::uint8_t* data, unsigned counter) SHIFTRIG_REALTIME;

}  // namespace shiftrig::io::can
