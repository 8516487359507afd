// The clock the loop runs by. A clock is any type with these two members, so that a test can hand the
// loop one that it scripts:
//
//     std::int64_t now() noexcept;                         // [ns], steady
//     void sleep_until(std::int64_t time) noexcept;        // may return early (a signal); the loop asks
//     again
#pragma once

#include <time.h>

#include <concepts>
#include <cstdint>

#include "rt/realtime.h"

namespace shiftrig::rt {

inline constexpr std::int64_t nanoseconds_per_second = 1'000'000'000;

template <class C>
concept Clock = requires(C clock, std::int64_t time) {
    { clock.now() } -> std::same_as<std::int64_t>;
    clock.sleep_until(time);
};

// CLOCK_MONOTONIC: never set, slewed at most; it runs on while the process is stopped.
struct SteadyClock {
    SHIFTRIG_TRUSTED_BEGIN  // clock_gettime does not enter the kernel
        std::int64_t
        now() const SHIFTRIG_REALTIME {
        timespec t{};
        clock_gettime(CLOCK_MONOTONIC, &t);
        return t.tv_sec * nanoseconds_per_second + t.tv_nsec;
    }
    SHIFTRIG_TRUSTED_END
    void sleep_until(std::int64_t time) const noexcept {
        const timespec t{time / nanoseconds_per_second, time % nanoseconds_per_second};
        clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr);
    }
};
static_assert(Clock<SteadyClock>);

}  // namespace shiftrig::rt
