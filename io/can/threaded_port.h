// A CAN socket behind two threads and two queues, so that the loop never makes a system call: one thread reads
// and keeps the connection, one writes. `Socket` is a plain class:
//
//     void open();                                   throws std::runtime_error with the line for the user
//     bool reopen() noexcept;                        after `lost`: true once it works again
//     int fd() const noexcept;
//     ReadResult read(std::span<Frame>, SharedCounters&, std::size_t& count) noexcept;    non-blocking
//     SendResult write(const Frame&) noexcept;                                            non-blocking
#pragma once

#include <poll.h>
#include <readerwriterqueue/readerwriterqueue.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <optional>
#include <stdexcept>
#include <thread>
#include <utility>

#include "io/can/port.h"
#include "io/command_latency.h"

namespace shiftrig::io::can {

enum class ReadResult : std::uint8_t { ok, bus_off, restarted, lost };
enum class SendResult : std::uint8_t { ok, full, lost };

// PortCounters that several threads write.
struct SharedCounters {
    std::atomic<std::uint64_t> sent{0}, received{0}, send_dropped{0}, receive_dropped{0}, malformed{0},
        error_frames{0}, bus_off_events{0}, reconnects{0};
    PortCounters snapshot() const noexcept {
        return {sent,      received,     send_dropped,   receive_dropped,
                malformed, error_frames, bus_off_events, reconnects};
    }
};

template <class Socket>
class ThreadedPort final : public CanPort {
  public:
    ThreadedPort(std::string name, Socket socket)
        : name_(std::move(name)), socket_(std::move(socket)), inbox_(kQueueFrames), outbox_(kQueueFrames) {
        socket_.open();
        wake_ = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
        if (wake_ < 0) throw std::runtime_error(name_ + ": eventfd failed");
        touch(inbox_);
        touch(outbox_);
        reader_ = std::thread([this] { read_loop(); });
        writer_ = std::thread([this] { write_loop(); });
    }
    ~ThreadedPort() override {
        stop_ = true;
        const std::uint64_t one = 1;
        [[maybe_unused]] const auto written = ::write(wake_, &one, sizeof one);
        reader_.join();
        writer_.join();
        ::close(wake_);
    }
    ThreadedPort(const ThreadedPort&) = delete;
    ThreadedPort& operator=(const ThreadedPort&) = delete;

    // A sending thread that sleeps is woken (one futex call); nothing here allocates or waits.
    SHIFTRIG_TRUSTED_BEGIN
    bool send(std::int64_t, const Frame& frame) SHIFTRIG_REALTIME override {
        if (state_.load(std::memory_order_relaxed) != PortState::up || !outbox_.try_enqueue(frame)) {
            counters_.send_dropped.fetch_add(1, std::memory_order_relaxed);
            return false;
        }
        return true;
    }

    std::size_t receive(std::int64_t, std::span<Frame> frames) SHIFTRIG_REALTIME override {
        std::size_t count = 0;
        if (waited_ && !frames.empty()) {
            frames[count++] = *waited_;
            waited_.reset();
        }
        while (count < frames.size() && inbox_.try_dequeue(frames[count])) ++count;
        counters_.received.fetch_add(count, std::memory_order_relaxed);
        return count;
    }
    SHIFTRIG_TRUSTED_END

    bool wait(std::int64_t timeout_ns) noexcept override {
        if (waited_) return true;
        Frame frame;
        if (!inbox_.wait_dequeue_timed(frame, timeout_ns / 1000)) return false;
        waited_ = frame;
        return true;
    }

    PortState state() const SHIFTRIG_REALTIME override { return state_.load(std::memory_order_relaxed); }
    PortCounters counters() const SHIFTRIG_REALTIME override { return counters_.snapshot(); }
    bool next_command_latency(std::int64_t& latency_ns) SHIFTRIG_REALTIME override {
        return command_latencies_.next(latency_ns);
    }
    const std::string& description() const noexcept override { return name_; }

  private:
    static constexpr std::size_t kQueueFrames = 8192;
    using FrameQueue = moodycamel::BlockingReaderWriterQueue<Frame>;

    // All its memory is there before the loop begins, also where the machine does not let us lock it.
    static void touch(FrameQueue& queue) {
        Frame frame;
        while (queue.try_enqueue(frame)) continue;
        while (queue.try_dequeue(frame)) continue;
    }

    void read_loop() {
        std::array<Frame, 64> frames;
        while (!stop_) {
            if (state_ == PortState::down) {
                std::this_thread::sleep_for(std::chrono::milliseconds(20));
                if (!socket_.reopen()) continue;
                ++counters_.reconnects;
                state_ = PortState::up;
            }
            pollfd wanted[] = {{socket_.fd(), POLLIN, 0}, {wake_, POLLIN, 0}};
            if (::poll(wanted, 2, 200) <= 0) continue;
            if (wanted[0].revents == 0) continue;
            std::size_t count = 0;
            const ReadResult result = socket_.read(frames, counters_, count);
            for (std::size_t i = 0; i < count; ++i)
                if (!inbox_.try_enqueue(frames[i])) ++counters_.receive_dropped;
            if (result == ReadResult::lost) state_ = PortState::down;
            if (result == ReadResult::bus_off) {
                state_ = PortState::bus_off;
                ++counters_.bus_off_events;
            }
            if (result == ReadResult::restarted) state_ = PortState::up;
        }
    }

    void write_loop() {
        Frame frame;
        while (true) {
            if (!outbox_.wait_dequeue_timed(frame, std::chrono::milliseconds(100))) {
                if (stop_) return;  // and all that was queued has been written
                continue;
            }
            PortState up = PortState::up;
            const bool tried = state_ == up;
            const SendResult result = tried ? socket_.write(frame) : SendResult::lost;
            if (result == SendResult::ok) {
                ++counters_.sent;
                command_latencies_.sent(frame.answers_ns);
            } else {
                ++counters_.send_dropped;
            }
            // The kernel tells a socket's error once, to whoever comes first: the reader might never hear of it.
            if (tried && result == SendResult::lost) state_.compare_exchange_strong(up, PortState::down);
        }
    }

    std::string name_;
    Socket socket_;
    FrameQueue inbox_, outbox_;
    std::optional<Frame> waited_;  // taken out by wait(), the first that receive() returns
    SharedCounters counters_;
    CommandLatencies command_latencies_;
    std::atomic<PortState> state_{PortState::up};
    std::atomic<bool> stop_{false};
    int wake_ = -1;
    std::thread reader_, writer_;
};

}  // namespace shiftrig::io::can
