// Hands the latest value from one writing thread to one reading thread, wait-free on both sides: three
// copies, of which the writer fills one, the reader holds one, and the third waits between them. Older
// values that nobody read are overwritten, which is what a command or a driver's lever wants.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <type_traits>

#include "rt/realtime.h"

namespace shiftrig::rt {

template <class T>
class LatestValue {
    static_assert(std::is_trivially_copyable_v<T>);

  public:
    explicit LatestValue(const T& initial = T{}) : copies_{Copy{initial}, Copy{initial}, Copy{initial}} {}

    void write(const T& value) SHIFTRIG_REALTIME {
        copies_[filling_].value = value;
        filling_ = middle_.exchange(filling_ | fresh, std::memory_order_acq_rel) & index_mask;
    }

    // The newest value written; refers to the reader's own copy until its next read().
    const T& read() SHIFTRIG_REALTIME {
        if (middle_.load(std::memory_order_relaxed) & fresh) {
            holding_ = middle_.exchange(holding_, std::memory_order_acq_rel) & index_mask;
        }
        return copies_[holding_].value;
    }
    // Whether read() would return something not yet seen.
    bool has_news() const SHIFTRIG_REALTIME { return middle_.load(std::memory_order_relaxed) & fresh; }

  private:
    static constexpr std::uint32_t fresh = 4, index_mask = 3;
    struct alignas(64) Copy {
        T value;
    };
    std::array<Copy, 3> copies_;
    alignas(64) std::atomic<std::uint32_t> middle_{1};
    alignas(64) std::uint32_t filling_ = 0;  // the writer's
    alignas(64) std::uint32_t holding_ = 2;  // the reader's
};

}  // namespace shiftrig::rt
