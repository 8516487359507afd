// Pistons behind their valves, at one pump, by what they do from instant to instant:
//
//     spring   p_s = preload + (p_return − preload) v/V
//     fills    v̇ = s Q    while p > p_s, or where keeping up with the valve would take more than s Q
//     empties  v̇ = −Q     while p < p_s, or where keeping up would take more than Q
//     follows  p_s = p     else, between its stops; empty where p < preload, full where p > p_return
//     pump     s = min(1, pump flow/Σ Q of those that fill)
//
// v is the oil behind the piston, V what it takes until the plates touch. A piston's motion is looked at every few
// microseconds, and where it does not last until the next look the instant is found by bisection, with the valve's own
// pressure in closed form: no more is assumed about it than that nothing happens twice between two looks.
#pragma once

#include <memory>
#include <vector>

#include "tests/plant/reference/system.h"
#include "tests/plant/reference/valve.h"

namespace shiftrig::reference {

struct Piston {
    std::shared_ptr<const ValvePressure> valve;
    double preload = 0, full_pressure = 0;  // of its spring, empty and full: p_return [Pa]
    double volume = 0, flow = 0;            // V [m³], Q [m³/s]
};

class Pistons {
  public:
    // At rest at time 0. pump_flow 0: as much as they ask for.
    Pistons(std::vector<Piston> pistons, double pump_flow, double until);
    // What presses the plates, above p_return.
    double chamber(std::size_t piston, When when) const;
    bool is_full(std::size_t piston, double inside) const;
    // Where their motions change: pressures jump or bend.
    void breaks(std::vector<double>& list) const;

  private:
    enum class Does { stands_empty, stands_full, fills, empties, follows };
    struct Piece {  // of a piston's course, until the next one
        double from, volume;
        Does does;
        double flow;  // v̇ where it fills or empties
    };
    // Negative where it does not go on as it does; of any unit.
    double margin(std::size_t piston, double t) const;
    double volume(const Piston& piston, const Piece& piece, double t) const;
    double flow_to_follow(const Piston& piston, double t) const;
    Does after(const Piston& piston, Does before, double t, double& volume) const;
    void begin(std::size_t piston, double t, double volume, Does does);
    bool lasts(double t) const;
    void change(double t);
    void share(double t);

    std::vector<Piston> pistons_;
    double pump_flow_, share_ = 1;
    std::vector<std::vector<Piece>> courses_;
};

}  // namespace shiftrig::reference
