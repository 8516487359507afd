#include "io/can/j1939.h"

#include <algorithm>
#include <charconv>
#include <cstring>

namespace shiftrig::io::can::j1939 {

namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kClaimWait = 250 * kMs;
constexpr std::string_view kSoftware = "shiftrig*";

// Addresses of the preferred and the self-configuring top range may speak without waiting.
bool speaks_at_once(std::uint8_t address) {
    return address <= 127 || (address >= 248 && address <= 253);
}

Frame frame_of(std::uint32_t id, std::uint8_t length = 8) {
    Frame frame;
    frame.id = id;
    frame.extended = true;
    frame.length = length;
    frame.data.fill(0xFF);
    return frame;
}

std::uint64_t attribute(const dbc::Node& node, const char* name, std::uint64_t fallback) {
    const auto found = node.attributes.find(name);
    if (found == node.attributes.end()) return fallback;
    std::uint64_t value = fallback;
    std::from_chars(found->second.data(), found->second.data() + found->second.size(), value);
    return value;
}

// Functions of industry group 0 that every network shares.
std::uint8_t usual_function(std::uint8_t address) {
    switch (address) {
        case 0:
            return 0;  // engine
        case 3:
            return 3;  // transmission
        case 5:
            return 5;  // shift console
        case 0x0B:
            return 9;  // brakes
        default:
            return 0xFF;
    }
}

}  // namespace

std::uint64_t Name::bits() const noexcept {
    return (std::uint64_t{identity} & 0x1FFFFF) | (std::uint64_t{manufacturer} & 0x7FF) << 21 |
           (std::uint64_t{ecu_instance} & 7) << 32 | (std::uint64_t{function_instance} & 31) << 35 |
           std::uint64_t{function} << 40 | (std::uint64_t{vehicle_system} & 127) << 49 |
           (std::uint64_t{vehicle_system_instance} & 15) << 56 | (std::uint64_t{industry_group} & 7) << 60 |
           std::uint64_t{arbitrary_address ? 1U : 0U} << 63;
}

Name name_of(const dbc::Node& node, const Mapping& mapping) {
    const auto small = [&node](const char* attribute_name, std::uint64_t fallback) {
        return static_cast<std::uint8_t>(attribute(node, attribute_name, fallback));
    };
    Name name;
    name.identity = static_cast<std::uint32_t>(attribute(node, "NmJ1939IdentityNumber", mapping.identity));
    name.manufacturer =
        static_cast<std::uint16_t>(attribute(node, "NmJ1939ManufacturerCode", mapping.manufacturer));
    name.ecu_instance = small("NmJ1939ECUInstance", 0);
    name.function_instance = small("NmJ1939FunctionInstance", 0);
    name.function = small("NmJ1939Function", usual_function(small("NmStationAddress", kNoAddress)));
    name.vehicle_system = small("NmJ1939System", 0);
    name.vehicle_system_instance = small("NmJ1939SystemInstance", 0);
    name.industry_group = small("NmJ1939IndustryGroup", 0);
    name.arbitrary_address = small("NmJ1939AAC", 0) != 0;
    return name;
}

Network::Network(const Mapping& mapping, Role role, AddressClaim mode) : mode_(mode) {
    for (const auto& map : mapping.messages) {
        const dbc::Message& layout = *mapping.database.find(map.name);
        if (!mapping.is_j1939(layout) || mapping.sent_by_rig(layout) != (role == Role::rig)) continue;
        const auto address = static_cast<std::uint8_t>(layout.id);
        add_answer(
            ((layout.id >> 16) & 0xFFU) < 240 ? (layout.id >> 8) & 0x3FF00U : (layout.id >> 8) & 0x3FFFFU,
            address);
        if (node_at(address)) continue;
        const auto& known = mapping.database.nodes;
        const auto node = std::find_if(known.begin(), known.end(),
                                       [&](const auto& n) { return n.name == layout.transmitter; });
        const Name name = node == known.end() ? Name{} : name_of(*node, mapping);
        Node entry;
        entry.name = layout.transmitter;
        entry.address = address;
        entry.bits = name.bits();
        if (mode == AddressClaim::settled) entry.claim = Claim::claimed;
        nodes_.push_back(std::move(entry));
    }
}

Network::Node* Network::node_at(std::uint8_t address) SHIFTRIG_REALTIME {
    for (auto& node : nodes_)
        if (node.address == address) return &node;
    return nullptr;
}

bool Network::may_send(std::uint8_t address) const SHIFTRIG_REALTIME {
    if (mode_ == AddressClaim::off) return true;
    for (const auto& node : nodes_)
        if (node.address == address) return node.claim == Claim::claimed;
    return true;  // plays no part in the network: an identifier written by hand
}

// ---- hearing -------------------------------------------------------------------------------------------------

void Network::take(const Frame& frame, std::int64_t now_ns, CanPort& port) SHIFTRIG_REALTIME {
    if (!frame.extended || frame.remote || ((frame.id >> 24) & 3U) != 0) return;
    switch ((frame.id >> 8) & 0xFF00U) {
        case kAddressClaimed:
            return mode_ == AddressClaim::off ? void() : hear_claim(frame, now_ns);
        case kRequest:
            return mode_ == AddressClaim::off ? void() : hear_request(frame, now_ns, port);
        case kTransport:
        case kTransportData:
            return transport.take(frame, now_ns, port, [this](std::uint8_t address) SHIFTRIG_REALTIME {
                const Node* node = node_at(address);
                return node && node->claim == Claim::claimed;
            });
        default:
            return;
    }
}

