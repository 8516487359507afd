// A proportional valve in closed form: its outlet pressure, which no piston behind it changes.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "plant/description.h"

namespace shiftrig::reference {

// Pressure behind dead time, slew limit and second-order valve, for a command that changes at whole
// milliseconds: on each straight piece of the slewed command r(t) = r0 + c·s the valve answers
// p = r0 − 2ζc/ω + c·s + e^(−ζωs)(A cos ω_d s + B sin ω_d s), or with cosh and sinh where ζ > 1.
class ValvePressure {
  public:
    ValvePressure(const plant::ActuationHydraulic& h, double initial,
                  const std::vector<std::pair<double, double>>& commands)
        : zeta_(h.damping_ratio),
          omega_(h.natural_frequency),
          damped_(omega_ * std::sqrt(std::abs(1 - zeta_ * zeta_))),
          faded_(40 / (omega_ * (zeta_ < 1 ? zeta_ : zeta_ - std::sqrt(zeta_ * zeta_ - 1)))) {
        double r = initial, p = initial, rate = 0, t = -1e9;
        pieces_.push_back(piece(t, r, 0, p, rate));
        for (std::size_t i = 0; i < commands.size(); ++i) {
            const double from = commands[i].first + h.dead_time;
            const double until = i + 1 < commands.size() ? commands[i + 1].first + h.dead_time : 1e9;
            const double target = commands[i].second;
            advance(from, t, r, p, rate);
            const double slope = target > r ? h.slew : -h.slew;
            const double arrival = from + std::abs(target - r) / h.slew;
            if (target != r || pieces_.back().slope != 0)
                pieces_.push_back(piece(from, r, target != r ? slope : 0, p, rate));
            if (target != r && arrival < until) {
                advance(arrival, t, r, p, rate);
                r = target;
                pieces_.push_back(piece(arrival, r, 0, p, rate));
            }
        }
    }
    double at(double t) const { return value(piece_at(t), t); }
    double rate(double t) const { return rate(piece_at(t), t); }  // [Pa/s]
    void breaks(std::vector<double>& list) const {
        for (const auto& p : pieces_)
            if (p.from > 0) list.push_back(p.from);
    }

  private:
    struct Piece {
        double from, r0, slope, a, b;
    };
    Piece piece(double from, double r, double slope, double p, double rate) const {
        const double a = p - (r - 2 * zeta_ * slope / omega_);
        return {from, r, slope, a, (rate - slope + zeta_ * omega_ * a) / damped_};
    }
    const Piece& piece_at(double t) const {
        return *std::prev(std::upper_bound(pieces_.begin(), pieces_.end(), t,
                                           [](double time, const Piece& p) { return time < p.from; }));
    }
    // e^(−ζωs) cos ω_d s and e^(−ζωs) sin ω_d s, or cosh and sinh; 0 where nothing is left of them.
    std::pair<double, double> modes(double s) const {
        if (s > faded_) return {0, 0};
        const double decay = zeta_ * omega_;
        if (zeta_ < 1) {
            const double e = std::exp(-decay * s);
            return {e * std::cos(damped_ * s), e * std::sin(damped_ * s)};
        }
        const double slow = std::exp((damped_ - decay) * s), fast = std::exp((-damped_ - decay) * s);
        return {0.5 * (slow + fast), 0.5 * (slow - fast)};
    }
    double value(const Piece& p, double t) const {
        const double s = t - p.from;
        const auto [c, d] = modes(s);
        return p.r0 - 2 * zeta_ * p.slope / omega_ + p.slope * s + p.a * c + p.b * d;
    }
    double rate(const Piece& p, double t) const {
        const auto [c, d] = modes(t - p.from);
        const double turn = zeta_ < 1 ? -damped_ : damped_;  // cos' = −sin, cosh' = sinh
        return p.slope + (damped_ * p.b - zeta_ * omega_ * p.a) * c + (turn * p.a - zeta_ * omega_ * p.b) * d;
    }
    void advance(double to, double& t, double& r, double& p, double& speed) const {
        const Piece& last = pieces_.back();
        r = last.r0 + last.slope * (to - last.from);
        p = value(last, to);
        speed = rate(last, to);
        t = to;
    }

    double zeta_, omega_, damped_;
    double faded_;  // [s] after which nothing is left of what a piece began with
    std::vector<Piece> pieces_;
};

}  // namespace shiftrig::reference
