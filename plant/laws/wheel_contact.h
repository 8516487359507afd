// Wheel on a road as a dry friction pair, [Algin] Fw: the wheel's rim against a translating body.
//
//     Δ = ω_wheel − v_body / r,    M on the wheel, F = M / r on the body,    SDM column (1, −1/r)
//     capacity = μ W r: sliding and static through DryFriction (friction.h)
//
//   Δ     slip speed seen at the wheel     rad/s, positive where the rim runs ahead of the road
//   M     torque of the contact            Nm on the wheel, positive where it brakes the wheel
//   r     rolling radius                   m
//   W     weight on the contact            N
//
// Source: [Algin] Fig. 11. Does not model: tyre elasticity, deformable soil (tyre.h does), side force.
#pragma once

namespace shiftrig::plant {

inline double wheel_slip_speed(double wheel_speed, double body_speed, double radius) noexcept {
    return wheel_speed - body_speed / radius;
}

// Torque capacity on the wheel for a friction coefficient and a weight.
inline double wheel_capacity(double coefficient, double weight, double radius) noexcept {
    return coefficient * weight * radius;
}

}  // namespace shiftrig::plant
