// A raw SocketCAN socket. Used through ThreadedPort.
#pragma once

#include <string>
#include <vector>

#include "io/can/open_port.h"
#include "io/can/threaded_port.h"

namespace shiftrig::io::can {

class SocketCan {
  public:
    SocketCan(std::string interface, std::vector<Filter> filters, bool hardware_timestamps);
    ~SocketCan();
    SocketCan(SocketCan&& other) noexcept;

    void open();
    bool reopen() noexcept;
    int fd() const noexcept { return fd_; }
    ReadResult read(std::span<Frame> frames, SharedCounters& counters, std::size_t& count) noexcept;
    SendResult write(const Frame& frame) noexcept;

  private:
    std::string open_socket(int& fd) noexcept;  // empty, or what went wrong
    bool interface_is_up(int fd) const noexcept;

    std::string interface_;
    std::vector<Filter> filters_;
    bool hardware_timestamps_ = false;
    std::atomic<bool> fd_frames_{false};
    int fd_ = -1;                  // stays the same number over reconnections: two threads use it
    std::uint32_t overflows_ = 0;  // SO_RXQ_OVFL counts from the opening of the socket
};

}  // namespace shiftrig::io::can
