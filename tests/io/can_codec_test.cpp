// Reading and writing signals against an oracle that walks bit by bit.
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <random>

#include "io/can/codec.h"

namespace shiftrig::io::can {
namespace {

using Bytes = std::array<std::uint8_t, 64>;

// Positions of a signal's bits, least significant first, as (byte, bit) by the definition of the DBC format:
// Intel counts up from the start bit; Motorola counts down from the start bit, which is the most significant,
// and goes on at bit 7 of the next byte.
std::vector<std::pair<int, int>> positions(const dbc::Signal& signal) {
    std::vector<std::pair<int, int>> bits;
    if (signal.little_endian) {
        for (int i = 0; i < signal.length; ++i)
            bits.emplace_back((signal.start_bit + i) / 8, (signal.start_bit + i) % 8);
        return bits;
    }
    int byte = signal.start_bit / 8, bit = signal.start_bit % 8;
    for (int i = 0; i < signal.length; ++i) {
        bits.emplace_back(byte, bit);
        if (--bit < 0) ++byte, bit = 7;
    }
    return {bits.rbegin(), bits.rend()};
}

std::uint64_t read_bit_by_bit(const dbc::Signal& signal, const Bytes& data) {
    std::uint64_t raw = 0;
    int weight = 0;
    for (const auto& [byte, bit] : positions(signal))
        raw |= static_cast<std::uint64_t>((data[static_cast<std::size_t>(byte)] >> bit) & 1) << weight++;
    return raw;
}

dbc::Signal layout(int start_bit, int length, bool is_signed = false,
                   dbc::ValueType type = dbc::ValueType::integer) {
    dbc::Signal signal;
    signal.start_bit = start_bit;
    signal.length = length;
    signal.is_signed = is_signed;
    signal.type = type;
    return signal;
}

class RandomSignals {
  public:
    dbc::Signal next(int bytes) {
        for (;;) {
            dbc::Signal signal;
            signal.little_endian = random_() % 2 == 0;
            signal.is_signed = random_() % 2 == 0;
            signal.length = static_cast<int>(random_() % 64) + 1;
            signal.start_bit = static_cast<int>(random_() % static_cast<unsigned>(8 * bytes));
            bool fits = true;
            for (const auto& [byte, bit] : positions(signal)) fits = fits && byte < bytes;
            if (fits) return signal;
        }
    }
    std::uint64_t bits() { return random_(); }
    Bytes payload() {
        Bytes data;
        for (auto& byte : data) byte = static_cast<std::uint8_t>(random_());
        return data;
    }

