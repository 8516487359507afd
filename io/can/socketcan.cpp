#include "io/can/socketcan.h"

#include <fcntl.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <linux/errqueue.h>
#include <linux/net_tstamp.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace shiftrig::io::can {

namespace {

constexpr int kReceiveBuffer = 4 << 20;  // [bytes]

Frame from_kernel(const canfd_frame& raw, std::size_t bytes) noexcept {
    Frame frame;
    frame.extended = (raw.can_id & CAN_EFF_FLAG) != 0;
    frame.remote = (raw.can_id & CAN_RTR_FLAG) != 0;
    frame.error = (raw.can_id & CAN_ERR_FLAG) != 0;
    frame.id = raw.can_id & (frame.extended ? CAN_EFF_MASK : CAN_SFF_MASK);
    frame.fd = bytes == CANFD_MTU;
    frame.bit_rate_switch = frame.fd && (raw.flags & CANFD_BRS) != 0;
    frame.length = std::min<std::uint8_t>(raw.len, frame.fd ? 64 : 8);
    std::memcpy(frame.data.data(), raw.data, frame.length);
    return frame;
}

std::int64_t to_ns(const timespec& time) {
    return time.tv_sec * 1'000'000'000LL + time.tv_nsec;
}

}  // namespace

SocketCan::SocketCan(std::string interface, std::vector<Filter> filters, bool hardware_timestamps)
    : interface_(std::move(interface)),
      filters_(std::move(filters)),
      hardware_timestamps_(hardware_timestamps) {}

SocketCan::~SocketCan() {
    if (fd_ >= 0) ::close(fd_);
}

SocketCan::SocketCan(SocketCan&& other) noexcept
    : interface_(std::move(other.interface_)),
      filters_(std::move(other.filters_)),
      hardware_timestamps_(other.hardware_timestamps_),
      fd_frames_(other.fd_frames_.load()),
      fd_(std::exchange(other.fd_, -1)),
      overflows_(other.overflows_) {}

void SocketCan::open() {
    const std::string problem = open_socket(fd_);
    if (!problem.empty()) throw std::runtime_error("can:" + interface_ + ": " + problem);
}

