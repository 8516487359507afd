#include "io/can/udp_multicast.h"

#include <arpa/inet.h>
#include <linux/errqueue.h>
#include <unistd.h>

#include <bit>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <string_view>

namespace shiftrig::io::can {

// ---- MessagePack, as much as these maps need ---------------------------------------------------------------

namespace {

class Packer {
  public:
    explicit Packer(std::span<std::uint8_t> out) : out_(out) {}
    void byte(unsigned value) noexcept { out_[size_++] = static_cast<std::uint8_t>(value); }
    void big_endian(std::uint64_t value, int bytes) noexcept {
        for (int i = bytes - 1; i >= 0; --i) byte(static_cast<unsigned>(value >> (8 * i)) & 0xFFU);
    }
    void key(std::string_view name) noexcept {
        byte(0xA0U | static_cast<unsigned>(name.size()));
        for (const char c : name) byte(static_cast<unsigned char>(c));
    }
    void boolean(std::string_view name, bool value) noexcept {
        key(name);
        byte(value ? 0xC3 : 0xC2);
    }
    std::size_t size() const noexcept { return size_; }

  private:
    std::span<std::uint8_t> out_;
    std::size_t size_ = 0;
};

// One value of any type. Numbers as they are; bytes and text as a view into the datagram.
struct Value {
    enum class Kind { none, boolean, integer, real, text, bytes, other } kind = Kind::none;
    bool flag = false;
    std::int64_t integer = 0;
    double real = 0;
    std::span<const std::uint8_t> view;
};

class Unpacker {
  public:
    explicit Unpacker(std::span<const std::uint8_t> in) : in_(in) {}

    bool map(std::size_t& entries) noexcept {
        const unsigned type = byte();
        if ((type & 0xF0U) == 0x80)
            entries = type & 0x0FU;
        else if (type == 0xDE)
            entries = static_cast<std::size_t>(big_endian(2));
        else
            return false;
        return good_;
    }

    // Reads one value; containers are passed over, so deep that no stack is needed for them.
    Value value() noexcept {
        Value value = one();
        while (pending_ > 0 && good_) {
            --pending_;
            one();
        }
        pending_ = 0;
        return value;
    }
    bool good() const noexcept { return good_; }
    bool at_end() const noexcept { return at_ == in_.size(); }

  private:
    unsigned byte() noexcept {
        if (at_ >= in_.size()) {
            good_ = false;
            return 0xC0;
        }
        return in_[at_++];
    }
    std::uint64_t big_endian(int bytes) noexcept {
        std::uint64_t value = 0;
        for (int i = 0; i < bytes; ++i) value = (value << 8) | byte();
        return value;
    }
    Value view(Value::Kind kind, std::uint64_t length) noexcept {
        Value value;
        if (length > in_.size() - at_) {
            good_ = false;
            return value;
        }
        value.kind = kind;
        value.view = in_.subspan(at_, static_cast<std::size_t>(length));
        at_ += static_cast<std::size_t>(length);
        return value;
    }
    Value integer(std::int64_t number) noexcept {
        Value value;
        value.kind = Value::Kind::integer;
        value.integer = number;
        return value;
    }
    Value container(std::uint64_t values) noexcept {
        pending_ += values;
        if (pending_ > in_.size()) good_ = false;  // more values than bytes
        Value value;
        value.kind = Value::Kind::other;
        return value;
    }
    Value one() noexcept {
        using Kind = Value::Kind;
        const unsigned type = byte();
        if (type < 0x80) return integer(type);
        if (type < 0x90) return container(2 * (type & 0x0FU));
        if (type < 0xA0) return container(type & 0x0FU);
        if (type < 0xC0) return view(Kind::text, type & 0x1FU);
        if (type >= 0xE0) return integer(static_cast<std::int8_t>(type));
        Value value;
        switch (type) {
            case 0xC0:
                return value;
            case 0xC2:
            case 0xC3:
                value.kind = Kind::boolean;
                value.flag = type == 0xC3;
                return value;
            case 0xC4:
                return view(Kind::bytes, big_endian(1));
            case 0xC5:
                return view(Kind::bytes, big_endian(2));
            case 0xC6:
                return view(Kind::bytes, big_endian(4));
            case 0xCA:
                value.kind = Kind::real;
                value.real =
                    static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(big_endian(4))));
                return value;
            case 0xCB:
                value.kind = Kind::real;
                value.real = std::bit_cast<double>(big_endian(8));
                return value;
            case 0xCC:
                return integer(static_cast<std::int64_t>(big_endian(1)));
            case 0xCD:
                return integer(static_cast<std::int64_t>(big_endian(2)));
            case 0xCE:
                return integer(static_cast<std::int64_t>(big_endian(4)));
            case 0xCF:
                return integer(static_cast<std::int64_t>(big_endian(8)));
            case 0xD0:
                return integer(static_cast<std::int8_t>(big_endian(1)));
            case 0xD1:
                return integer(static_cast<std::int16_t>(big_endian(2)));
            case 0xD2:
                return integer(static_cast<std::int32_t>(big_endian(4)));
            case 0xD3:
                return integer(static_cast<std::int64_t>(big_endian(8)));
            case 0xD9:
                return view(Kind::text, big_endian(1));
            case 0xDA:
                return view(Kind::text, big_endian(2));
            case 0xDB:
                return view(Kind::text, big_endian(4));
            case 0xDC:
                return container(big_endian(2));
            case 0xDD:
                return container(big_endian(4));
            case 0xDE:
                return container(2 * big_endian(2));
            case 0xDF:
                return container(2 * big_endian(4));
            default:
                good_ = false;
                return value;  // extension types do not occur
        }
    }

