// The state of everything that can change its state: friction pairs (the indicators λ of [Algin]), lossy meshes (their
// direction of motion s and of power flow x), flanks of shafts with play. One byte per device in the State block.
#pragma once

#include <cstdint>

namespace shiftrig::plant::detail {

// Friction pair. The sign of the slip speed belongs to the state: sliding friction keeps it for the step.
enum PairState : unsigned char { locked = 0, slips_forward = 1, slips_backward = 2, free_running = 3 };

constexpr bool slips(unsigned char pair) noexcept {
    return pair == slips_forward || pair == slips_backward;
}
constexpr double slip_sign(unsigned char pair) noexcept {
    constexpr double signs[] = {0, 1, -1, 0};
    return signs[pair];
}
constexpr unsigned char slipping(double sign) noexcept {
    return sign < 0 ? slips_backward : slips_forward;
}

// Lossy mesh: stuck, or moving with s = ±1 (of ω_first − ω_carrier) and x = ±1 (+1: the first link drives).
// A mesh without losses is always "moving, x = +1".
enum MeshState : unsigned char { stuck = 0, moves = 1, moves_backward = 2, driven = 4 };

constexpr double motion_sign(unsigned char mesh) noexcept {
    return 1. - (mesh & moves_backward);
}
constexpr int loss_exponent(unsigned char mesh) noexcept {
    constexpr signed char exponents[] = {0, 1, 0, 1, 0, -1, 0, -1};
    return exponents[mesh];
}
constexpr unsigned char moving(double sign, int x) noexcept {
    return static_cast<unsigned char>(moves | (sign < 0 ? moves_backward : 0) | (x < 0 ? driven : 0));
}

// Shaft with play: open, or pressed on one of its flanks.
enum FlankState : unsigned char { flanks_open = 0, flank_forward = 1, flank_backward = 2 };

constexpr double flank_side(unsigned char flank) noexcept {
    return flank == flank_forward ? 1. : flank == flank_backward ? -1. : 0.;
}
constexpr unsigned char closed_flank(double side) noexcept {
    return side > 0 ? flank_forward : side < 0 ? flank_backward : flanks_open;
}

}  // namespace shiftrig::plant::detail
