// What makes the rig a good citizen of a J1939 network: it claims and defends the addresses it plays [J1939-81],
// answers requests [J1939-21], tells its faults (DM1, [J1939-73]) and speaks the transport protocol. Time is the
// caller's; nothing allocates after construction.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "io/can/dbc.h"
#include "io/can/j1939_transport.h"
#include "io/can/link.h"
#include "io/can/mapping.h"
#include "io/can/trouble_codes.h"

namespace shiftrig::io::can::j1939 {

constexpr std::uint32_t kRequest = 0xEA00, kAcknowledgement = 0xE800, kAddressClaimed = 0xEE00,
                        kTransport = 0xEC00, kTransportData = 0xEB00, kSoftwareIdentification = 0xFEDA;

// The 64-bit NAME of a controller; the lower of two wins an address.
struct Name {
    std::uint32_t identity = 1;      // 21 bits
    std::uint16_t manufacturer = 0;  // 11 bits
    std::uint8_t ecu_instance = 0, function_instance = 0, function = 0xFF, vehicle_system = 0;
    std::uint8_t vehicle_system_instance = 0, industry_group = 0;
    bool arbitrary_address = false;
    std::uint64_t bits() const noexcept;
};
// From the attributes NmJ1939… that DBC files give their nodes.
Name name_of(const dbc::Node& node, const Mapping& mapping);

enum class Claim : std::uint8_t { unclaimed, waiting, claimed, lost };

class Network {
  public:
    static constexpr std::int64_t kSaid = INT64_MIN;
    struct Node {
        std::string name;
        std::uint8_t address = 0;
        std::uint64_t bits = 0;  // NAME
        Claim claim = Claim::unclaimed;
        std::int64_t claimed_at_ns = 0;        // when waiting ends
        std::int64_t cannot_claim_ns = kSaid;  // when to say so
        bool announce = false;                 // send the claim at the next opportunity
    };

    // The nodes whose messages this role sends.
    Network(const Mapping& mapping, Role role, AddressClaim mode);

    // Looks at every extended frame. A request for a message of ours comes out of `requested`.
    void take(const Frame& frame, std::int64_t now_ns, CanPort& port) SHIFTRIG_REALTIME;
    bool requested(std::uint32_t& pgn, std::uint8_t& address) SHIFTRIG_REALTIME;
    // Sends what is due of claims and long messages.
    void run(std::int64_t now_ns, CanPort& port) SHIFTRIG_REALTIME;
    // And of trouble codes.
    void tell_troubles(std::int64_t now_ns, CanPort& port) SHIFTRIG_REALTIME;
    bool may_send(std::uint8_t address) const SHIFTRIG_REALTIME;

    // For all PGNs we answer by sending a message; others are answered by a negative acknowledgement.
    void add_answer(std::uint32_t pgn, std::uint8_t address) { answers_.push_back({pgn, address}); }

    const std::vector<Node>& nodes() const noexcept { return nodes_; }
    void archive(Archive& a) {
        transport.archive(a);
        requests_.archive(a);
        for (Node& node : nodes_) a(node.claim, node.claimed_at_ns, node.cannot_claim_ns, node.announce);
        troubles.archive(a);
        a(started_);
    }
    Transport transport;
    TroubleCodes troubles;

  private:
    struct Answer {
        std::uint32_t pgn;
        std::uint8_t address;
    };
    Node* node_at(std::uint8_t address) SHIFTRIG_REALTIME;
    void hear_claim(const Frame& frame, std::int64_t now_ns) SHIFTRIG_REALTIME;
    void hear_request(const Frame& frame, std::int64_t now_ns, CanPort& port) SHIFTRIG_REALTIME;
    bool answer(Node& node, std::uint32_t pgn, std::uint8_t asker, std::int64_t now_ns,
                CanPort& port) SHIFTRIG_REALTIME;
    void send_claim(const Node& node, std::uint8_t as, std::int64_t now_ns, CanPort& port) SHIFTRIG_REALTIME;

    std::vector<Node> nodes_;
    std::vector<Answer> answers_;
    Ring<Answer> requests_{32};
    AddressClaim mode_;
    bool started_ = false;
};

}  // namespace shiftrig::io::can::j1939
