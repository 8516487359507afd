// Piecewise-linear table over rising abscissae; constant beyond its ends.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace shiftrig::plant {

using Table = std::vector<std::pair<double, double>>;  // (x, y), x strictly rising, at least one point

inline double interpolate(const Table& table, double x) noexcept {
    const std::size_t n = table.size();
    if (!(x > table[0].first)) return table[0].second;
    for (std::size_t i = 1; i < n; ++i) {
        if (x < table[i].first) {
            const auto [x0, y0] = table[i - 1];
            const auto [x1, y1] = table[i];
            return y0 + (y1 - y0) * ((x - x0) / (x1 - x0));
        }
    }
    return table[n - 1].second;
}

// The same, with the last slope continued beyond the last point.
inline double extrapolate(const Table& table, double x) noexcept {
    const std::size_t n = table.size();
    if (n < 2 || !(x > table[n - 1].first)) return interpolate(table, x);
    const auto [x0, y0] = table[n - 2];
    const auto [x1, y1] = table[n - 1];
    return y1 + (y1 - y0) * ((x - x1) / (x1 - x0));
}

// The same table made ready for the step: no search, no division.
class Curve {
  public:
    Curve() = default;
    explicit Curve(const Table& table) {
        for (std::size_t i = 0; i < table.size(); ++i) {
            const bool last = i + 1 == table.size();
            x_.push_back(table[i].first);
            y_.push_back(table[i].second);
            slope_.push_back(
                last ? 0 : (table[i + 1].second - table[i].second) / (table[i + 1].first - table[i].first));
        }
    }
    double at(double x) const noexcept {
        const double* knots = x_.data();
        std::size_t passed = 0;  // the last knot not beyond x, or the first
        for (std::size_t left = x_.size(); left > 1;) {
            const std::size_t half = left / 2;
            passed += x >= knots[passed + half] ? half : 0;
            left -= half;
        }
        const double from = x - knots[passed];
        return y_[passed] + (from > 0 ? from : 0) * slope_[passed];
    }

  private:
    std::vector<double> x_, y_, slope_;
};

inline double largest_value(const Table& table) noexcept {
    double largest = table[0].second;
    for (const auto& point : table)
        if (point.second > largest) largest = point.second;
    return largest;
}

}  // namespace shiftrig::plant