    std::span<const std::uint8_t> in_;
    std::size_t at_ = 0;
    std::uint64_t pending_ = 0;
    bool good_ = true;
};

}  // namespace

std::size_t pack_udp_frame(const Frame& frame, double timestamp_s,
                           std::span<std::uint8_t> datagram) noexcept {
    Packer out(datagram);
    out.byte(0x8B);  // a map of eleven
    out.key("timestamp");
    out.byte(0xCB);
    out.big_endian(std::bit_cast<std::uint64_t>(timestamp_s), 8);
    out.key("arbitration_id");
    out.byte(0xCE);
    out.big_endian(frame.id, 4);
    out.boolean("is_extended_id", frame.extended);
    out.boolean("is_remote_frame", frame.remote);
    out.boolean("is_error_frame", frame.error);
    out.key("channel");
    out.byte(0xC0);
    out.key("dlc");
    out.byte(frame.length);
    out.key("data");
    const std::size_t bytes = frame.remote ? 0 : frame.length;
    out.byte(0xC4);
    out.byte(static_cast<unsigned>(bytes));
    for (std::size_t i = 0; i < bytes; ++i) out.byte(frame.data[i]);
    out.boolean("is_fd", frame.fd);
    out.boolean("bitrate_switch", frame.bit_rate_switch);
    out.boolean("error_state_indicator", false);
    return out.size();
}

bool unpack_udp_frame(std::span<const std::uint8_t> datagram, Frame& frame) noexcept {
    Unpacker in(datagram);
    std::size_t entries = 0;
    if (!in.map(entries)) return false;
    frame = Frame{};
    frame.extended = true;  // python-can's default
    std::int64_t id = -1, dlc = -1;
    std::span<const std::uint8_t> data;
    for (std::size_t i = 0; i < entries && in.good(); ++i) {
        const Value key = in.value();
        const Value value = in.value();
        if (!in.good() || key.kind != Value::Kind::text) return false;
        const std::string_view name(reinterpret_cast<const char*>(key.view.data()), key.view.size());
        if (name == "arbitration_id" && value.kind == Value::Kind::integer) id = value.integer;
        if (name == "dlc" && value.kind == Value::Kind::integer) dlc = value.integer;
        if (name == "data" && value.kind == Value::Kind::bytes) data = value.view;
        if (name == "timestamp" && value.kind == Value::Kind::real && value.real > 0 && value.real < 9e9)
            frame.timestamp_ns = static_cast<std::int64_t>(value.real * 1e9);
        if (value.kind != Value::Kind::boolean) continue;
        if (name == "is_extended_id") frame.extended = value.flag;
        if (name == "is_remote_frame") frame.remote = value.flag;
        if (name == "is_error_frame") frame.error = value.flag;
        if (name == "is_fd") frame.fd = value.flag;
        if (name == "bitrate_switch") frame.bit_rate_switch = value.flag;
    }
    if (!in.good() || !in.at_end()) return false;
    if (id < 0 || id > (frame.extended ? 0x1FFFFFFF : 0x7FF)) return false;
    if (data.size() > (frame.fd ? 64U : 8U)) return false;
    if (frame.fd && fd_length(static_cast<unsigned>(data.size())) != data.size()) return false;
    if (frame.remote && (dlc < 0 || dlc > 8 || frame.fd)) return false;
    frame.id = static_cast<std::uint32_t>(id);
    frame.length = static_cast<std::uint8_t>(frame.remote ? static_cast<std::size_t>(dlc) : data.size());
    if (!frame.remote && !data.empty()) std::memcpy(frame.data.data(), data.data(), data.size());
    return true;
}

