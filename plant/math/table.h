// Piecewise-linear table over rising abscissae; constant beyond its ends.
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>
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

// The same table made ready for the step: no search, no division. Its range is cut into equal buckets, narrow enough that
// nearly all hold one knot at most; each knows the last knot not beyond its beginning.
class Curve {
  public:
    Curve() = default;
    explicit Curve(const Table& table) {
        constexpr double most_buckets = 1000;
        const std::size_t last = table.size() - 1;
        double narrowest = table[last].first - table[0].first;
        for (std::size_t i = 0; i < table.size(); ++i) {
            const double slope =
                i == last ? 0
                          : (table[i + 1].second - table[i].second) / (table[i + 1].first - table[i].first);
            knots_.push_back({table[i].first, table[i].second, slope});
            if (i < last) narrowest = std::fmin(narrowest, table[i + 1].first - table[i].first);
        }
        const double range = table[last].first - table[0].first;
        const double buckets = last == 0 ? 1 : std::fmin(std::ceil(range / narrowest), most_buckets);
        per_x_ = last == 0 ? 0 : buckets / range;
        most_ = buckets - 1;
        std::size_t passed = 0;
        for (double bucket = 0; bucket < buckets; ++bucket) {
            while (passed < last && knots_[passed + 1].x <= table[0].first + bucket / buckets * range)
                ++passed;
            first_.push_back(static_cast<unsigned short>(passed));
        }
        knots_.push_back({std::numeric_limits<double>::quiet_NaN(), 0, 0});  // nothing passes it
    }
    double at(double x) const noexcept {
        const Knot* knots = knots_.data();
        const double from_first = x - knots[0].x;
        if (!(from_first > 0)) return knots[0].y;
        const double bucket = from_first * per_x_;
        const Knot* knot = knots + first_[static_cast<std::size_t>(bucket < most_ ? bucket : most_)];
        while (x >= knot[1].x) ++knot;
        return knot->y + (x - knot->x) * knot->slope;
    }

  private:
    struct Knot {
        double x, y, slope;
    };
    std::vector<Knot> knots_;            // and one more to stop at
    std::vector<unsigned short> first_;  // by bucket
    double per_x_ = 0, most_ = 0;
};

inline double largest_value(const Table& table) noexcept {
    double largest = table[0].second;
    for (const auto& point : table)
        if (point.second > largest) largest = point.second;
    return largest;
}

}  // namespace shiftrig::plant
