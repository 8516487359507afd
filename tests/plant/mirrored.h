// A machine and its mirror image: the sense of loads and motions does not matter.
#pragma once

#include "tests/plant/rig.h"

namespace shiftrig::plant {

// The same machine with every speed and every torque turned round.
inline Description mirrored(Description d) {
    for (Mass& mass : d.masses) mass.initial_speed = -mass.initial_speed;
    for (TorqueSource& source : d.sources) {
        for (Waveform::Piece& piece : source.waveform.pieces) {
            piece.offset = -piece.offset;
            piece.slope = -piece.slope;
            piece.amplitude = -piece.amplitude;
        }
    }
    return d;
}

// Events and final speeds of both.
struct Both {
    Both(const Description& d, double until, const BuildOptions& options = {})
        : forward(d, options), backward(mirrored(d), options) {
        forward.run(until);
        backward.run(until);
    }
    void expect_mirror_images() const {
        ASSERT_EQ(forward.events.size(), backward.events.size());
        for (std::size_t i = 0; i < forward.events.size(); ++i) {
            EXPECT_EQ(forward.events[i].kind, backward.events[i].kind) << i;
            EXPECT_EQ(forward.events[i].device, backward.events[i].device) << i;
            EXPECT_NEAR(forward.events[i].time, backward.events[i].time, 1e-9) << i;
        }
        for (std::size_t j = 0; j < forward.state.speeds().size(); ++j)
            EXPECT_NEAR(forward.state.speeds()[j], -backward.state.speeds()[j], 1e-9) << j;
    }
    Rig forward, backward;
};

}  // namespace shiftrig::plant
