// A bounded wait-free queue from one thread to one other (moodycamel::ReaderWriterQueue), which never
// allocates after its construction and counts what did not fit.
#pragma once

#include <readerwriterqueue/readerwriterqueue.h>

#include <atomic>
#include <cstdint>
#include <type_traits>

#include "rt/realtime.h"

namespace shiftrig::rt {

template <class T>
class Queue {
    static_assert(std::is_trivially_copyable_v<T>, "the loop hands over plain values");

  public:
    // Holds at least `capacity` elements.
    explicit Queue(std::size_t capacity) : queue_(capacity) {}

    // The producer's side; false (and counted) if the queue is full.
    bool push(const T& value) SHIFTRIG_REALTIME {
        if (try_enqueue(value)) return true;
        dropped_.fetch_add(1, std::memory_order_relaxed);
        return false;
    }
    // The consumer's side; false if there is nothing.
    bool pop(T& value) SHIFTRIG_REALTIME { return try_dequeue(value); }

    std::int64_t dropped() const noexcept { return dropped_.load(std::memory_order_relaxed); }
    std::size_t size_approx() const noexcept { return queue_.size_approx(); }

  private:
    // The library's functions carry no mark; try_enqueue and try_dequeue neither allocate nor lock.
    SHIFTRIG_TRUSTED_BEGIN
    bool try_enqueue(const T& value) SHIFTRIG_REALTIME { return queue_.try_enqueue(value); }
    bool try_dequeue(T& value) SHIFTRIG_REALTIME { return queue_.try_dequeue(value); }
    SHIFTRIG_TRUSTED_END

    moodycamel::ReaderWriterQueue<T> queue_;
    std::atomic<std::int64_t> dropped_{0};
};

}  // namespace shiftrig::rt