void Network::hear_claim(const Frame& frame, std::int64_t now_ns) SHIFTRIG_REALTIME {
    Node* node = node_at(static_cast<std::uint8_t>(frame.id));
    if (!node || frame.length < 8 || node->claim == Claim::lost) return;
    std::uint64_t other = 0;
    for (int i = 7; i >= 0; --i) other = (other << 8) | frame.data[static_cast<std::size_t>(i)];
    if (other > node->bits) {
        node->announce = true;  // ours by right: say it again
    } else if (other < node->bits) {
        node->claim = Claim::lost;
        // "Cannot claim" after a delay of 0…153 ms that differs from controller to controller.
        node->cannot_claim_ns = now_ns + static_cast<std::int64_t>(node->bits % 256) * 600'000;
    }
}

void Network::hear_request(const Frame& frame, std::int64_t now_ns, CanPort& port) SHIFTRIG_REALTIME {
    if (frame.length < 3) return;
    const std::uint32_t pgn =
        frame.data[0] | (std::uint32_t{frame.data[1]} << 8) | (std::uint32_t{frame.data[2]} << 16);
    const auto destination = static_cast<std::uint8_t>(frame.id >> 8),
               asker = static_cast<std::uint8_t>(frame.id);
    for (auto& node : nodes_) {
        const bool asked = destination == node.address;
        if (!asked && destination != kEverybody) continue;
        if (answer(node, pgn, asked ? asker : kEverybody, now_ns, port) || !asked ||
            node.claim != Claim::claimed)
            continue;
        Frame refusal =
            frame_of((6U << 26) | (kAcknowledgement << 8) | (std::uint32_t{kEverybody} << 8) | node.address);
        refusal.data[0] = 1;  // negative
        refusal.data[4] = asker;
        std::memcpy(&refusal.data[5], frame.data.data(), 3);
        port.send(now_ns, refusal);
    }
}

bool Network::answer(Node& node, std::uint32_t pgn, std::uint8_t asker, std::int64_t now_ns,
                     CanPort& port) SHIFTRIG_REALTIME {
    if (pgn == kAddressClaimed) {
        if (node.claim == Claim::lost)
            node.cannot_claim_ns = now_ns;
        else
            node.announce = true;
        return true;
    }
    if (node.claim != Claim::claimed) return true;  // silent
    if (pgn == kDm1) {
        troubles.answer(node.address, asker, now_ns, port, transport);
        return true;
    }
    if (pgn == kSoftwareIdentification) {
        LongMessage text;
        text.pgn = pgn;
        text.source = node.address;
        text.destination = asker;
        text.data[0] = 1;  // number of fields
        std::copy(kSoftware.begin(), kSoftware.end(), text.data.begin() + 1);
        text.length = static_cast<std::uint16_t>(1 + kSoftware.size());
        return transport.send(text);
    }
    const auto known = std::find_if(answers_.begin(), answers_.end(), [&](const Answer& a) {
        return a.pgn == pgn && a.address == node.address;
    });
    if (known == answers_.end()) return false;
    requests_.push(*known);
    return true;
}

bool Network::requested(std::uint32_t& pgn, std::uint8_t& address) SHIFTRIG_REALTIME {
    if (requests_.empty()) return false;
    pgn = requests_.front().pgn;
    address = requests_.front().address;
    requests_.pop();
    return true;
}

// ---- speaking ------------------------------------------------------------------------------------------------

void Network::run(std::int64_t now_ns, CanPort& port) SHIFTRIG_REALTIME {
    transport.run(now_ns, port);
    if (mode_ == AddressClaim::off) return;
    for (auto& node : nodes_) {
        if (!started_ && node.claim == Claim::unclaimed) {
            node.claim = Claim::waiting;
            node.announce = true;
            node.claimed_at_ns = now_ns + (speaks_at_once(node.address) ? 0 : kClaimWait);
        }
        if (node.announce) {
            node.announce = false;
            send_claim(node, node.address, now_ns, port);
        }
        if (node.claim == Claim::waiting && now_ns >= node.claimed_at_ns) node.claim = Claim::claimed;
        if (node.claim == Claim::lost && node.cannot_claim_ns != kSaid && now_ns >= node.cannot_claim_ns) {
            node.cannot_claim_ns = kSaid;
            send_claim(node, kNoAddress, now_ns, port);
        }
    }
    started_ = true;
}

void Network::tell_troubles(std::int64_t now_ns, CanPort& port) SHIFTRIG_REALTIME {
    troubles.run(now_ns, port, transport,
                 [this](std::uint8_t address) SHIFTRIG_REALTIME { return may_send(address); });
}

void Network::send_claim(const Node& node, std::uint8_t as, std::int64_t now_ns,
                         CanPort& port) SHIFTRIG_REALTIME {
    Frame frame = frame_of((6U << 26) | (kAddressClaimed << 8) | (std::uint32_t{kEverybody} << 8) | as);
    for (std::size_t i = 0; i < 8; ++i) frame.data[i] = static_cast<std::uint8_t>(node.bits >> (8 * i));
    port.send(now_ns, frame);
}

}  // namespace shiftrig::io::can::j1939
