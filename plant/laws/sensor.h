// Speed pick-up on a toothed wheel, measuring the period between teeth, with its faults.
//
//     speed = m (2π/teeth) / Δt      m teeth seen since the last one of the previous reading, Δt between both
//     without a tooth the reading falls as (2π/teeth)/(time since the last one); below drop_out_speed it is 0
//
//   speed           what the controller gets              rad/s; unsigned unless the pick-up is directional
//   missing_teeth   that many teeth of each turn give no edge (fault)
//
// Order of faults: stuck holds the last output; otherwise + bias + noise; drop-out reads 0. The noise is a
// pure function of (seed, sensor, step), so that a replay gives the same bits.
// Source: usual period measurement (J1939 transmission ECUs).
// Does not model: tooth pitch errors, the pick-up's amplitude, timer resolution.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "plant/description.h"
#include "plant/math/elementary.h"

namespace shiftrig::plant {

struct SensorState {
    double position = 0;      // of the wheel [teeth], 0 … teeth
    double since_edge = 1e9;  // time since the last tooth seen; at first, of one that stands [s]
    double reading = 0;       // speed by the period [rad/s], signed only where directional
    double output = 0;        // after faults [rad/s]
};

struct SensorFaults {
    double bias = 0;   // [rad/s]
    double noise = 0;  // 1σ [rad/s]
    bool stuck = false;
    bool dropout = false;
    int missing_teeth = 0;  // per turn
};

namespace detail {

inline std::uint64_t mix(std::uint64_t x) noexcept {  // splitmix64 finaliser
    x ^= x >> 30;
    x *= 0xbf58476d1ce4e5b9ull;
    x ^= x >> 27;
    x *= 0x94d049bb133111ebull;
    return x ^ (x >> 31);
}

// The largest whole number not above x, |x| < 2^62.
inline std::int64_t whole_below(double x) noexcept {
    const auto whole = static_cast<std::int64_t>(x);
    return static_cast<double>(whole) > x ? whole - 1 : whole;
}

}  // namespace detail

// Normal deviate (mean 0, σ 1) of a seed, a stream and a count, by Box and Muller.
inline double noise(std::uint64_t seed, std::uint64_t stream, std::uint64_t count) noexcept {
    const std::uint64_t key = detail::mix(seed + 0x9e3779b97f4a7c15ull * (stream + 1));
    const std::uint64_t a = detail::mix(key + 0x9e3779b97f4a7c15ull * (2 * count + 1));
    const std::uint64_t b = detail::mix(key + 0x9e3779b97f4a7c15ull * (2 * count + 2));
    const double u = (static_cast<double>(a >> 11) + 0.5) * 0x1p-53;  // (0, 1)
    const double v = static_cast<double>(b >> 11) * 0x1p-53;
    return std::sqrt(-2 * log(u)) * cos(2 * pi * v);
}

inline double tooth_pitch(const SpeedSensor& p) noexcept {
    return 2 * pi / p.teeth;  // [rad]
}

// The pick-up over one step, with the wheel's speed at its start and end.
inline void advance_pickup(const SpeedSensor& p, SensorState& state, double begin, double end, double h,
                           int missing_teeth = 0) noexcept {
    if (p.ideal || p.teeth <= 0) {
        state.reading = end;
        return;
    }
    const double teeth = p.teeth;
    const double pitch = tooth_pitch(p);
    const double travel = 0.5 * (begin + end) * h / pitch;  // [teeth]
    const double from = state.position, to = from + travel;
    const bool forward = travel >= 0;
    const std::int64_t first = forward ? detail::whole_below(from) + 1 : -detail::whole_below(-from) - 1;
    const std::int64_t last = forward ? detail::whole_below(to) : -detail::whole_below(-to);
    const std::int64_t count = forward ? last - first + 1 : first - last + 1;
    std::int64_t seen = 0, last_seen = last;
    if (missing_teeth <= 0) {
        seen = count;
    } else {
        // Whole turns show all teeth but those; the edges of the last one are looked at one by one.
        const std::int64_t turns = count / p.teeth;
        const std::int64_t there = std::max(0, p.teeth - missing_teeth);
        seen = turns * there;
        for (std::int64_t i = std::max<std::int64_t>(0, count - p.teeth); there > 0 && i < count; ++i) {
            const std::int64_t edge = forward ? first + i : first - i;
            const std::int64_t tooth = ((edge % p.teeth) + p.teeth) % p.teeth;
            if (tooth < missing_teeth) continue;
            if (i >= turns * p.teeth) ++seen;
            last_seen = edge;
        }
    }
    if (seen > 0) {
        const double last_time = h * ((static_cast<double>(last_seen) - from) / travel);
        const double speed = static_cast<double>(seen) * pitch / (state.since_edge + last_time);
        state.reading = p.directional && !forward ? -speed : speed;
        state.since_edge = h - last_time;
    } else {
        state.since_edge += h;
        const double limit = pitch / state.since_edge;
        if (std::fabs(state.reading) > limit) state.reading = state.reading < 0 ? -limit : limit;
    }
    if (std::fabs(state.reading) < p.drop_out_speed) state.reading = 0;
    state.position = to >= 0 && to < teeth ? to : to - teeth * std::floor(to / teeth);
}

// Faults on top of the reading; returns (and keeps) the output. `deviate` is noise(…) or 0.
inline double sensor_output(SensorState& state, const SensorFaults& faults, double deviate) noexcept {
    if (!faults.stuck) state.output = state.reading + faults.bias + faults.noise * deviate;
    if (faults.dropout) return 0;
    return state.output;
}

}  // namespace shiftrig::plant
