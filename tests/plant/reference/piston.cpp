#include "tests/plant/reference/piston.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace shiftrig::reference {
namespace {

constexpr double look = 2e-6;            // [s] from one to the next
constexpr double rounding = 1e-6;        // of pressures [Pa]
constexpr double flow_rounding = 1e-12;  // of a piston's flow

double spring(const Piston& p, double volume) {
    return p.preload + (p.full_pressure - p.preload) * volume / p.volume;
}
double balance(const Piston& p, double pressure) {
    if (pressure >= p.full_pressure) return p.volume;
    if (pressure <= p.preload) return 0;
    return p.volume * (pressure - p.preload) / (p.full_pressure - p.preload);
}

}  // namespace

Pistons::Pistons(std::vector<Piston> pistons, double pump_flow, double until)
    : pistons_(std::move(pistons)), pump_flow_(pump_flow), courses_(pistons_.size()) {
    for (std::size_t k = 0; k < pistons_.size(); ++k) {
        const Piston& p = pistons_[k];
        const double pressure = p.valve->at(0);
        begin(k, 0, balance(p, pressure),
              pressure >= p.full_pressure ? Does::stands_full
              : pressure <= p.preload     ? Does::stands_empty
                                          : Does::follows);
    }
    for (double t = 0; t < until;) {
        double step = look;
        if (!lasts(t + step)) {
            double low = 0;
            for (int i = 0; i < 50; ++i) {
                const double middle = (low + step) / 2;
                (lasts(t + middle) ? low : step) = middle;
            }
            t += step;
            change(t);
        } else {
            t += step;
        }
    }
}

void Pistons::begin(std::size_t piston, double t, double volume, Does does) {
    const double flow = pistons_[piston].flow;
    courses_[piston].push_back({t, volume, does,
                                does == Does::fills     ? share_ * flow
                                : does == Does::empties ? -flow
                                                        : 0});
}

double Pistons::volume(const Piston& p, const Piece& piece, double t) const {
    return piece.does == Does::follows ? balance(p, p.valve->at(t))
                                       : piece.volume + piece.flow * (t - piece.from);
}

// A spring of one pressure cannot be followed.
double Pistons::flow_to_follow(const Piston& p, double t) const {
    const double rate = p.valve->rate(t), rise = p.full_pressure - p.preload;
    if (rise > 0) return p.volume / rise * rate;
    return rate == 0 ? 0 : std::copysign(std::numeric_limits<double>::infinity(), rate);
}

double Pistons::margin(std::size_t piston, double t) const {
    const Piston& p = pistons_[piston];
    const Piece& now = courses_[piston].back();
    const double pressure = p.valve->at(t), v = volume(p, now, t);
    switch (now.does) {
        case Does::stands_full:
            return pressure - p.full_pressure + rounding;
        case Does::stands_empty:
            return p.preload - pressure + rounding;
        case Does::fills:
            return std::min(pressure - spring(p, v) + rounding, p.volume - v);
        case Does::empties:
            return std::min(spring(p, v) - pressure + rounding, v);
        case Does::follows:
            break;
    }
    const double flow = flow_to_follow(p, t), tolerance = flow_rounding * p.flow;
    return std::min({p.flow * share_ - flow + tolerance, p.flow + flow + tolerance,
                     p.full_pressure - pressure + rounding, pressure - p.preload + rounding});
}

bool Pistons::lasts(double t) const {
    for (std::size_t k = 0; k < pistons_.size(); ++k)
        if (margin(k, t) < 0) return false;
    return true;
}

Pistons::Does Pistons::after(const Piston& p, Does before, double t, double& volume) const {
    volume = std::clamp(volume, 0., p.volume);
    const bool full = volume >= p.volume, empty = volume <= 0;
    if (before == Does::fills && full && p.valve->at(t) > p.full_pressure) return Does::stands_full;
    if (before == Does::empties && empty && p.valve->at(t) < p.preload) return Does::stands_empty;
    // In balance, what comes next is decided by how fast the valve goes on.
    const double flow = flow_to_follow(p, t);
    if (full && flow > 0) return Does::stands_full;
    if (empty && flow < 0) return Does::stands_empty;
    if (flow > p.flow * share_) return Does::fills;
    if (flow < -p.flow) return Does::empties;
    return Does::follows;
}

void Pistons::change(double t) {
    for (std::size_t k = 0; k < pistons_.size(); ++k) {
        if (margin(k, t) >= 0) continue;
        const Piece& now = courses_[k].back();
        const Does before = now.does;
        double v = before == Does::follows ? balance(pistons_[k], pistons_[k].valve->at(t))
                                           : volume(pistons_[k], now, t);
        const Does next = after(pistons_[k], before, t, v);
        begin(k, t, v, next);
    }
    share(t);
}

// Those that can no longer follow at a new share fill as well, and take part of it.
void Pistons::share(double t) {
    for (std::size_t round = 0; round <= pistons_.size(); ++round) {
        double asked = 0;
        for (std::size_t k = 0; k < pistons_.size(); ++k)
            if (courses_[k].back().does == Does::fills) asked += pistons_[k].flow;
        const double now = pump_flow_ > 0 && asked > pump_flow_ ? pump_flow_ / asked : 1;
        if (now == share_) return;
        share_ = now;
        for (std::size_t k = 0; k < pistons_.size(); ++k) {
            const Piece& last = courses_[k].back();
            const double v = volume(pistons_[k], last, t);
            const bool left_behind =
                last.does == Does::follows && flow_to_follow(pistons_[k], t) > pistons_[k].flow * share_;
            if (last.does == Does::fills || left_behind) begin(k, t, v, Does::fills);
        }
    }
}

bool Pistons::is_full(std::size_t piston, double inside) const {
    const auto& course = courses_[piston];
    const auto next = std::upper_bound(course.begin(), course.end(), inside,
                                       [](double t, const Piece& p) { return t < p.from; });
    return next != course.begin() && std::prev(next)->does == Does::stands_full;
}

double Pistons::chamber(std::size_t piston, When when) const {
    const Piston& p = pistons_[piston];
    const auto& course = courses_[piston];
    const auto next = std::upper_bound(course.begin(), course.end(), when.inside,
                                       [](double t, const Piece& piece) { return t < piece.from; });
    const Piece& piece = next == course.begin() ? *next : *std::prev(next);
    const bool moves = piece.does == Does::fills || piece.does == Does::empties;
    return moves ? spring(p, volume(p, piece, when.t)) : p.valve->at(when.t);
}

void Pistons::breaks(std::vector<double>& list) const {
    for (const auto& course : courses_)
        for (const Piece& piece : course)
            if (piece.from > 0) list.push_back(piece.from);
}

}  // namespace shiftrig::reference
