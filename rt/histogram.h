// A histogram of durations that allocates nothing and loses nothing: every power of two is cut into
// 128 equal cells, so that a percentile is exact to 1/128 (0.8 %) from 1 ns to 9.8 hours; count,
// smallest, largest and mean are exact. Recording is an addition in a fixed array.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "rt/realtime.h"

namespace shiftrig::rt {

class Histogram {
  public:
    // Negative durations (a deadline met early by a coarse clock) count as 0; beyond the range, as its end.
    void record(std::int64_t nanoseconds) SHIFTRIG_REALTIME { record(nanoseconds, 1); }
    void record(std::int64_t nanoseconds, std::int64_t times) SHIFTRIG_REALTIME {
        const std::int64_t value = nanoseconds < 0               ? 0
                                   : nanoseconds > largest_value ? largest_value
                                                                 : nanoseconds;
        cells_[cell(value)] += times;
        if (count_ == 0 || value < minimum_) minimum_ = value;
        if (value > maximum_) maximum_ = value;
        count_ += times;
        sum_ += static_cast<double>(value) * static_cast<double>(times);
    }

    std::int64_t count() const noexcept { return count_; }
    std::int64_t minimum() const noexcept { return minimum_; }                                // [ns]
    std::int64_t maximum() const noexcept { return maximum_; }                                // [ns]
    double mean() const noexcept { return count_ ? sum_ / static_cast<double>(count_) : 0; }  // [ns]
    // The least duration that at least `percent` of the recorded ones do not exceed [ns]: the upper edge
    // of its cell, never beyond maximum(). 0 if nothing was recorded.
    std::int64_t percentile(double percent) const noexcept;
    // How many were longer than `nanoseconds`, to the resolution of a cell (see cell_upper_edge).
    std::int64_t count_above(std::int64_t nanoseconds) const noexcept;

    // What a caller who asks every `interval` would have seen, where the recorder waited for the slow
    // answer before it asked again: to each duration d > interval are added d − interval, d − 2·interval, …
    // ("coordinated omission"). Lateness against absolute deadlines that counts skipped ticks needs none.
    Histogram corrected(std::int64_t interval) const;

    void merge(const Histogram& other) noexcept;
    void clear() noexcept { *this = Histogram{}; }

    // `p50 31 µs, p90 42 µs, p99 103 µs, p99.9 1.60 ms, max 5.02 ms (10000)`
    std::string percentiles() const;
    // Rows of bars over logarithmic durations, `width` characters for the fullest; bar length is
    // logarithmic in the count, so that the single worst tick is seen.
    std::string picture(int width = 50) const;

    static constexpr std::int64_t largest_value = (std::int64_t{1} << 45) - 1;
    // The largest duration that shares a cell with this one.
    static std::int64_t cell_upper_edge(std::int64_t nanoseconds) noexcept {
        return upper_edge(cell(nanoseconds));
    }

  private:
    static constexpr int cell_bits = 7;
    static constexpr std::size_t cells_per_octave = std::size_t{1} << cell_bits;
    static constexpr std::size_t octaves = 45 - cell_bits;

    // Values below 128 have a cell each; above, the leading 8 bits choose the cell.
    static std::size_t cell(std::int64_t value) noexcept {
        const auto v = static_cast<std::uint64_t>(value);
        if (v < cells_per_octave) return v;
        const int octave = 63 - __builtin_clzll(v) - cell_bits;
        return (static_cast<std::size_t>(octave) << cell_bits) + (v >> octave);
    }
    static std::int64_t lower_edge(std::size_t cell) noexcept;
    static std::int64_t upper_edge(std::size_t cell) noexcept { return lower_edge(cell + 1) - 1; }

    std::array<std::int64_t, cells_per_octave*(octaves + 1)> cells_{};
    std::int64_t count_ = 0, minimum_ = 0, maximum_ = 0;
    double sum_ = 0;
};

// "31 µs", "1.60 ms", "12.3 s": three significant digits.
std::string format_duration(std::int64_t nanoseconds);

}  // namespace shiftrig::rt
