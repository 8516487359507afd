#include "io/can/j1939_transport.h"

#include <algorithm>

namespace shiftrig::io::can::j1939 {

namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kPacketGap = 50 * kMs;    // between packets of an announced message
constexpr std::int64_t kNextPacket = 750 * kMs;  // T1: longest silence between packets
constexpr std::int64_t kClearance = 1250 * kMs;  // T3: longest wait for CTS or the end's acknowledgement
enum Control : std::uint8_t {
    kRequestToSend = 16,
    kClearToSend = 17,
    kEnd = 19,
    kAnnounce = 32,
    kAbort = 255
};
enum Reason : std::uint8_t { kBusy = 1, kNoResources = 2, kTimeout = 3 };

Frame frame_to(std::uint32_t pgn, std::uint8_t source, std::uint8_t destination) {
    Frame frame;
    frame.id = (7U << 26) | (pgn << 8) | (std::uint32_t{destination} << 8) | source;
    frame.extended = true;
    frame.length = 8;
    frame.data.fill(0xFF);
    return frame;
}

Frame management(std::uint8_t control, std::uint32_t pgn, std::uint8_t source, std::uint8_t destination) {
    Frame frame = frame_to(0xEC00, source, destination);
    frame.data[0] = control;
    for (std::size_t i = 0; i < 3; ++i) frame.data[5 + i] = static_cast<std::uint8_t>(pgn >> (8 * i));
    return frame;
}

std::uint32_t pgn_in(const Frame& frame) {
    return frame.data[5] | (std::uint32_t{frame.data[6]} << 8) | (std::uint32_t{frame.data[7]} << 16);
}

}  // namespace

// ---- sending -------------------------------------------------------------------------------------------------

void Transport::run(std::int64_t now_ns, CanPort& port) SHIFTRIG_REALTIME {
    for (auto& arrival : arrivals_)
        if (arrival.active && now_ns - arrival.heard_ns > kNextPacket) arrival.active = false;

    const bool to_all = sending_.destination == kEverybody;
    switch (phase_) {
        case Phase::idle: {
            if (waiting_.empty()) return;
            sending_ = waiting_.front();
            waiting_.pop();
            phase_ = Phase::announce;
            [[fallthrough]];
        }
        case Phase::announce: {
            const bool announce = sending_.destination == kEverybody;
            Frame frame = management(announce ? kAnnounce : kRequestToSend, sending_.pgn, sending_.source,
                                     sending_.destination);
            frame.data[1] = static_cast<std::uint8_t>(sending_.length);
            frame.data[2] = static_cast<std::uint8_t>(sending_.length >> 8);
            frame.data[3] = static_cast<std::uint8_t>(sending_.packets());
            port.send(now_ns, frame);
            next_packet_ = 1;
            clear_until_ = announce ? sending_.packets() : 0;
            phase_ = announce ? Phase::packets : Phase::wait_clear;
            due_ns_ = now_ns + kPacketGap;
            deadline_ns_ = now_ns + kClearance;
            return;
        }
        case Phase::packets: {
            if (to_all && now_ns < due_ns_) return;
            Frame frame = frame_to(0xEB00, sending_.source, sending_.destination);
            frame.data[0] = static_cast<std::uint8_t>(next_packet_);
            const auto from = static_cast<std::size_t>(7 * (next_packet_ - 1));
            for (std::size_t i = 0; i < 7 && from + i < sending_.length; ++i)
                frame.data[1 + i] = sending_.data[from + i];
            port.send(now_ns, frame);
            due_ns_ = now_ns + kPacketGap;
            deadline_ns_ = now_ns + kClearance;
            if (++next_packet_ <= clear_until_) return;
            if (to_all)
                phase_ = Phase::idle;
            else
                phase_ = next_packet_ > sending_.packets() ? Phase::wait_end : Phase::wait_clear;
            return;
        }
        case Phase::wait_clear:
        case Phase::wait_end:
            if (now_ns < deadline_ns_) return;
            Frame abort = management(kAbort, sending_.pgn, sending_.source, sending_.destination);
            abort.data[1] = kTimeout;
            port.send(now_ns, abort);
            phase_ = Phase::idle;
            return;
    }
}

// ---- receiving -----------------------------------------------------------------------------------------------

Transport::Arrival* Transport::arrival_from(std::uint8_t source, std::uint8_t destination) SHIFTRIG_REALTIME {
    for (auto& arrival : arrivals_)
        if (arrival.active && arrival.message.source == source && arrival.message.destination == destination)
            return &arrival;
    return nullptr;
}

