#include "io/lcm/endpoint.h"

#include <arpa/inet.h>
#include <lcm/lcm.h>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <ctime>

#include "io/number.h"

namespace shiftrig::io::lcm {

namespace {

// Some seconds of a 1 kHz loop should either side be held up that long.
constexpr std::size_t outgoing_capacity = 2048, incoming_capacity = 1024;
// LCM keeps 30 messages per handler by default and silently drops the rest of a burst.
constexpr int handler_queue = 1000;
constexpr int poll_ms = 50;

struct Address {
    std::string scheme, host;
    int port = 0;
};

// scheme://host:port?options
Address parse(const std::string& url) {
    Address address;
    const auto colon = url.find("://");
    if (colon == std::string::npos)
        throw EndpointError("lcm:" + url + ": is not an LCM URL; write udpm://239.255.76.67:7667?ttl=0");
    address.scheme = url.substr(0, colon);
    if (address.scheme == "memq" || address.scheme == "file")
        throw EndpointError("lcm:" + url + ": provider \"" + address.scheme +
                            "\" has no network behind it; use udpm or tcpq");
    if (address.scheme != "udpm" && address.scheme != "tcpq")
        throw EndpointError("lcm:" + url + ": unknown provider \"" + address.scheme +
                            "\"; LCM knows udpm and tcpq");
    const bool udp = address.scheme == "udpm";
    const std::string network = url.substr(colon + 3, url.find('?', colon) - colon - 3);
    const auto port_colon = network.rfind(':');
    address.host = network.substr(0, port_colon);
    if (address.host.empty()) address.host = udp ? "239.255.76.67" : "127.0.0.1";
    address.port = udp ? 7667 : 7700;
    if (port_colon != std::string::npos) {
        char* end = nullptr;
        const long port = std::strtol(network.c_str() + port_colon + 1, &end, 10);
        if (*end != '\0' || port < 1 || port > 65535)
            throw EndpointError("lcm:" + url + ": \"" + network.substr(port_colon + 1) +
                                "\" is not a port (1 to 65535)");
        address.port = static_cast<int>(port);
    }
    // LCM takes what is no number for the default, says so in a line without the URL and goes on.
    if (const auto option = url.find("ttl="); option != std::string::npos) {
        const std::string ttl = url.substr(option + 4, url.find('&', option) - option - 4);
        const auto hops = finite_number(ttl);
        if (!hops || *hops < 0 || *hops > 255 || *hops != std::floor(*hops))
            throw EndpointError("lcm:" + url + ": \"" + ttl + "\" is not a ttl (0 to 255)");
    }
    return address;
}

// A socket connected to the address, or the reason why not. For UDP nothing is sent: connecting only asks
// the kernel for a route.
int try_connect(int type, const sockaddr_in& to) {
    const int fd = ::socket(AF_INET, type | SOCK_CLOEXEC, 0);
    if (fd < 0) return errno;
    const int error = ::connect(fd, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0 ? 0 : errno;
    ::close(fd);
    return error;
}

// LCM itself notices too late, prints several lines and, for tcpq, aborts on the first receive.
void check_reachable(const std::string& url, const Address& address) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(address.port));
    if (address.scheme == "udpm") {
        if (::inet_pton(AF_INET, address.host.c_str(), &to.sin_addr) != 1 ||
            !IN_MULTICAST(ntohl(to.sin_addr.s_addr)))
            throw EndpointError("lcm:" + url + ": \"" + address.host +
                                "\" is not a multicast address (224.0.0.0 to 239.255.255.255)");
        const int error = try_connect(SOCK_DGRAM, to);
        if (error == ENETUNREACH || error == EHOSTUNREACH)
            throw EndpointError(
                "lcm:" + url +
                ": no route for multicast; run: sudo ip link set lo multicast on && sudo ip route add " +
                address.host + "/32 dev lo");
        if (error != 0) throw EndpointError("lcm:" + url + ": " + std::strerror(error));
        return;
    }
    addrinfo hints{}, *found = nullptr;
    hints.ai_family = AF_INET;
    hints.ai_socktype = SOCK_STREAM;
    if (const int error = ::getaddrinfo(address.host.c_str(), nullptr, &hints, &found); error != 0)
        throw EndpointError("lcm:" + url + ": host \"" + address.host + "\": " + ::gai_strerror(error));
    to.sin_addr = reinterpret_cast<const sockaddr_in*>(found->ai_addr)->sin_addr;
    ::freeaddrinfo(found);
    if (const int error = try_connect(SOCK_STREAM, to); error != 0)
        throw EndpointError("lcm:" + url + ": no LCM TCP server answers at " + address.host + ":" +
                            std::to_string(address.port) + " (" + std::strerror(error) +
                            "); start one first");
}

}  // namespace

