// CAN over UDP multicast in the wire format of python-can's `udp_multicast` interface: one datagram a frame, a
// MessagePack map with the keys of python-can's Message. Used through ThreadedPort; the codec stands alone.
#pragma once

#include <netinet/in.h>
#include <sys/socket.h>

#include <span>
#include <string>

#include "io/can/threaded_port.h"

namespace shiftrig::io::can {

// Encodes into `datagram` (at least 320 bytes), returns its size.
std::size_t pack_udp_frame(const Frame& frame, double timestamp_s, std::span<std::uint8_t> datagram) noexcept;
// False if the bytes are not such a map or the frame in it is impossible.
bool unpack_udp_frame(std::span<const std::uint8_t> datagram, Frame& frame) noexcept;

class UdpMulticast {
  public:
    UdpMulticast(std::string group, std::uint16_t port, int ttl);
    ~UdpMulticast();
    UdpMulticast(UdpMulticast&& other) noexcept;

    void open();
    bool reopen() noexcept { return true; }  // there is no connection to lose
    int fd() const noexcept { return receiver_; }
    ReadResult read(std::span<Frame> frames, SharedCounters& counters, std::size_t& count) noexcept;
    SendResult write(const Frame& frame) noexcept;

  private:
    bool is_our_own(const sockaddr_storage& from) const noexcept;

    std::string group_;
    std::uint16_t port_ = 0;
    int ttl_ = 1;
    sockaddr_storage destination_{}, own_{};
    socklen_t address_length_ = 0;
    int receiver_ = -1, sender_ = -1;
    std::uint32_t overflows_ = 0;
};

}  // namespace shiftrig::io::can