std::string SocketCan::open_socket(int& fd) noexcept {
    if (interface_.size() >= IFNAMSIZ) return "an interface's name has at most 15 characters";
    // The kernel before the interface: where it has no CAN, nobody can make one.
    fd = ::socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
    if (fd < 0) {
        if (errno == EAFNOSUPPORT || errno == EPROTONOSUPPORT)
            return "this kernel has no CAN (sudo modprobe can_raw); without it use udpcan:239.74.163.2:43113";
        return std::string("cannot open a CAN socket: ") + std::strerror(errno);
    }
    const unsigned index = if_nametoindex(interface_.c_str());
    if (index == 0) {
        ::close(std::exchange(fd, -1));
        return "there is no such interface; make a virtual one: sudo ip link add dev " + interface_ +
               " type vcan && sudo ip link set up " + interface_;
    }
    // Filters first: nothing foreign may arrive between bind and filter.
    std::vector<can_filter> kernel_filters;
    for (const auto& filter : filters_) {
        const canid_t flags = CAN_EFF_FLAG | CAN_RTR_FLAG;
        kernel_filters.push_back({filter.id | (filter.extended ? CAN_EFF_FLAG : 0), filter.mask | flags});
    }
    const auto set = [fd](int level, int option, const auto& value) {
        return ::setsockopt(fd, level, option, &value, sizeof value) == 0;
    };
    if (!kernel_filters.empty())
        ::setsockopt(fd, SOL_CAN_RAW, CAN_RAW_FILTER, kernel_filters.data(),
                     static_cast<socklen_t>(kernel_filters.size() * sizeof(can_filter)));
    const can_err_mask_t errors = CAN_ERR_MASK;
    set(SOL_CAN_RAW, CAN_RAW_ERR_FILTER, errors);
    set(SOL_SOCKET, SO_RXQ_OVFL, 1);
    const int stamps = SOF_TIMESTAMPING_RX_SOFTWARE | SOF_TIMESTAMPING_SOFTWARE |
                       SOF_TIMESTAMPING_RX_HARDWARE | SOF_TIMESTAMPING_RAW_HARDWARE;
    set(SOL_SOCKET, SO_TIMESTAMPING, stamps);
    if (!set(SOL_SOCKET, SO_RCVBUFFORCE, kReceiveBuffer)) set(SOL_SOCKET, SO_RCVBUF, kReceiveBuffer);

    ifreq request{};
    std::copy(interface_.begin(), interface_.end(), request.ifr_name);
    fd_frames_ = ::ioctl(fd, SIOCGIFMTU, &request) == 0 && request.ifr_mtu >= static_cast<int>(CANFD_MTU);
    if (fd_frames_) set(SOL_CAN_RAW, CAN_RAW_FD_FRAMES, 1);

    std::string problem;
    sockaddr_can address{};
    address.can_family = AF_CAN;
    address.can_ifindex = static_cast<int>(index);
    if (::bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
        problem = errno == ENODEV ? "this interface is not a CAN interface"
                                  : std::string("cannot bind: ") + std::strerror(errno);
    else if (!interface_is_up(fd))
        problem = "the interface is down; bring it up: sudo ip link set up " + interface_;
    if (!problem.empty()) ::close(std::exchange(fd, -1));
    overflows_ = 0;
    return problem;
}

bool SocketCan::interface_is_up(int fd) const noexcept {
    ifreq request{};
    std::copy(interface_.begin(), interface_.end(), request.ifr_name);
    return ::ioctl(fd, SIOCGIFFLAGS, &request) == 0 && (request.ifr_flags & IFF_UP) != 0;
}

// A socket survives its interface going down, but not its removal; then a new one takes its number over.
bool SocketCan::reopen() noexcept {
    sockaddr_can address{};
    socklen_t length = sizeof address;
    const bool bound = ::getsockname(fd_, reinterpret_cast<sockaddr*>(&address), &length) == 0 &&
                       static_cast<unsigned>(address.can_ifindex) == if_nametoindex(interface_.c_str());
    if (bound && interface_is_up(fd_)) return true;
    if (bound) return false;
    int fresh = -1;
    if (!open_socket(fresh).empty()) return false;
    ::dup3(fresh, fd_, O_CLOEXEC);
    ::close(fresh);
    return true;
}

ReadResult SocketCan::read(std::span<Frame> frames, SharedCounters& counters, std::size_t& count) noexcept {
    constexpr std::size_t kBatch = 64;
    std::array<canfd_frame, kBatch> raw;
    std::array<iovec, kBatch> parts;
    struct Control {
        alignas(cmsghdr) char bytes[CMSG_SPACE(sizeof(scm_timestamping)) + CMSG_SPACE(sizeof(std::uint32_t))];
    };
    std::array<Control, kBatch> controls;
    std::array<mmsghdr, kBatch> messages{};
    const std::size_t wanted = std::min(kBatch, frames.size());
    for (std::size_t i = 0; i < wanted; ++i) {
        parts[i] = {&raw[i], sizeof raw[i]};
        messages[i].msg_hdr.msg_iov = &parts[i];
        messages[i].msg_hdr.msg_iovlen = 1;
        messages[i].msg_hdr.msg_control = controls[i].bytes;
        messages[i].msg_hdr.msg_controllen = sizeof controls[i].bytes;
    }
    count = 0;
    const int got = ::recvmmsg(fd_, messages.data(), static_cast<unsigned>(wanted), MSG_DONTWAIT, nullptr);
    if (got < 0)
        return errno == EAGAIN || errno == EINTR || errno == ENOBUFS ? ReadResult::ok : ReadResult::lost;

    ReadResult result = ReadResult::ok;
    for (std::size_t i = 0; i < static_cast<std::size_t>(got); ++i) {
        const std::size_t bytes = messages[i].msg_len;
        if (bytes != CAN_MTU && bytes != CANFD_MTU) {
            ++counters.malformed;
            continue;
        }
        Frame frame = from_kernel(raw[i], bytes);
        for (cmsghdr* c = CMSG_FIRSTHDR(&messages[i].msg_hdr); c; c = CMSG_NXTHDR(&messages[i].msg_hdr, c)) {
            if (c->cmsg_level != SOL_SOCKET) continue;
            if (c->cmsg_type == SO_TIMESTAMPING) {
                scm_timestamping stamps;
                std::memcpy(&stamps, CMSG_DATA(c), sizeof stamps);
                const std::int64_t software = to_ns(stamps.ts[0]), hardware = to_ns(stamps.ts[2]);
                frame.timestamp_ns =
                    (hardware_timestamps_ && hardware != 0) || software == 0 ? hardware : software;
            } else if (c->cmsg_type == SO_RXQ_OVFL) {
                std::uint32_t overflows = 0;
                std::memcpy(&overflows, CMSG_DATA(c), sizeof overflows);
                counters.receive_dropped += overflows - overflows_;
                overflows_ = overflows;
            }
        }
        if (frame.error) {
            ++counters.error_frames;
            if (raw[i].can_id & CAN_ERR_BUSOFF) result = ReadResult::bus_off;
            if (raw[i].can_id & CAN_ERR_RESTARTED) result = ReadResult::restarted;
            continue;
        }
        frames[count++] = frame;
    }
    return result;
}

SendResult SocketCan::write(const Frame& frame) noexcept {
    canfd_frame raw{};
    raw.can_id = frame.id | (frame.extended ? CAN_EFF_FLAG : 0) | (frame.remote ? CAN_RTR_FLAG : 0);
    raw.len = frame.length;
    raw.flags = frame.bit_rate_switch ? CANFD_BRS : 0;
    std::memcpy(raw.data, frame.data.data(), frame.length);
    if (frame.fd && !fd_frames_) return SendResult::full;
    const std::size_t bytes = frame.fd ? CANFD_MTU : CAN_MTU;
    const auto written = ::write(fd_, &raw, bytes);
    if (written == static_cast<ssize_t>(bytes)) return SendResult::ok;
    return errno == ENOBUFS || errno == EAGAIN ? SendResult::full : SendResult::lost;
}

}  // namespace shiftrig::io::can
