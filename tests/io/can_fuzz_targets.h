// What a fuzzer feeds: any bytes as a DBC file, as a candump log, as a datagram of python-can's, as frames on the bus.
// Driven by can_fuzz_test.cpp (mutations from a seed) and by can_fuzzer.cpp (libFuzzer, scripts/fuzz).
#pragma once

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <span>
#include <string_view>

#include "io/can/candump.h"
#include "io/can/codec.h"
#include "io/can/dbc.h"
#include "io/can/inprocess.h"
#include "io/can/link.h"
#include "io/can/udp_multicast.h"
#include "io/input_error.h"
#include "tests/io/can_rig_signals.h"

namespace shiftrig::io::can {

using Bytes = std::span<const std::uint8_t>;

inline std::string_view text_of(Bytes bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// Accepted, or refused with an InputError: true or false.
inline bool fuzz_dbc(Bytes bytes) {
    try {
        const auto database = dbc::parse(text_of(bytes), "fuzz.dbc");
        // Every descriptor must stay within its frame.
        std::array<std::uint8_t, 64 + 1721> data{};
        for (const auto& message : database.messages)
            for (const auto& signal : message.signals) {
                const SignalCodec codec(signal, true);
                if (signal.start_bit < 2000) codec.put(data.data(), codec.raw(data.data()));
            }
        return true;
    } catch (const InputError&) {
        return false;
    }
}

inline bool fuzz_candump(Bytes bytes) {
    try {
        parse_candump_line(text_of(bytes), "fuzz.log", 1);
        return true;
    } catch (const InputError&) {
        return false;
    }
}

inline void fuzz_datagram(Bytes bytes) {
    Frame frame;
    if (unpack_udp_frame(bytes, frame) && frame.length > 64) std::abort();
}

// A rig that hears whatever comes. `wrong()` says if something in its table is not a number or out of bounds.
class FuzzedRig {
  public:
    void hear(const Frame& frame) {
        bus_.end(1).send(now_ns_, frame);
        link_.receive(now_ns_, table_);
        link_.send(now_ns_, table_);
        now_ns_ += 250'000;
        ++frames_;
        static_cast<void>(bus_.end(1).receive(now_ns_, sink_));
    }
    // Twelve bytes a frame: identifier with flags, length, data.
    void hear(Bytes bytes) {
        for (; bytes.size() >= 13; bytes = bytes.subspan(13)) {
            Frame frame;
            std::memcpy(&frame.id, bytes.data(), 4);
            frame.extended = (frame.id & 0x80000000U) != 0;
            frame.remote = (frame.id & 0x40000000U) != 0;
            frame.error = (frame.id & 0x20000000U) != 0;
            frame.id &= frame.extended ? 0x1FFFFFFFU : 0x7FFU;
            frame.length = bytes[4] % 9;
            std::memcpy(frame.data.data(), bytes.data() + 5, 8);
            hear(frame);
        }
    }
    bool wrong() const {
        for (int i = 0; i < table_.size(); ++i) {
            const double number = table_.value[static_cast<std::size_t>(i)];
            const auto& name = table_.signal(i).name;
            if (!std::isfinite(number)) return true;
            if (name.ends_with("pressure_command") && !(number >= 0 && number <= 64.255e5 + 10)) return true;
        }
        return false;
    }
    std::uint64_t frames() const { return frames_; }
    std::uint64_t good() const {
        std::uint64_t sum = 0;
        for (const auto& message : link_.report()) sum += message.sent_by_us ? 0 : message.good;
        return sum;
    }

  private:
    Mapping mapping_ = tractor_mapping();
    InProcessBus bus_{2};
    SignalTable table_ = rig_signals();
    CanLink link_{mapping_, bus_.end(0), table_};
    std::array<Frame, 64> sink_;
    std::int64_t now_ns_ = 0;
    std::uint64_t frames_ = 0;
};

// One rig hears the frames of all inputs; at the end it says how many.
inline void fuzz_frames(Bytes bytes) {
    struct Telling : FuzzedRig {
        ~Telling() {
            std::fprintf(stderr, "%llu frames heard, %llu of them believed\n",
                         static_cast<unsigned long long>(frames()), static_cast<unsigned long long>(good()));
        }
    };
    static Telling rig;
    rig.hear(bytes);
    if (rig.wrong()) std::abort();
}

}  // namespace shiftrig::io::can
