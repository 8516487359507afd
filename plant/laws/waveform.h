// Value of a prescribed waveform (description.h: Waveform) at a time, as a one-sided limit.
//
//     f(t) = Σ over active pieces of offset + slope (t − from) + amplitude sin(2π frequency (t − phase_time))
//
// A piece is active on [from, until); its left limit is taken on (from, until]. Times within rounding of an edge count as the
// edge, since n·h need not meet a decimal number exactly. No more than that: what follows an edge may be over sooner than
// one thinks, and its end must not be taken for the time before the edge.
// An open start (from = −1e300) has its slope reckoned from t = 0.
// Edges are breakpoints of the machine (ModelBuilder::breakpoints): no part of a step reaches across one, wherever it lies.
#pragma once

#include "plant/description.h"
#include "plant/math/elementary.h"

namespace shiftrig::plant {

enum class Side { left, right };  // limit from the past, from the future

// By how much a time may miss the number that is meant.
inline double time_rounding(double t) noexcept {
    return 4e-15 * (t < -1 ? -t : t > 1 ? t : 1);
}

inline double waveform(const Waveform& wave, double t, Side side = Side::right) noexcept {
    const double probe = side == Side::right ? t + time_rounding(t) : t - time_rounding(t);
    double sum = 0;
    for (const Waveform::Piece& piece : wave.pieces) {
        if (!(piece.from <= probe && probe < piece.until)) continue;
        const double start = piece.from > -1e299 ? piece.from : 0;
        sum += piece.offset + piece.slope * (t - start);
        if (piece.amplitude != 0) {
            const double turns = piece.frequency * (t - piece.phase_time);
            sum += piece.amplitude * sin(2 * pi * turns);
        }
    }
    return sum;
}

}  // namespace shiftrig::plant
