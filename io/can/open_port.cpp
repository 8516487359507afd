#include "io/can/open_port.h"

#include <algorithm>
#include <charconv>
#include <optional>

#include "io/can/link.h"
#include "io/can/mapping.h"
#include "io/can/socketcan.h"
#include "io/can/udp_multicast.h"

namespace shiftrig::io::can {

namespace {

constexpr std::string_view kForms = "a CAN bus is can:INTERFACE or udpcan:GROUP:PORT";

std::optional<int> whole_number(std::string_view text, int smallest, int largest) {
    int value = 0;
    const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || rest != text.data() + text.size() || value < smallest || value > largest)
        return {};
    return value;
}

}  // namespace

std::vector<Filter> message_filters(const Mapping& mapping, Role role) {
    std::vector<Filter> filters;
    for (const auto& map : mapping.messages) {
        const dbc::Message& layout = *mapping.database.find(map.name);
        if (mapping.sent_by_rig(layout) == (role == Role::rig)) continue;
        std::uint32_t mask = layout.extended ? 0x1FFFFFFFU : 0x7FFU;
        if (mapping.is_j1939(layout)) {
            const bool pdu1 = ((layout.id >> 16) & 0xFFU) < 240;
            mask = 0x03FF0000U | (pdu1 ? 0U : 0xFF00U);  // the destination is judged later: ours or everybody
            if (map.pin_source) mask |= 0xFFU;
            if (map.pin_priority) mask |= 0x1C000000U;
        }
        filters.push_back({layout.id & mask, mask, layout.extended});
    }
    return filters;
}

std::vector<Filter> filters_of(const Mapping& mapping, Role role) {
    std::vector<Filter> filters = message_filters(mapping, role);
    const auto j1939 = [&mapping](const MessageMap& map) {
        return mapping.is_j1939(*mapping.database.find(map.name));
    };
    if (std::any_of(mapping.messages.begin(), mapping.messages.end(), j1939))
        // request, acknowledgement, transport (two groups), address claim
        for (const std::uint32_t pgn : {0xEA00U, 0xE800U, 0xEC00U, 0xEB00U, 0xEE00U})
            filters.push_back({pgn << 8, 0x03FF0000U, true});
    return filters;
}

std::unique_ptr<CanPort> open_port(const std::string& name, std::span<const Filter> filters) {
    const std::size_t colon = name.find(':');
    const std::size_t question = name.find('?');
    const std::string kind = name.substr(0, colon == std::string::npos ? 0 : colon);
    const std::string place = colon == std::string::npos ? "" : name.substr(colon + 1, question - colon - 1);
    const std::string option = question == std::string::npos ? "" : name.substr(question + 1);

    if (kind == "can") {
        if (place.empty()) throw std::runtime_error(name + ": the interface is missing, as in can:vcan0");
        if (!option.empty() && option != "timestamps=hardware")
            throw std::runtime_error(name + ": unknown option \"" + option +
                                     "\"; there is timestamps=hardware");
        return std::make_unique<ThreadedPort<SocketCan>>(
            name, SocketCan(place, {filters.begin(), filters.end()}, !option.empty()));
    }
    if (kind == "udpcan") {
        const std::size_t last = place.rfind(':');
        const auto port =
            last == std::string::npos ? std::nullopt : whole_number(place.substr(last + 1), 1, 65535);
        if (!port)
            throw std::runtime_error(name + ": group and port are wanted, as in udpcan:239.74.163.2:43113");
        std::string group = place.substr(0, last);
        if (group.starts_with('[') && group.ends_with(']')) group = group.substr(1, group.size() - 2);
        int ttl = 1;
        if (!option.empty()) {
            const auto given =
                option.starts_with("ttl=") ? whole_number(option.substr(4), 0, 255) : std::nullopt;
            if (!given)
                throw std::runtime_error(name + ": unknown option \"" + option + "\"; there is ttl=0…255");
            ttl = *given;
        }
        return std::make_unique<ThreadedPort<UdpMulticast>>(
            name, UdpMulticast(std::move(group), static_cast<std::uint16_t>(*port), ttl));
    }
    throw std::runtime_error(name + ": " + std::string(kForms));
}

}  // namespace shiftrig::io::can
