// The run of the reference solver: fourth-order Runge–Kutta steps, events between them, energy beside them.
#include <algorithm>
#include <cmath>

#include "tests/plant/reference/solver.h"

namespace shiftrig::reference {

Solver::Energy Solver::power(When when, const Vector& state, const Vector& force) {
    const auto omega = state.head(system_.masses);
    Energy p;
    for (std::size_t i = 0; i < system_.sources.size(); ++i) {
        const auto& source = system_.sources[i];
        const double w = omega[system_.source_mass[i]];
        p.input += w * (evaluate(source.waveform, when) - source.quadratic * w * std::abs(w));
    }
    if (system_.law_input) p.input += system_.law_input(when, state);
    p.dissipated = omega.dot(system_.damper * omega);
    for (int e = 0; e < system_.shafts; ++e) {
        const double rate = system_.shaft_columns.col(e).dot(omega);
        p.dissipated += system_.damping[e] * rate * rate;
    }
    for (std::size_t f = 0; f < system_.frictions.size(); ++f) {
        const double s = sign_of(mode.friction[f]);
        if (s == 0) continue;
        const double slip = system_.frictions[f].column.dot(omega);
        p.dissipated += s * slip * system_.frictions[f].slides(when, state, slip, s);
    }
    const Response* response = nullptr;
    for (std::size_t m = 0; m < system_.meshes.size(); ++m) {
        const auto& mesh = system_.meshes[m];
        if (!mesh.lossy() || mode.mesh[m] == Hold::held) continue;
        if (!response) response = &responses_.of(mode);
        const double loss = response->loss_torque.row(static_cast<Eigen::Index>(m)).dot(force) +
                            sign_of(mode.mesh[m]) * mesh.offset(mode.x[m]);
        p.dissipated += loss * mesh.relative.dot(omega);
    }
    return p;
}

double Solver::stored_energy() const {
    const auto omega = z.head(system_.masses);
    const auto twist = z.segment(system_.masses, system_.shafts);
    return 0.5 * omega.dot(system_.inertia.cwiseProduct(omega)) +
           0.5 * twist.dot(system_.stiffness.cwiseProduct(twist));
}

void Solver::rk4(double t, double inside, double h, Vector& out, Energy& energy) {
    const double weight[] = {h / 6, h / 3, h / 3, h / 6};
    energy = energy_;
    const auto stage = [&](int i, double time, const Vector& state, Vector& k) {
        rates({time, inside}, state, k);
        const Energy p = power({time, inside}, state, force_);
        energy.input += weight[i] * p.input;
        energy.dissipated += weight[i] * p.dissipated;
    };
    stage(0, t, z, k1_);
    stage_ = z + h / 2 * k1_;
    stage(1, t + h / 2, stage_, k2_);
    stage_ = z + h / 2 * k2_;
    stage(2, t + h / 2, stage_, k3_);
    stage_ = z + h * k3_;
    stage(3, t + h, stage_, k4_);
    out = z + h / 6 * (k1_ + 2 * k2_ + 2 * k3_ + k4_);
}

Solver::Rates Solver::fastest_rates() const {
    const Vector root = system_.inertia.cwiseSqrt().cwiseInverse();
    const Matrix a = root.asDiagonal() * system_.shaft_columns;
    Vector stiffness = system_.stiffness, damping = system_.damping;
    for (const auto& play : system_.plays) {
        stiffness[play.shaft] = play.stiffness;
        damping[play.shaft] = play.damping;
    }
    const Matrix k = a * stiffness.asDiagonal() * a.transpose();
    const Matrix d =
        a * damping.asDiagonal() * a.transpose() + root.asDiagonal() * system_.damper * root.asDiagonal();
    double fading = d.operatorNorm();
    for (const Friction& pair : system_.frictions)  // rising friction damps as well
        fading = std::max(fading, pair.steepest * (root.asDiagonal() * pair.column).squaredNorm());
    // What answers so fast only follows something slower: a quarter of it a step is 1e-5 of the answer off.
    return {std::sqrt(k.operatorNorm()), std::max(fading, 0.2 * system_.law_rate)};
}

Result Solver::run(double until, const Options& options) {
    Result result;
    const Rates rates = fastest_rates();
    result.fastest_rate = std::max(rates.swing, rates.decay);
    // A step of turn ωh leaves its phase off by (ωh)⁵/120.
    const double swing = std::max(rates.swing, 1e-9),
                 turn = std::pow(120 * options.phase / (swing * until), 0.25);
    const double largest =
        std::min({options.step, options.resolution / std::max(result.fastest_rate, 1e-9), turn / swing});
    const auto grid_points = static_cast<long>(std::lround(until / options.grid));
    std::size_t next_break = 0;
    double t = time_;
    long next_grid = std::lround(t / options.grid) + 1;
    Vector end;
    Energy energy;
    int events = 0;
    while (next_grid <= grid_points && !result.gave_up) {
        double stop = static_cast<double>(next_grid) * options.grid;
        while (next_break < system_.breaks.size() && system_.breaks[next_break] <= t + 1e-12) ++next_break;
        if (next_break < system_.breaks.size() && system_.breaks[next_break] < stop - 1e-12)
            stop = system_.breaks[next_break];
        const double inside = (t + stop) / 2;
        if (!begun_) {
            begin(inside);
            result.samples.push_back(sample({0, inside}));
            begun_ = true;
        } else {
            settle({t, inside});  // laws may have jumped
        }
        const auto steps = static_cast<long>(std::ceil((stop - t) / largest));
        const double from = t, h = (stop - t) / static_cast<double>(steps);
        for (long i = 0; i < steps && !result.gave_up; ++i) {
            double begin_time = from + static_cast<double>(i) * h;
            double left = h;
            for (;;) {
                rk4(begin_time, inside, left, end, energy);
                if (!violated({begin_time + left, inside}, end)) break;
                double low = 0, high = 1;
                for (int k = 0; k < 45; ++k) {
                    const double middle = (low + high) / 2;
                    rk4(begin_time, inside, middle * left, end, energy);
                    (violated({begin_time + middle * left, inside}, end) ? high : low) = middle;
                }
                rk4(begin_time, inside, high * left, end, energy);
                z = end;
                energy_ = energy;
                begin_time += high * left;
                left *= 1 - high;
                apply_violations({begin_time, inside});
                if (++events > options.event_limit) {
                    result.gave_up = true;
                    break;
                }
            }
            z = end;
            energy_ = energy;
            if (!z.allFinite()) result.gave_up = true;
        }
        t = stop;
        if (std::abs(t - static_cast<double>(next_grid) * options.grid) < 1e-12) {
            result.samples.push_back(sample({t, inside}));
            ++next_grid;
            if (system_.at_grid && system_.at_grid({t, inside}, z)) note(t, "", "law changes");
        }
    }
    time_ = t;
    result.changes = changes;
    result.shown = system_.shown;
    result.unresolved = unresolved;
    return result;
}

}  // namespace shiftrig::reference
