// A proportional valve without a piston, in closed form.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "plant/description.h"

namespace shiftrig::reference {

// Pressure behind dead time, slew limit and second-order valve, for a command that changes at whole
// milliseconds: on each straight piece of the slewed command r(t) = r0 + c·s the valve answers
// p = r0 − 2ζc/ω + c·s + e^(−ζωs)(A cos ω_d s + B sin ω_d s).
class ValvePressure {
  public:
    ValvePressure(const plant::ActuationHydraulic& h, double initial,
                  const std::vector<std::pair<double, double>>& commands)
        : zeta_(h.damping_ratio),
          omega_(h.natural_frequency),
          damped_(omega_ * std::sqrt(1 - zeta_ * zeta_)) {
        double r = initial, p = initial, rate = 0, t = -1e9;
        pieces_.push_back(piece(t, r, 0, p, rate));
        for (std::size_t i = 0; i < commands.size(); ++i) {
            const double from = commands[i].first + h.dead_time;
            const double until = i + 1 < commands.size() ? commands[i + 1].first + h.dead_time : 1e9;
            const double target = commands[i].second;
            advance(from, t, r, p, rate);
            const double slope = target > r ? h.slew : -h.slew;
            const double arrival = from + std::abs(target - r) / h.slew;
            if (target != r) pieces_.push_back(piece(from, r, slope, p, rate));
            if (target != r && arrival < until) {
                advance(arrival, t, r, p, rate);
                r = target;
                pieces_.push_back(piece(arrival, r, 0, p, rate));
            }
        }
    }
    double at(double t) const {
        auto next = std::upper_bound(pieces_.begin(), pieces_.end(), t,
                                     [](double time, const Piece& p) { return time < p.from; });
        return value(*std::prev(next), t);
    }
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
    double value(const Piece& p, double t) const {
        const double s = t - p.from;
        const double steady = p.r0 - 2 * zeta_ * p.slope / omega_ + p.slope * s;
        if (s * omega_ > 60) return steady;
        return steady +
               std::exp(-zeta_ * omega_ * s) * (p.a * std::cos(damped_ * s) + p.b * std::sin(damped_ * s));
    }
    void advance(double to, double& t, double& r, double& p, double& rate) const {
        const Piece& last = pieces_.back();
        const double s = to - last.from, e = s * omega_ > 60 ? 0 : std::exp(-zeta_ * omega_ * s);
        const double c = std::cos(damped_ * s), d = std::sin(damped_ * s);
        r = last.r0 + last.slope * s;
        p = value(last, to);
        rate = last.slope + e * ((damped_ * last.b - zeta_ * omega_ * last.a) * c -
                                 (damped_ * last.a + zeta_ * omega_ * last.b) * d);
        t = to;
    }

    double zeta_, omega_, damped_;
    std::vector<Piece> pieces_;
};

}  // namespace shiftrig::reference
