#include "rt/histogram.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>
#include <vector>

namespace shiftrig::rt {

std::int64_t Histogram::lower_edge(std::size_t cell) noexcept {
    if (cell < cells_per_octave) return static_cast<std::int64_t>(cell);
    const std::size_t octave = (cell >> cell_bits) - 1;
    return static_cast<std::int64_t>(((cell & (cells_per_octave - 1)) + cells_per_octave) << octave);
}

std::int64_t Histogram::percentile(double percent) const noexcept {
    if (count_ == 0) return 0;
    const auto wanted = std::max<std::int64_t>(
        1, static_cast<std::int64_t>(std::ceil(percent / 100 * static_cast<double>(count_) - 1e-9)));
    std::int64_t seen = 0;
    for (std::size_t i = 0; i < cells_.size(); ++i) {
        seen += cells_[i];
        if (seen >= wanted) return std::min(upper_edge(i), maximum_);
    }
    return maximum_;
}

std::int64_t Histogram::count_above(std::int64_t nanoseconds) const noexcept {
    const std::int64_t value = std::clamp<std::int64_t>(nanoseconds, -1, largest_value);
    std::int64_t sum = 0;
    for (std::size_t i = value < 0 ? 0 : cell(value) + 1; i < cells_.size(); ++i) sum += cells_[i];
    return sum;
}

Histogram Histogram::corrected(std::int64_t interval) const {
    Histogram result = *this;
    if (interval <= 0) return result;
    for (std::size_t i = cell(std::min(interval, largest_value)); i < cells_.size(); ++i) {
        if (cells_[i] == 0) continue;
        const std::int64_t value = std::min(upper_edge(i), maximum_);
        for (std::int64_t missing = value - interval; missing > 0; missing -= interval) {
            result.record(missing, cells_[i]);
        }
    }
    return result;
}

void Histogram::merge(const Histogram& other) noexcept {
    if (other.count_ == 0) return;
    for (std::size_t i = 0; i < cells_.size(); ++i) cells_[i] += other.cells_[i];
    minimum_ = count_ == 0 ? other.minimum_ : std::min(minimum_, other.minimum_);
    maximum_ = std::max(maximum_, other.maximum_);
    count_ += other.count_;
    sum_ += other.sum_;
}

std::string Histogram::percentiles() const {
    std::string text;
    for (const auto& [name, percent] :
         {std::pair{"p50 ", 50.0}, {", p90 ", 90.0}, {", p99 ", 99.0}, {", p99.9 ", 99.9}}) {
        text += name + format_duration(percentile(percent));
    }
    return text + ", max " + format_duration(maximum_) + " (" + std::to_string(count_) + ")";
}

std::string Histogram::picture(int width) const {
    if (count_ == 0) return "(nothing recorded)\n";
    // Three rows to an octave: edges at 2^(k/3).
    const auto row_of = [](std::int64_t value) {
        return static_cast<int>(
            std::floor(3 * std::log2(static_cast<double>(std::max<std::int64_t>(value, 1)))));
    };
    const int first = row_of(minimum_), last = row_of(maximum_);
    std::vector<std::int64_t> rows(static_cast<std::size_t>(last - first + 1), 0);
    for (std::size_t i = 0; i < cells_.size(); ++i) {
        if (cells_[i] == 0) continue;
        const int row = std::clamp(row_of(upper_edge(i)), first, last);
        rows[static_cast<std::size_t>(row - first)] += cells_[i];
    }
    const double fullest = std::log10(1.0 + static_cast<double>(*std::max_element(rows.begin(), rows.end())));
    std::string text;
    for (std::size_t k = 0; k < rows.size(); ++k) {
        const auto from =
            static_cast<std::int64_t>(std::llround(std::exp2((first + static_cast<double>(k)) / 3)));
        const int bar =
            static_cast<int>(std::lround(width * std::log10(1.0 + static_cast<double>(rows[k])) / fullest));
        char line[64];
        std::snprintf(line, sizeof line, "%9s %10lld ", format_duration(from).c_str(),
                      static_cast<long long>(rows[k]));
        text += line + std::string(static_cast<std::size_t>(rows[k] > 0 ? std::max(bar, 1) : 0), '#') + "\n";
    }
    return text;
}

std::string format_duration(std::int64_t nanoseconds) {
    double value = static_cast<double>(nanoseconds);
    const char* unit = "ns";
    for (const char* next : {"µs", "ms", "s"}) {
        if (std::abs(value) < 999.5) break;
        value /= 1000;
        unit = next;
    }
    char text[32];
    const int digits = unit[0] == 'n' || std::abs(value) >= 99.95 ? 0 : std::abs(value) >= 9.995 ? 1 : 2;
    std::snprintf(text, sizeof text, "%.*f %s", digits, value, unit);
    return text;
}

}  // namespace shiftrig::rt