Endpoint::Endpoint(const std::string& url, const std::vector<Subscription>& subscriptions)
    : url_(url.empty() ? "udpm://239.255.76.67:7667?ttl=0" : url),
      outgoing_(outgoing_capacity),
      incoming_(incoming_capacity) {
    check_reachable(url_, parse(url_));
    lcm_ = lcm_create(url_.c_str());
    if (!lcm_) throw EndpointError("lcm:" + url_ + ": LCM refuses this URL");
    sem_init(&to_send_, 0, 0);
    sem_init(&arrived_, 0, 0);
    for (const auto& subscription : subscriptions)
        listeners_.push_back({this, listeners_.size(), subscription});
    for (auto& listener : listeners_) {
        const auto handler = [](const lcm_recv_buf_t* buffer, const char*, void* user) {
            const auto* self = static_cast<const Listener*>(user);
            self->endpoint->take(*self, buffer->data, buffer->data_size, buffer->recv_utime);
        };
        auto* handle = lcm_subscribe(lcm_, listener.subscription.channel, handler, &listener);
        if (!handle) {
            lcm_destroy(lcm_);
            throw EndpointError("lcm:" + url_ + ": cannot listen to " + listener.subscription.channel);
        }
        lcm_subscription_set_queue_capacity(handle, handler_queue);
    }
    sender_ = std::thread([this] { run_sender(); });
    receiver_ = std::thread([this] { run_receiver(); });
}

Endpoint::~Endpoint() {
    stop_ = true;
    sem_post(&to_send_);
    sender_.join();
    receiver_.join();
    lcm_destroy(lcm_);
    sem_destroy(&to_send_);
    sem_destroy(&arrived_);
}

void Endpoint::take(const Listener& listener, const void* data, std::size_t size,
                    std::int64_t arrived_us) noexcept {
    std::uint64_t fingerprint = 0;
    for (std::size_t i = 0; i < 8 && i < size; ++i)
        fingerprint = fingerprint << 8 | static_cast<const std::uint8_t*>(data)[i];
    if (size != listener.subscription.size ||
        fingerprint != static_cast<std::uint64_t>(listener.subscription.fingerprint)) {
        refused_.fetch_add(1, std::memory_order_relaxed);
        return;
    }
    Message* slot = incoming_.claim();
    if (!slot) {
        receive_dropped_.fetch_add(1, std::memory_order_relaxed);
        return;
    }
    slot->subscription = listener.index;
    slot->size = size;
    slot->arrived_ns = arrived_us * 1000;
    std::memcpy(slot->bytes.data(), data, size);
    incoming_.publish();
    received_.fetch_add(1, std::memory_order_relaxed);
    sem_post(&arrived_);
}

void Endpoint::run_sender() {
    while (true) {
        while (sem_wait(&to_send_) != 0 && errno == EINTR) continue;
        const Outgoing* slot = outgoing_.front();
        if (!slot) {
            if (stop_) return;  // all that was queued before has gone out
            continue;
        }
        const int result =
            lcm_publish(lcm_, slot->channel, slot->bytes.data(), static_cast<unsigned>(slot->size));
        (result == 0 ? sent_ : send_failed_).fetch_add(1, std::memory_order_relaxed);
        if (result == 0) command_latencies_.sent(slot->answers_ns);
        outgoing_.pop();
    }
}

void Endpoint::run_receiver() {
    while (!stop_) {
        // Without its server tcpq has no file descriptor, and LCM's own waiting would abort on it.
        pollfd waiting{lcm_get_fileno(lcm_), POLLIN, 0};
        if (waiting.fd < 0) {
            std::this_thread::sleep_for(std::chrono::milliseconds(poll_ms));
            continue;
        }
        if (::poll(&waiting, 1, poll_ms) > 0 && lcm_handle(lcm_) != 0)
            std::this_thread::sleep_for(std::chrono::milliseconds(poll_ms));
    }
}

bool Endpoint::wait(std::int64_t timeout_ns) noexcept {
    timespec until;
    clock_gettime(CLOCK_MONOTONIC, &until);
    const std::int64_t nanoseconds = until.tv_nsec + timeout_ns;
    until.tv_sec += nanoseconds / 1'000'000'000;
    until.tv_nsec = nanoseconds % 1'000'000'000;
    while (!incoming_.front())
        if (sem_clockwait(&arrived_, CLOCK_MONOTONIC, &until) != 0 && errno != EINTR)
            return incoming_.front() != nullptr;
    return true;
}

EndpointCounters Endpoint::counters() const SHIFTRIG_REALTIME {
    const auto get = [](const auto& counter) { return counter.load(std::memory_order_relaxed); };
    return {get(sent_),     get(send_failed_), get(send_dropped_),
            get(received_), get(refused_),     get(receive_dropped_)};
}

}  // namespace shiftrig::io::lcm
