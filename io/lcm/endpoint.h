// A connection to an LCM network with its own two threads. The loop only copies bytes into and out of
// preallocated queues; publishing (which can block for milliseconds) and receiving happen outside it.
#pragma once

#include <semaphore.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "io/command_latency.h"
#include "io/input_error.h"
#include "io/lcm/spsc_queue.h"
#include "plant/realtime.h"

typedef struct _lcm_t lcm_t;

namespace shiftrig::io::lcm {

// The network cannot be used as asked; what() is one line that says what to do.
class EndpointError : public InputError {
  public:
    using InputError::InputError;
};

inline constexpr std::size_t largest_message = 4096;  // encoded bytes; plant_info_t has 2.7 k

// What an end listens to. Messages with another fingerprint or size are refused before they are queued.
struct Subscription {
    const char* channel;
    std::int64_t fingerprint;
    std::size_t size;
};

struct Message {
    std::size_t subscription;  // index, as given to the constructor
    std::size_t size;
    std::int64_t arrived_ns;  // when LCM took it from the network [ns of CLOCK_REALTIME, whole µs]
    std::array<std::byte, largest_message> bytes;
};

struct EndpointCounters {
    std::uint64_t sent = 0;
    std::uint64_t send_failed = 0;   // refused by LCM or the kernel: interface gone, no server
    std::uint64_t send_dropped = 0;  // our queue was full: the send thread was held up
    std::uint64_t received = 0;
    std::uint64_t refused = 0;          // not the type that belongs on the channel
    std::uint64_t receive_dropped = 0;  // our queue was full: nobody read
};

class Endpoint {
  public:
    // `url` as LCM writes it: udpm://239.255.76.67:7667?ttl=0, tcpq://host:7700. Throws EndpointError.
    Endpoint(const std::string& url, const std::vector<Subscription>& subscriptions);
    ~Endpoint();
    Endpoint(const Endpoint&) = delete;
    Endpoint& operator=(const Endpoint&) = delete;

    // Encodes and queues a message for the send thread; false and counted if the queue is full. `channel`
    // must live as long as the endpoint; `answers_ns`: arrival of the command that this message is the first to
    // reflect, 0 if of none. Loop only.
    SHIFTRIG_TRUSTED_BEGIN  // generated encoders of fixed-size types, and a post that wakes the send thread
        template <class Type>
        bool send(const char* channel, const Type& message, std::int64_t answers_ns = 0) SHIFTRIG_REALTIME {
        Outgoing* slot = outgoing_.claim();
        if (!slot) {
            send_dropped_.fetch_add(1, std::memory_order_relaxed);
            return false;
        }
        slot->channel = channel;
        slot->answers_ns = answers_ns;
        slot->size = message.encode(slot->bytes.data(), 0, static_cast<int>(slot->bytes.size()));
        outgoing_.publish();
        sem_post(&to_send_);
        return true;
    }
    SHIFTRIG_TRUSTED_END

    // The oldest message received, null if there is none; pop() gives it back. Loop only.
    const Message* front() const SHIFTRIG_REALTIME { return incoming_.front(); }
    void pop() SHIFTRIG_REALTIME { incoming_.pop(); }
    // Blocks until front() has something, at most `timeout_ns`; false if it has not. Not for wall pace.
    bool wait(std::int64_t timeout_ns) noexcept;

    // From the arrival of a command to the sending of the message that answers it [ns]; false if there is none.
    bool next_command_latency(std::int64_t& latency_ns) SHIFTRIG_REALTIME {
        return command_latencies_.next(latency_ns);
    }

    EndpointCounters counters() const SHIFTRIG_REALTIME;
    const std::string& url() const noexcept { return url_; }

  private:
    struct Outgoing {
        const char* channel;
        std::int64_t answers_ns;
        int size;
        std::array<std::byte, largest_message> bytes;
    };
    struct Listener {  // what LCM's callback gets
        Endpoint* endpoint;
        std::size_t index;
        Subscription subscription;
    };
    void take(const Listener& listener, const void* data, std::size_t size, std::int64_t arrived_us) noexcept;
    void run_sender();
    void run_receiver();

    std::string url_;
    lcm_t* lcm_ = nullptr;
    std::vector<Listener> listeners_;
    SpscQueue<Outgoing> outgoing_;
    SpscQueue<Message> incoming_;
    CommandLatencies command_latencies_;
    sem_t to_send_, arrived_;
    std::atomic<bool> stop_{false};
    std::atomic<std::uint64_t> sent_{0}, send_failed_{0}, send_dropped_{0}, received_{0}, refused_{0},
        receive_dropped_{0};
    std::thread sender_, receiver_;
};

}  // namespace shiftrig::io::lcm
