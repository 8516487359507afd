// A function of time that a description prescribes; laws/waveform.h says what it is at a time.
#pragma once

#include <vector>

namespace shiftrig::plant {

// For self-contained reference problems: the sum of pieces, each
// offset + slope·(t − from) + amplitude·sin(2π·frequency·(t − phase_time)) on [from, until), 0 outside.
struct Waveform {
    struct Piece {
        double from = -1e300, until = 1e300;  // [s]
        double offset = 0, slope = 0;         // [unit], [unit/s]
        double amplitude = 0, frequency = 0;  // [unit], [Hz]
        double phase_time = 0;                // [s]
    };
    std::vector<Piece> pieces;
};

}  // namespace shiftrig::plant
