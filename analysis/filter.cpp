#include "analysis/filter.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

namespace shiftrig::analysis {

namespace {

constexpr double pi = std::numbers::pi;

double rad(double hertz) {
    return 2 * pi * hertz;
}

// Butterworth sections of second order, normalised s/ω.
Biquad::Analogue butterworth_low(double w) {
    return {1, 0, 0, 1, std::numbers::sqrt2 / w, 1 / (w * w)};
}
Biquad::Analogue butterworth_high(double w) {
    return {0, 0, 1 / (w * w), 1, std::numbers::sqrt2 / w, 1 / (w * w)};
}

std::vector<Biquad> sections_of_wd(double interval) {
    const double high_pass = rad(0.4), low_pass = rad(100), transition = rad(2), q = 0.63;
    std::vector<Biquad> sections{
        Biquad(butterworth_high(high_pass), interval, high_pass),
        Biquad({1, 1 / transition, 0, 1, 1 / (q * transition), 1 / (transition * transition)}, interval,
               transition)};
    // A slower sampling cannot hold the upper band limit, and has nothing above it either.
    if (low_pass < 0.9 * pi / interval) sections.emplace_back(butterworth_low(low_pass), interval, low_pass);
    return sections;
}

}  // namespace

Biquad::Biquad(const Analogue& h, double interval, double matched_at) : interval_(interval) {
    const double c = matched_at / std::tan(matched_at * interval / 2);
    const double a0 = h.a0 + h.a1 * c + h.a2 * c * c;
    b0_ = (h.b0 + h.b1 * c + h.b2 * c * c) / a0;
    b1_ = 2 * (h.b0 - h.b2 * c * c) / a0;
    b2_ = (h.b0 - h.b1 * c + h.b2 * c * c) / a0;
    a1_ = 2 * (h.a0 - h.a2 * c * c) / a0;
    a2_ = (h.a0 - h.a1 * c + h.a2 * c * c) / a0;
}

void Biquad::run(std::span<double> x) const {
    if (x.empty()) return;
    // Transposed direct form II; the state of a constant input x0 with output y0 = H(0)·x0.
    const double x0 = x[0], y0 = x0 * (b0_ + b1_ + b2_) / (1 + a1_ + a2_);
    double s2 = b2_ * x0 - a2_ * y0;
    double s1 = b1_ * x0 - a1_ * y0 + s2;
    for (double& value : x) {
        const double in = value, out = b0_ * in + s1;
        s1 = b1_ * in - a1_ * out + s2;
        s2 = b2_ * in - a2_ * out;
        value = out;
    }
}

double Biquad::gain(double frequency) const {
    const std::complex<double> z = std::exp(std::complex<double>(0, -rad(frequency) * interval_));
    return std::abs((b0_ + b1_ * z + b2_ * z * z) / (1.0 + a1_ * z + a2_ * z * z));
}

std::vector<double> low_pass(std::span<const double> x, double interval, double frequency) {
    std::vector<double> y(x.begin(), x.end());
    if (rad(frequency) >= pi / interval) return y;  // nothing above the cut-off can be in it
    const Biquad filter(butterworth_low(rad(frequency)), interval, rad(frequency));
    for (int pass = 0; pass < 2; ++pass) {
        filter.run(y);
        std::reverse(y.begin(), y.end());
    }
    return y;
}

std::vector<double> weight_horizontal(std::span<const double> acceleration, double interval) {
    std::vector<double> y(acceleration.begin(), acceleration.end());
    for (const Biquad& section : sections_of_wd(interval)) section.run(y);
    return y;
}

double weight_horizontal_gain(double frequency, double interval) {
    double gain = 1;
    for (const Biquad& section : sections_of_wd(interval)) gain *= section.gain(frequency);
    return gain;
}

double vibration_dose(std::span<const double> weighted, double interval) {
    double sum = 0;
    for (const double a : weighted) sum += a * a * a * a;
    return std::pow(sum * interval, 0.25);
}

std::vector<double> derivative(std::span<const double> x, double interval) {
    std::vector<double> y(x.size(), 0);
    for (std::size_t i = 0; i < x.size() && x.size() > 1; ++i) {
        const std::size_t before = i == 0 ? 0 : i - 1, after = std::min(i + 1, x.size() - 1);
        y[i] = (x[after] - x[before]) / (static_cast<double>(after - before) * interval);
    }
    return y;
}

}  // namespace shiftrig::analysis
