#include "io/can/codec.h"

#include <bit>
#include <cmath>

namespace shiftrig::io::can {

namespace {

__extension__ using Wide = unsigned __int128;  // nine bytes: a 64-bit signal that starts inside a byte

}  // namespace

SignalCodec::SignalCodec(const dbc::Signal& signal, bool reserved_top)
    : length(static_cast<std::uint8_t>(signal.length)),
      big_endian(!signal.little_endian),
      is_signed(signal.is_signed),
      j1939(reserved_top && !signal.is_signed && signal.type == dbc::ValueType::integer &&
            signal.length >= 2),
      type(signal.type),
      factor(signal.factor),
      offset(signal.offset) {
    // First and last bit in the order of transmission of bytes: Motorola counts down within a byte.
    const int first = big_endian ? 8 * (signal.start_bit / 8) + 7 - signal.start_bit % 8 : signal.start_bit;
    const int last = first + signal.length - 1;
    first_byte = static_cast<std::uint8_t>(first / 8);
    byte_count = static_cast<std::uint8_t>(last / 8 - first / 8 + 1);
    shift = static_cast<std::uint8_t>(big_endian ? 7 - last % 8 : first % 8);

    if (is_signed) {
        smallest = -std::ldexp(1.0, length - 1);
        largest = std::ldexp(1.0, length - 1) - 1;
    } else {
        largest = std::ldexp(1.0, length) - 1;
    }
    if (!j1939) return;
    // Up to 0xFA of the top byte is a value, from 0xFB up an indicator; short fields lose the top two codes.
    largest = length >= 8 ? std::ldexp(251.0, length - 8) - 1 : largest - 2;
}

std::uint64_t SignalCodec::raw(const std::uint8_t* data) const SHIFTRIG_REALTIME {
    Wide bits = 0;
    for (int i = 0; i < byte_count; ++i) {
        const std::uint8_t byte = data[first_byte + (big_endian ? i : byte_count - 1 - i)];
        bits = (bits << 8) | byte;
    }
    return static_cast<std::uint64_t>(bits >> shift) & mask();
}

void SignalCodec::put(std::uint8_t* data, std::uint64_t raw) const SHIFTRIG_REALTIME {
    Wide bits = static_cast<Wide>(raw & mask()) << shift;
    Wide keep = ~(static_cast<Wide>(mask()) << shift);
    for (int i = 0; i < byte_count; ++i) {
        std::uint8_t& byte = data[first_byte + (big_endian ? byte_count - 1 - i : i)];
        byte = static_cast<std::uint8_t>((byte & static_cast<std::uint8_t>(keep)) |
                                         static_cast<std::uint8_t>(bits));
        bits >>= 8;
        keep >>= 8;
    }
}

double SignalCodec::physical(std::uint64_t raw) const SHIFTRIG_REALTIME {
    double number = 0;
    if (type == dbc::ValueType::float32) {
        number = static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(raw)));
    } else if (type == dbc::ValueType::float64) {
        number = std::bit_cast<double>(raw);
    } else if (is_signed) {
        const int unused = 64 - length;
        number = static_cast<double>(static_cast<std::int64_t>(raw << unused) >> unused);
    } else {
        number = static_cast<double>(raw);
    }
    return number * factor + offset;
}

std::uint64_t SignalCodec::from_physical(double value, bool& limited) const SHIFTRIG_REALTIME {
    limited = false;
    const double number = (value - offset) / factor;
    if (type == dbc::ValueType::float32) return std::bit_cast<std::uint32_t>(static_cast<float>(number));
    if (type == dbc::ValueType::float64) return std::bit_cast<std::uint64_t>(number);
    if (std::isnan(number)) return j1939 ? not_available() : 0;
    double rounded = std::nearbyint(number);
    limited = rounded > largest || rounded < smallest;
    rounded = std::fmin(std::fmax(rounded, smallest), largest);
    // The largest 64-bit numbers are not doubles: `largest` has been rounded up, the bits are written out.
    if (!j1939 && length == 64 && rounded >= largest) return is_signed ? mask() >> 1 : mask();
    return is_signed ? static_cast<std::uint64_t>(static_cast<std::int64_t>(rounded)) & mask()
                     : static_cast<std::uint64_t>(rounded);
}

Validity SignalCodec::validity(std::uint64_t raw) const SHIFTRIG_REALTIME {
    if (!j1939) return Validity::valid;
    if (length >= 8) {
        const auto top = static_cast<unsigned>(raw >> (length - 8));
        return top <= 0xFA ? Validity::valid : top == 0xFF ? Validity::not_available : Validity::error;
    }
    return raw == mask() ? Validity::not_available : raw == mask() - 1 ? Validity::error : Validity::valid;
}

unsigned tsc1_checksum(std::uint32_t id, const std::uint8_t* data, unsigned counter) SHIFTRIG_REALTIME {
    unsigned sum = counter & 0x0FU;
    for (int i = 0; i < 7; ++i) sum += data[i];
    for (int i = 0; i < 4; ++i) sum += (id >> (8 * i)) & 0xFFU;
    return (((sum >> 6) & 0x03U) + (sum >> 3) + sum) & 0x07U;
}

}  // namespace shiftrig::io::can
