// Brute force: classical Runge–Kutta with steps of microseconds, every change of contact located by
// bisection, the mode after it found by trying combinations until one is consistent.
#pragma once

#include <string>
#include <vector>

#include "tests/plant/reference/modes.h"

namespace shiftrig::reference {

struct Options {
    double step = 5e-6;        // largest step [s]; refined where the machine is stiffer
    double resolution = 0.05;  // step·(fastest rate) stays below this
    double phase = 1e-6;       // by which the fastest swing may be off at the end of a run [rad]
    double grid = 1e-3;        // [s] of the samples
    int event_limit = 2000;    // beyond it the run is given up as chattering
};

struct Change {
    double time;
    std::string device, what;  // "locks", "slips +", "free", "mesh rests", …
};

// Left limits at one grid point.
struct Sample {
    double time = 0;
    Vector z;
    Vector friction_torque, mesh_torque, loss_torque;
    Vector shown;  // System::shown
    Mode mode;
    bool unique = true;                            // the torque split is
    double input = 0, dissipated = 0, stored = 0;  // [J], the first two since the start
};

struct Result {
    std::vector<Sample> samples;  // samples[i].time = i·grid
    std::vector<Change> changes;
    std::vector<System::Shown> shown;  // what Sample::shown holds
    double fastest_rate = 0;           // [1/s] the step was chosen for
    int unresolved = 0;                // instants at which no consistent combination was found
    bool gave_up = false;              // event limit or non-finite state
};

class Solver {
  public:
    explicit Solver(const System& system, Sharing sharing = Sharing::free);

    // Continues where the last run ended; the first begins at time 0 and samples it too.
    Result run(double until, const Options& options);
    // The pieces, for integrators of another kind: mode at an instant, rates in a mode, margins of a mode.
    void begin(double inside);
    void settle(When when);
    void rates(When when, const Vector& z, Vector& dz);
    // One entry per condition that must stay ≥ 0 for the mode to stay; fixed size.
    void margins(When when, const Vector& z, Vector& g);
    bool violated(When when, const Vector& z);
    void apply_violations(When when);  // after violated(): change states, join, settle
    Sample sample(When when);

    Vector z;
    Mode mode;
    std::vector<Change> changes;
    int unresolved = 0;

  private:
    struct Torques {
        Vector free;  // M̃
        Vector acceleration, mesh, loss, friction;
    };
    void solve(When when, const Vector& state, const Mode& trial, Torques& out);
    void free_torque(When when, const Vector& state, const Mode& trial, Vector& out);
    // Among the splits that no mass feels, one within what meshes at rest can lose that loads held friction devices
    // least for their capacity. What is at rest stays so as long as some split is within all limits.
    void share(When when, const Vector& state, const Mode& trial, const Response& response, Torques& torques);
    bool settle_meshes(When when);
    bool consistent(const Mode& trial, const Torques& torques);
    double worst_overload(When when, const Torques& torques, const Mode& trial, int* which);
    void engage_and_release(When when);
    void join();
    void note(double time, const std::string& device, const char* what);
    double acceleration_tolerance(const Vector& column, const Torques& torques) const;
    double speed_scale(const Vector& state) const;
    double twist(const System::Play& play, const Vector& state) const;
    double rate(const System::Play& play, const Vector& state) const;
    struct Energy {
        double input = 0, dissipated = 0;
    };
    void rk4(double t, double inside, double h, Vector& out, Energy& energy);
    // Power of the sources, and power lost in dampers, slipping pairs and meshes, at (when, state); force_
    // must hold M̃ of the same instant.
    Energy power(When when, const Vector& state, const Vector& force);
    double stored_energy() const;
    // Bounds on the eigenvalues of the free machine [1/s]; no mode with more constraints is faster.
    struct Rates {
        double swing, decay;
    };
    Rates fastest_rates() const;

    const System& system_;
    double time_ = 0;
    bool begun_ = false;
    Responses responses_;
    Torques work_;
    Energy energy_;
    std::map<const Response*, int> branch_;  // of share(): the one that worked last
    Vector force_, extra_, k1_, k2_, k3_, k4_, stage_, margins_;
};

}  // namespace shiftrig::reference
