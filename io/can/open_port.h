// Opens a port by the name a user gives it:
//
//     can:vcan0                             SocketCAN
//     can:can0?timestamps=hardware          stamped by the controller where it can
//     udpcan:239.74.163.2:43113             python-can's udp_multicast; IPv6 as udpcan:[ff15::1]:43113; ?ttl=0 stays here
//
// `inprocess` is not opened: its bus (inprocess.h) belongs to whoever joins its ends.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "io/can/port.h"

namespace shiftrig::io::can {

struct Mapping;
enum class Role : std::uint8_t;

// Frames wanted: (frame.id & mask) == (id & mask), of this identifier length.
struct Filter {
    std::uint32_t id = 0, mask = 0;
    bool extended = false;
    bool passes(const Frame& frame) const noexcept {
        return frame.extended == extended && ((frame.id ^ id) & mask) == 0;
    }
};

// The messages this end of the mapping receives; `filters_of` adds J1939's own groups (address claim, request,
// transport).
std::vector<Filter> message_filters(const Mapping& mapping, Role role);
std::vector<Filter> filters_of(const Mapping& mapping, Role role);

// Throws std::runtime_error: one line saying what is missing and the command that provides it. No filters:
// every frame. The port reads and writes on two threads of its own, so its calls only touch queues.
std::unique_ptr<CanPort> open_port(const std::string& name, std::span<const Filter> filters = {});

}  // namespace shiftrig::io::can
