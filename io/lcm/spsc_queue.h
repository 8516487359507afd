// A queue between exactly two threads, one writing and one reading. Slots are filled and read in place;
// everything is allocated at construction, nothing ever waits.
#pragma once

#include <atomic>
#include <cstddef>
#include <vector>

namespace shiftrig::io::lcm {

template <class T>
class SpscQueue {
  public:
    explicit SpscQueue(std::size_t capacity) : slots_(capacity) {}

    // The slot to fill, to be handed over by publish(); null if the queue is full. Writer only.
    T* claim() noexcept {
        const std::size_t head = head_.load(std::memory_order_relaxed);
        return head - tail_.load(std::memory_order_acquire) < slots_.size() ? &slots_[head % slots_.size()]
                                                                            : nullptr;
    }
    void publish() noexcept { head_.fetch_add(1, std::memory_order_release); }

    // The oldest slot, to be given back by pop(); null if the queue is empty. Reader only.
    const T* front() const noexcept {
        const std::size_t tail = tail_.load(std::memory_order_relaxed);
        return tail != head_.load(std::memory_order_acquire) ? &slots_[tail % slots_.size()] : nullptr;
    }
    void pop() noexcept { tail_.fetch_add(1, std::memory_order_release); }

  private:
    std::vector<T> slots_;
    std::atomic<std::size_t> head_{0}, tail_{0};
};

}  // namespace shiftrig::io::lcm
