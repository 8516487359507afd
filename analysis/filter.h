// The filters of ride comfort, on uniformly sampled signals.
#pragma once

#include <span>
#include <vector>

namespace shiftrig::analysis {

// H(s) = (b0 + b1 s + b2 s²)/(a0 + a1 s + a2 s²) by the bilinear transform, s ← (Ω/tan(ΩT/2))·(1 − z⁻¹)/(1 + z⁻¹),
// so that the digital filter has the analogue one's gain at Ω exactly.
class Biquad {
  public:
    struct Analogue {
        double b0, b1, b2, a0, a1, a2;
    };
    // Sampling interval T [s]; matched at Ω [rad/s] < π/T.
    Biquad(const Analogue& analogue, double interval, double matched_at);
    // In place, begun in the steady state of the constant input x[0].
    void run(std::span<double> x) const;
    double gain(double frequency) const;  // |H| at a frequency [Hz]

  private:
    double b0_, b1_, b2_, a1_, a2_, interval_;
};

// Second-order Butterworth low-pass at `frequency` [Hz], run forward and backward: no phase lag, and the gain
// at `frequency` is the one-way gain squared, 1/2.
std::vector<double> low_pass(std::span<const double> x, double interval, double frequency);

// The frequency weighting W_d of ISO 2631-1 (horizontal vibration of a seated person), as its Annex A gives it:
// Butterworth band limits at 0.4 and 100 Hz, transition from acceleration to velocity at 2 Hz with Q = 0.63.
std::vector<double> weight_horizontal(std::span<const double> acceleration, double interval);
double weight_horizontal_gain(double frequency, double interval);  // of the digital filter, for checking

// Vibration dose value (∫ a⁴ dt)^¼ [m/s^1.75] of a weighted acceleration.
double vibration_dose(std::span<const double> weighted, double interval);

// Central differences; one-sided at the ends.
std::vector<double> derivative(std::span<const double> x, double interval);

}  // namespace shiftrig::analysis