// ---- the sockets ---------------------------------------------------------------------------------------------

UdpMulticast::UdpMulticast(std::string group, std::uint16_t port, int ttl)
    : group_(std::move(group)), port_(port), ttl_(ttl) {}

UdpMulticast::~UdpMulticast() {
    if (receiver_ >= 0) ::close(receiver_);
    if (sender_ >= 0) ::close(sender_);
}

UdpMulticast::UdpMulticast(UdpMulticast&& other) noexcept
    : group_(std::move(other.group_)),
      port_(other.port_),
      ttl_(other.ttl_),
      destination_(other.destination_),
      own_(other.own_),
      address_length_(other.address_length_),
      receiver_(std::exchange(other.receiver_, -1)),
      sender_(std::exchange(other.sender_, -1)) {}

void UdpMulticast::open() {
    const std::string name = "udpcan:" + group_ + ":" + std::to_string(port_);
    const auto fail = [&name](const std::string& what) {
        throw std::runtime_error(name + ": " + what + " (" + std::strerror(errno) + ")");
    };
    auto& v4 = reinterpret_cast<sockaddr_in&>(destination_);
    auto& v6 = reinterpret_cast<sockaddr_in6&>(destination_);
    bool multicast = false;
    if (::inet_pton(AF_INET, group_.c_str(), &v4.sin_addr) == 1) {
        multicast = IN_MULTICAST(ntohl(v4.sin_addr.s_addr));
        v4.sin_family = AF_INET;
        v4.sin_port = htons(port_);
        address_length_ = sizeof(sockaddr_in);
    } else if (::inet_pton(AF_INET6, group_.c_str(), &v6.sin6_addr) == 1) {
        multicast = IN6_IS_ADDR_MULTICAST(&v6.sin6_addr) != 0;
        v6.sin6_family = AF_INET6;
        v6.sin6_port = htons(port_);
        address_length_ = sizeof(sockaddr_in6);
    }
    if (!multicast)
        throw std::runtime_error(name + ": \"" + group_ +
                                 "\" is not a multicast address; python-can's is 239.74.163.2");
    const bool is_v4 = destination_.ss_family == AF_INET;
    const std::string advice =
        "no route for this group; for this machine alone: sudo ip link set lo multicast on && sudo ip " +
        std::string(is_v4 ? "" : "-6 ") + "route add " + group_ + (is_v4 ? "/32" : "/128") + " dev lo";

    const auto set = [](int fd, int level, int option, const auto& value) {
        return ::setsockopt(fd, level, option, &value, sizeof value) == 0;
    };
    receiver_ = ::socket(destination_.ss_family, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (receiver_ < 0) fail("cannot open a socket");
    set(receiver_, SOL_SOCKET, SO_REUSEADDR, 1);
    set(receiver_, SOL_SOCKET, SO_RXQ_OVFL, 1);
    set(receiver_, SOL_SOCKET, SO_TIMESTAMPNS, 1);
    set(receiver_, SOL_SOCKET, SO_RCVBUF, 4 << 20);
    // Bound to the group itself: datagrams for other groups on this port are not ours.
    if (::bind(receiver_, reinterpret_cast<const sockaddr*>(&destination_), address_length_) != 0)
        fail("cannot bind");
    bool joined = false;
    if (is_v4) {
        ip_mreqn request{};
        request.imr_multiaddr = v4.sin_addr;
        joined = set(receiver_, IPPROTO_IP, IP_ADD_MEMBERSHIP, request);
    } else {
        ipv6_mreq request{};
        request.ipv6mr_multiaddr = v6.sin6_addr;
        joined = set(receiver_, IPPROTO_IPV6, IPV6_JOIN_GROUP, request);
    }
    if (!joined) fail(advice);

    // A socket of its own for sending, so that our own frames can be told from everybody else's.
    sender_ = ::socket(destination_.ss_family, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (sender_ < 0) fail("cannot open a socket");
    if (is_v4)
        set(sender_, IPPROTO_IP, IP_MULTICAST_TTL, ttl_);
    else
        set(sender_, IPPROTO_IPV6, IPV6_MULTICAST_HOPS, ttl_);
    if (::connect(sender_, reinterpret_cast<const sockaddr*>(&destination_), address_length_) != 0)
        fail(advice);
    socklen_t length = sizeof own_;
    ::getsockname(sender_, reinterpret_cast<sockaddr*>(&own_), &length);
}

bool UdpMulticast::is_our_own(const sockaddr_storage& from) const noexcept {
    if (from.ss_family != own_.ss_family) return false;
    if (from.ss_family == AF_INET) {
        const auto& a = reinterpret_cast<const sockaddr_in&>(from);
        const auto& b = reinterpret_cast<const sockaddr_in&>(own_);
        return a.sin_port == b.sin_port && a.sin_addr.s_addr == b.sin_addr.s_addr;
    }
    const auto& a = reinterpret_cast<const sockaddr_in6&>(from);
    const auto& b = reinterpret_cast<const sockaddr_in6&>(own_);
    return a.sin6_port == b.sin6_port && std::memcmp(&a.sin6_addr, &b.sin6_addr, sizeof a.sin6_addr) == 0;
}

ReadResult UdpMulticast::read(std::span<Frame> frames, SharedCounters& counters,
                              std::size_t& count) noexcept {
    for (count = 0; count < frames.size();) {
        std::array<std::uint8_t, 1024> datagram;
        iovec part{datagram.data(), datagram.size()};
        alignas(cmsghdr) char control[CMSG_SPACE(sizeof(timespec)) + CMSG_SPACE(sizeof(std::uint32_t))];
        sockaddr_storage from{};
        msghdr message{};
        message.msg_name = &from;
        message.msg_namelen = sizeof from;
        message.msg_iov = &part;
        message.msg_iovlen = 1;
        message.msg_control = control;
        message.msg_controllen = sizeof control;
        const auto bytes = ::recvmsg(receiver_, &message, MSG_DONTWAIT);
        if (bytes < 0) break;
        timespec stamp{};
        for (cmsghdr* c = CMSG_FIRSTHDR(&message); c; c = CMSG_NXTHDR(&message, c)) {
            if (c->cmsg_level == SOL_SOCKET && c->cmsg_type == SO_TIMESTAMPNS) {
                std::memcpy(&stamp, CMSG_DATA(c), sizeof stamp);
            } else if (c->cmsg_level == SOL_SOCKET && c->cmsg_type == SO_RXQ_OVFL) {
                std::uint32_t overflows = 0;
                std::memcpy(&overflows, CMSG_DATA(c), sizeof overflows);
                counters.receive_dropped += overflows - overflows_;
                overflows_ = overflows;
            }
        }
        if (is_our_own(from)) continue;
        Frame& frame = frames[count];
        if ((message.msg_flags & MSG_TRUNC) != 0 ||
            !unpack_udp_frame({datagram.data(), static_cast<std::size_t>(bytes)}, frame)) {
            ++counters.malformed;
            continue;
        }
        if (frame.error) {
            ++counters.error_frames;
            continue;
        }
        frame.timestamp_ns = stamp.tv_sec * 1'000'000'000LL + stamp.tv_nsec;
        ++count;
    }
    return ReadResult::ok;
}

SendResult UdpMulticast::write(const Frame& frame) noexcept {
    timespec now{};
    ::clock_gettime(CLOCK_REALTIME, &now);
    std::array<std::uint8_t, 320> datagram;
    const double timestamp_s = static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
    const std::size_t bytes = pack_udp_frame(frame, timestamp_s, datagram);
    return ::send(sender_, datagram.data(), bytes, 0) == static_cast<ssize_t>(bytes) ? SendResult::ok
                                                                                     : SendResult::full;
}

}  // namespace shiftrig::io::can
