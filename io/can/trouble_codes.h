// The active trouble codes of the nodes we play, told as DM1 [J1939-73]. A node that can have any tells its own once a
// second, `none` included, and in the moment one begins or ends; but of each code at most one change a second, so that
// a fault that flickers does not fill the bus. More codes than one travel by transport protocol.
//
//     const int code = codes.add(191, 5, 0x80, Lamp::amber);       // output shaft speed, open circuit
//     codes.set(code, sensor_is_dead);                             // every tick
//     codes.run(now_ns, port, transport, may_send);
//
// DM1, byte by byte: 1 the lamps that the codes light (two bits each), 2 their flashing (not available), then four bytes a
// code: SPN low, SPN middle, SPN's upper three bits above the FMI's five, occurrences (7 bits; SPN conversion method 0).
#pragma once

#include <cstdint>
#include <vector>

#include "io/archive.h"
#include "io/can/j1939_transport.h"
#include "io/can/port.h"

namespace shiftrig::io::can::j1939 {

constexpr std::uint32_t kDm1 = 0xFECA;

// The value is the bit in DM1's first byte.
enum class Lamp : std::uint8_t { none = 0, protect = 0x01, amber = 0x04, red = 0x10, malfunction = 0x40 };

class TroubleCodes {
  public:
    // Of DM1, and the shortest time between two changes told of one code [ns].
    static constexpr std::int64_t kCycle = 1'000'000'000;
    static constexpr int kMostOfANode = (static_cast<int>(LongMessage::kLongest) - 2) / 4;

    struct Code {
        std::uint32_t spn = 0;                 // 19 bits
        std::uint8_t fmi = 0;                  // 5 bits
        std::uint8_t address = 0;              // of the node whose trouble it is
        Lamp lamp = Lamp::amber;               // lit while it is active
        std::uint8_t occurrences = 0;          // since start, 126 at most
        bool active = false;                   // now
        bool told = false;                     // as DM1 says
        std::int64_t told_ns = INT64_MIN / 2;  // when that changed
    };

    // Before the first run(). −1 if the node has kMostOfANode of them already, which is what a DM1 can hold.
    int add(std::uint32_t spn, std::uint8_t fmi, std::uint8_t address, Lamp lamp);
    void set(int code, bool active) SHIFTRIG_REALTIME;

    // Sends what is due. `may_send(address)` says whether the node is allowed to speak.
    template <class MaySend>
    void run(std::int64_t now_ns, CanPort& port, Transport& transport, MaySend may_send) SHIFTRIG_REALTIME {
        for (Teller& teller : tellers_) {
            begin(teller, now_ns);
            if (may_send(teller.address)) tell(teller, now_ns, port, transport);
        }
    }
    // Somebody asks for DM1; `asker` is kEverybody if everybody was asked.
    void answer(std::uint8_t address, std::uint8_t asker, std::int64_t now_ns, CanPort& port,
                Transport& transport) const SHIFTRIG_REALTIME;

    const std::vector<Code>& codes() const noexcept { return codes_; }
    void archive(Archive& a) {
        for (Code& code : codes_) a(code.occurrences, code.active, code.told, code.told_ns);
        for (Teller& teller : tellers_) a(teller.begun, teller.due_ns);
    }

  private:
    struct Teller {
        std::uint8_t address = 0;
        bool begun = false;
        std::int64_t due_ns = 0;
    };
    void begin(Teller& teller, std::int64_t now_ns) SHIFTRIG_REALTIME;
    void tell(Teller& teller, std::int64_t now_ns, CanPort& port, Transport& transport) SHIFTRIG_REALTIME;

    std::vector<Code> codes_;
    std::vector<Teller> tellers_;  // the nodes that have codes
};

}  // namespace shiftrig::io::can::j1939