  private:
    std::mt19937_64 random_{20261122};
};

TEST(SignalCodec, ReadsWhatABitByBitWalkReadsForAnyLayout) {
    RandomSignals random;
    for (int i = 0; i < 50000; ++i) {
        const auto signal = random.next(i % 2 == 0 ? 8 : 64);
        const Bytes data = random.payload();
        ASSERT_EQ(SignalCodec(signal, false).raw(data.data()), read_bit_by_bit(signal, data))
            << signal.start_bit << "|" << signal.length << "@" << signal.little_endian;
    }
}

TEST(SignalCodec, WritesItsOwnBitsAndNoOthers) {
    RandomSignals random;
    for (int i = 0; i < 50000; ++i) {
        const auto signal = random.next(i % 2 == 0 ? 8 : 64);
        const SignalCodec codec(signal, false);
        const Bytes before = random.payload();
        Bytes after = before;
        const std::uint64_t raw = random.bits() & codec.mask();
        codec.put(after.data(), raw);
        ASSERT_EQ(read_bit_by_bit(signal, after), raw);
        for (const auto& [byte, bit] : positions(signal)) {
            const auto at = static_cast<std::size_t>(byte);
            const auto flag = static_cast<std::uint8_t>(1 << bit);
            after[at] = static_cast<std::uint8_t>((after[at] & ~flag) | (before[at] & flag));
        }
        ASSERT_EQ(after, before);
    }
}

TEST(SignalCodec, EveryRawValueSurvivesTheWayToPhysicalAndBack) {
    RandomSignals random;
    for (int i = 0; i < 50000; ++i) {
        auto signal = random.next(8);
        if (signal.length > 52) continue;  // beyond the mantissa a double cannot name every value
        signal.factor = i % 3 == 0 ? 0.125 : i % 3 == 1 ? -0.4 : 1e-3;
        signal.offset = i % 5 == 0 ? -8000 : 0;
        if (signal.length > 40) signal.factor = 1, signal.offset = 0;
        const SignalCodec codec(signal, false);
        const std::uint64_t raw = random.bits() & codec.mask();
        bool limited = true;
        ASSERT_EQ(codec.from_physical(codec.physical(raw), limited), raw);
        ASSERT_FALSE(limited);
    }
}

TEST(SignalCodec, TooLargeAndTooSmallValuesAreLimitedAndSaidSo) {
    auto signal = layout(0, 12, true);
    signal.factor = 0.5;
    const SignalCodec codec(signal, false);
    bool limited = false;
    EXPECT_EQ(codec.physical(codec.from_physical(1e9, limited)), 2047 * 0.5);
    EXPECT_TRUE(limited);
    EXPECT_EQ(codec.physical(codec.from_physical(-1e9, limited)), -2048 * 0.5);
    EXPECT_TRUE(limited);
    codec.from_physical(1023.5, limited);
    EXPECT_FALSE(limited);

    const SignalCodec widest(layout(0, 64), false), signed_widest(layout(0, 64, true), false);
    EXPECT_EQ(widest.from_physical(1e300, limited), UINT64_MAX);
    EXPECT_EQ(widest.from_physical(0x1p63, limited), std::uint64_t{1} << 63);
    EXPECT_EQ(signed_widest.from_physical(1e300, limited), static_cast<std::uint64_t>(INT64_MAX));
    EXPECT_EQ(signed_widest.from_physical(-1e300, limited), static_cast<std::uint64_t>(INT64_MIN));
}

TEST(SignalCodec, FloatsTravelAsTheirBits) {
    for (const double value : {0.0, -1.5, 1e-30, 3.25e7}) {
        bool limited = false;
        const SignalCodec single(layout(3, 32, false, dbc::ValueType::float32), false);
        auto motorola = layout(7, 64, false, dbc::ValueType::float64);
        motorola.little_endian = false;
        const SignalCodec twice(motorola, false);
        EXPECT_EQ(single.physical(single.from_physical(value, limited)),
                  static_cast<double>(static_cast<float>(value)));
        EXPECT_EQ(twice.physical(twice.from_physical(value, limited)), value);
    }
}

TEST(SignalCodec, J1939KeepsTheTopOfTheRangeForErrorAndNotAvailable) {
    const SignalCodec byte(layout(0, 8), true), word(layout(0, 16), true);
    const SignalCodec pair(layout(0, 2), true), nibble(layout(0, 4), true), bit(layout(0, 1), true);
    EXPECT_EQ(byte.validity(250), Validity::valid);
    EXPECT_EQ(byte.validity(0xFB), Validity::error);
    EXPECT_EQ(byte.validity(0xFE), Validity::error);
    EXPECT_EQ(byte.validity(0xFF), Validity::not_available);
    EXPECT_EQ(word.validity(64255), Validity::valid);
    EXPECT_EQ(word.validity(0xFE00), Validity::error);
    EXPECT_EQ(word.validity(0xFF12), Validity::not_available);
    EXPECT_EQ(pair.validity(2), Validity::error);
    EXPECT_EQ(pair.validity(3), Validity::not_available);
    EXPECT_EQ(nibble.validity(13), Validity::valid);
    EXPECT_EQ(nibble.validity(14), Validity::error);
    EXPECT_EQ(bit.validity(1), Validity::valid);

    bool limited = false;
    EXPECT_EQ(byte.from_physical(1e6, limited), 250U);
    EXPECT_EQ(word.from_physical(1e6, limited), 64255U);
    EXPECT_TRUE(limited);
    EXPECT_EQ(word.from_physical(std::nan(""), limited), 0xFFFFU);
    EXPECT_EQ(pair.from_physical(std::nan(""), limited), 3U);
}

// SPN 4207 worked out by hand for 0x0C000003: bytes FC 00 00 FF FF FF FF, counter 5. The bytes sum to
// 0xFC + 4·0xFF = 1272; + 5 + 0x0C + 0x00 + 0x00 + 0x03 = 1292; 1292 >> 6 = 20 → & 3 = 0; 1292 >> 3 = 161;
// 0 + 161 + 1292 = 1453 → & 7 = 5.
TEST(Tsc1Checksum, AgreesWithAWorkedExample) {
    const std::uint8_t data[] = {0xFC, 0, 0, 0xFF, 0xFF, 0xFF, 0xFF, 0};
    EXPECT_EQ(tsc1_checksum(0x0C000003, data, 5), 5U);
}

}  // namespace
}  // namespace shiftrig::io::can
