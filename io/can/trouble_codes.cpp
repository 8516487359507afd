#include "io/can/trouble_codes.h"

#include <algorithm>

namespace shiftrig::io::can::j1939 {

namespace {

constexpr std::int64_t kStagger = 50'000'000;  // between the first DM1 of two nodes [ns]: not all in one tick
constexpr std::uint8_t kMostOccurrences = 126;  // 127 means "not available"

bool may_change(const TroubleCodes::Code& code, std::int64_t now_ns) SHIFTRIG_REALTIME {
    return code.active != code.told && now_ns - code.told_ns >= TroubleCodes::kCycle;
}

}  // namespace

int TroubleCodes::add(std::uint32_t spn, std::uint8_t fmi, std::uint8_t address, Lamp lamp) {
    const auto has_this_address = [address](const auto& each) { return each.address == address; };
    if (std::count_if(codes_.begin(), codes_.end(), has_this_address) >= kMostOfANode) return -1;
    if (std::none_of(tellers_.begin(), tellers_.end(), has_this_address)) {
        Teller teller;
        teller.address = address;
        tellers_.push_back(teller);
    }
    Code code;
    code.spn = spn;
    code.fmi = fmi;
    code.address = address;
    code.lamp = lamp;
    codes_.push_back(code);
    return static_cast<int>(codes_.size()) - 1;
}

void TroubleCodes::set(int index, bool active) SHIFTRIG_REALTIME {
    Code& code = codes_[static_cast<std::size_t>(index)];
    if (active && !code.active && code.occurrences < kMostOccurrences) ++code.occurrences;
    code.active = active;
}

void TroubleCodes::begin(Teller& teller, std::int64_t now_ns) SHIFTRIG_REALTIME {
    if (teller.begun) return;
    teller.begun = true;
    teller.due_ns = now_ns + (&teller - tellers_.data()) * kStagger;
}

void TroubleCodes::tell(Teller& teller, std::int64_t now_ns, CanPort& port,
                        Transport& transport) SHIFTRIG_REALTIME {
    bool due = now_ns >= teller.due_ns;
    for (const Code& code : codes_) due = due || (code.address == teller.address && may_change(code, now_ns));
    // One long message of a node to everybody after the other [J1939-21]; a longer list than a second carries waits.
    if (!due || transport.announces(teller.address) || transport.full()) return;
    for (Code& code : codes_) {
        if (code.address != teller.address || !may_change(code, now_ns)) continue;
        code.told = code.active;
        code.told_ns = now_ns;
    }
    answer(teller.address, kEverybody, now_ns, port, transport);
    teller.due_ns = now_ns + kCycle;
}

void TroubleCodes::answer(std::uint8_t address, std::uint8_t asker, std::int64_t now_ns, CanPort& port,
                          Transport& transport) const SHIFTRIG_REALTIME {
    LongMessage message;
    message.pgn = kDm1;
    message.source = address;
    message.destination = asker;
    message.data[1] = 0xFF;
    message.length = 2;
    for (const Code& code : codes_) {
        if (code.address != address || !code.told) continue;
        message.data[0] |= static_cast<std::uint8_t>(code.lamp);
        message.data[message.length++] = static_cast<std::uint8_t>(code.spn);
        message.data[message.length++] = static_cast<std::uint8_t>(code.spn >> 8);
        message.data[message.length++] =
            static_cast<std::uint8_t>(((code.spn >> 11) & 0xE0U) | (code.fmi & 0x1FU));
        message.data[message.length++] = code.occurrences;
    }
    if (message.length > 6) {
        transport.send(message);
        return;
    }
    // One code or none fits into a frame: four bytes of zeros say none.
    Frame frame;
    frame.id = (6U << 26) | (kDm1 << 8) | address;
    frame.extended = true;
    frame.length = 8;
    frame.data.fill(0);
    std::copy_n(message.data.begin(), message.length, frame.data.begin());
    frame.data[6] = frame.data[7] = 0xFF;
    port.send(now_ns, frame);
}

}  // namespace shiftrig::io::can::j1939