void Transport::take(const Frame& frame, std::int64_t now_ns, CanPort& port) SHIFTRIG_REALTIME {
    if (frame.length < 8) return;
    if (((frame.id >> 16) & 0xFFU) == 0xEC)
        manage(frame, now_ns, port);
    else
        packet(frame, now_ns, port);
}

void Transport::manage(const Frame& frame, std::int64_t now_ns, CanPort& port) SHIFTRIG_REALTIME {
    const auto source = static_cast<std::uint8_t>(frame.id),
               destination = static_cast<std::uint8_t>(frame.id >> 8);
    const std::uint8_t control = frame.data[0];
    if (control == kAnnounce || control == kRequestToSend) {
        const unsigned length = frame.data[1] | (unsigned{frame.data[2]} << 8);
        Arrival* place =
            arrival_from(source, destination);  // a sender that begins anew drops its old message
        for (auto& arrival : arrivals_)
            if (!place && !arrival.active) place = &arrival;
        const bool sound = length > 8 && frame.data[3] == (length + 6) / 7;
        if (!place || !sound || length > LongMessage::kLongest) {
            if (control == kAnnounce) return;
            Frame abort = management(kAbort, pgn_in(frame), destination, source);
            abort.data[1] = place ? kNoResources : kBusy;
            port.send(now_ns, abort);
            return;
        }
        *place = Arrival{};
        place->active = true;
        place->message.pgn = pgn_in(frame);
        place->message.source = source;
        place->message.destination = destination;
        place->message.length = static_cast<std::uint16_t>(length);
        place->heard_ns = now_ns;
        if (control == kAnnounce) return;
        Frame clear = management(kClearToSend, pgn_in(frame), destination, source);
        clear.data[1] = frame.data[3];
        clear.data[2] = 1;
        port.send(now_ns, clear);
        return;
    }
    // The rest concerns what we are sending, if it comes from whom we send it to.
    const bool mine = phase_ != Phase::idle && source == sending_.destination &&
                      destination == sending_.source && pgn_in(frame) == sending_.pgn;
    if (control == kAbort && !mine)
        if (Arrival* arrival = arrival_from(source, destination)) arrival->active = false;
    if (!mine) return;
    if (control == kClearToSend && (phase_ == Phase::wait_clear || phase_ == Phase::wait_end)) {
        deadline_ns_ = now_ns + kClearance;
        const int from = frame.data[2], count = frame.data[1];
        if (count == 0) return;  // "hold the connection open"
        if (from < 1 || from > sending_.packets()) return;
        next_packet_ = from;
        clear_until_ = std::min(from + count - 1, sending_.packets());
        phase_ = Phase::packets;
    } else if (control == kEnd || control == kAbort) {
        phase_ = Phase::idle;
    }
}

void Transport::packet(const Frame& frame, std::int64_t now_ns, CanPort& port) SHIFTRIG_REALTIME {
    const auto source = static_cast<std::uint8_t>(frame.id),
               destination = static_cast<std::uint8_t>(frame.id >> 8);
    Arrival* arrival = arrival_from(source, destination);
    if (!arrival) return;
    LongMessage& message = arrival->message;
    if (frame.data[0] != arrival->next_packet) {
        if (frame.data[0] >= arrival->next_packet)
            arrival->active = false;  // one is missing; repeated ones do no harm
        return;
    }
    const auto from = static_cast<std::size_t>(7 * (arrival->next_packet - 1));
    for (std::size_t i = 0; i < 7 && from + i < message.length; ++i)
        message.data[from + i] = frame.data[1 + i];
    arrival->heard_ns = now_ns;
    if (arrival->next_packet++ < message.packets()) return;
    arrival->active = false;
    arrived_.push(message);
    if (destination == kEverybody) return;
    Frame end = management(kEnd, message.pgn, destination, source);
    end.data[1] = static_cast<std::uint8_t>(message.length);
    end.data[2] = static_cast<std::uint8_t>(message.length >> 8);
    end.data[3] = static_cast<std::uint8_t>(message.packets());
    port.send(now_ns, end);
}

bool Transport::next(LongMessage& message) SHIFTRIG_REALTIME {
    if (arrived_.empty()) return false;
    message = arrived_.front();
    arrived_.pop();
    return true;
}

}  // namespace shiftrig::io::can::j1939
