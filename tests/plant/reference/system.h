// The reference solver's own picture of a machine, read from plant::Description and from nothing else of
// the plant. It exists to contradict the engine: no operator, mode table or formula is shared with it.
//
// State z = [ω (one per mass); φ (one per shaft); extra (states of added laws)]. Two kinds of devices
// can hold their parts together:
//   Friction  slip w = columnᵀω, torque T on the first link, masses feel −column·T
//   Mesh      gear or row: columnᵀω = 0 always, torque M on link 1, masses feel −column·M − loss_column·L.
//             L is the loss torque: with s the sign of the relative motion s·f(s·M) while it moves, where
//             f(m) = (1 − η)·m + b if link 1 drives, (1 − 1/η')·m + b' if it is driven; at rest anything
//             between −f(−M) and f(M)
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "plant/description.h"

namespace shiftrig::reference {

using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;

// A time and an instant inside the smooth interval it bounds: laws that jump at t are taken from that side.
struct When {
    double t = 0;
    double inside = 0;
};

double evaluate(const plant::Waveform& waveform, When when);

struct Friction {
    std::string name;
    Vector column;
    double nominal = 0;   // [Nm] weight of the device where a torque split is not unique
    double steepest = 0;  // of a friction table over the slip [Nm s/rad]
    bool initially_held = false;
    // Capacities [Nm] ≥ 0; sliding depends on |slip|.
    std::function<double(When, const Vector& z, double slip)> sliding;
    std::function<double(When, const Vector& z)> holding;
    // A freewheel has these capacities in one sense, ±1, and in the other its drag in place of both.
    double sense = 0, drag = 0;
    // What passes over the slip while nothing presses the pair, if anything does.
    std::function<double(double slip)> open;

    bool is_free_side(double sign) const { return sense * sign < 0; }
    double slides(When when, const Vector& z, double slip, double sign) const {
        return is_free_side(sign) ? drag : sliding(when, z, slip);
    }
    // What a held device has left of its limit, and the sense in which it begins to slip at this torque.
    double reserve(When when, const Vector& z, double torque, double tolerance) const {
        const double limit = holding(when, z) * (1 + tolerance);
        return sense == 0 ? limit - std::abs(torque)
                          : std::min(limit - sense * torque, drag + sense * torque);
    }
    double opens_towards(When when, const Vector& z, double torque) const {
        return sense == 0                                                  ? torque
               : drag + sense * torque < holding(when, z) - sense * torque ? -sense
                                                                           : sense;
    }
};

struct Mesh {
    std::string name;
    double ratio = 0;
    double efficiency = 1, backward_efficiency = 1;  // η, η'
    double bearing = 0, backward_bearing = 0;        // b, b' [Nm]
    Vector column;                                   // kinematics
    Vector relative;                                 // ω_1 − ω_carrier = relativeᵀω
    Vector loss_column;                              // ratio·(e_2 − e_carrier)

    bool lossy() const {
        return efficiency < 1 || backward_efficiency < 1 || bearing > 0 || backward_bearing > 0;
    }
    // L = slope(x)·M + s·offset(x); x = +1 where link 1 drives, −1 where it is driven.
    double slope(int x) const { return 1 - (x > 0 ? efficiency : 1 / backward_efficiency); }
    double offset(int x) const { return x > 0 ? bearing : backward_bearing; }
    // s·M at which both branches of f meet: x = sign(s·M − threshold).
    double threshold() const {
        const double difference = efficiency - 1 / backward_efficiency;
        return difference == 0 ? 0.0 : (bearing - backward_bearing) / difference;
    }
    double largest_loss(double m) const {  // f(m)
        const int x = m >= threshold() ? 1 : -1;
        return slope(x) * m + offset(x);
    }
};

struct System {
    explicit System(const plant::Description& description);

    int masses = 0, shafts = 0, extras = 0;
    int size() const { return masses + shafts + extras; }
    std::vector<std::string> mass_names, shaft_names;
    Vector inertia;
    Matrix shaft_columns;  // masses × shafts
    Vector stiffness, damping;
    // A shaft with play has its twist among the shafts, at their end; its torque depends on the flank that is closed, ±1 or
    // 0, which belongs to the mode.
    struct Play {
        std::string name;
        int shaft;
        double stiffness, damping, half_gap;
        double torque(int flank, double twist, double rate) const {
            return flank == 0 ? 0 : stiffness * (twist - flank * half_gap) + damping * rate;
        }
        // The flank that presses, or would if it were closed.
        int pressed(double twist, double rate) const {
            for (const int flank : {1, -1})
                if (flank * twist >= half_gap && flank * torque(flank, twist, rate) > 0) return flank;
            return 0;
        }
        // Positive while the flank stays as it is.
        double margin(int flank, double twist, double rate) const {
            if (flank != 0) return flank * torque(flank, twist, rate);
            const auto open = [&](int side) {
                return std::max(stiffness * (half_gap - side * twist), -side * torque(side, twist, rate));
            };
            return std::min(open(1), open(-1));
        }
    };
    std::vector<Play> plays;
    Matrix damper;  // M̃ −= damper·ω
    std::vector<Friction> frictions;
    std::vector<Mesh> meshes;
    std::vector<plant::TorqueSource> sources;
    std::vector<int> source_mass;
    // Adds forces on the masses and fills the rates of the extra states (all of z may be read).
    std::function<void(When, const Vector& z, Vector& force, Eigen::Ref<Vector> extra_rate)> law;
    std::function<double(When, const Vector& z)> law_input;  // power that they bring in from outside [W]
    double law_rate = 0;  // [1/s] about no faster than this do they answer a motion
    // What is decided at whole milliseconds only: may change extra states, returns whether it did.
    std::function<bool(When, Vector& z)> at_grid;
    // What else is shown, and in which unit it is to be compared.
    enum class Unit {
        radian_per_second,
        radian,
        newton_metre,
        metre_per_second,
        newton,
        slip,
        joule,
        pascal,
        count
    };
    struct Shown {
        std::string name;
        Unit unit;
        bool smooth;
        std::function<double(When, const Vector& z)> value;
    };
    std::vector<Shown> shown;
    std::vector<double> breaks;  // times at which some law has a jump or a kink, sorted
    Vector start;

    // Torque on every mass except from meshes and friction devices.
    void force(When when, const Vector& z, Vector& out, Eigen::Ref<Vector> extra_rate) const;
    int mass(const std::string& name) const;
};

}  // namespace shiftrig::reference
