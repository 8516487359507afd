#include "tests/plant/reference/solver.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/plant/reference/linear_program.h"

namespace shiftrig::reference {
namespace {

constexpr double overload_tolerance = 1e-12;

Hold toward(double value) {
    return value < 0 ? Hold::minus : Hold::plus;
}

}  // namespace

Solver::Solver(const System& system, Sharing sharing)
    : z(system.start), system_(system), responses_(system, sharing) {
    if (z.size() < system.size()) z.conservativeResizeLike(Vector::Zero(system.size()));
    for (const auto& friction : system.frictions)
        mode.friction.push_back(friction.initially_held ? Hold::held : Hold::free);
    for (const auto& mesh : system.meshes) {
        const double w = mesh.relative.dot(z.head(system.masses));
        mode.mesh.push_back(!mesh.lossy() ? Hold::plus : w == 0 ? Hold::held : toward(w));
        mode.x.push_back(1);
        mode.at_rest.push_back(mesh.lossy() && w == 0);
    }
    for (const auto& play : system.plays) mode.flank.push_back(play.pressed(twist(play, z), rate(play, z)));
    force_ = Vector::Zero(system.masses);
    extra_ = Vector::Zero(system.extras);
}

double Solver::twist(const System::Play& play, const Vector& state) const {
    return state[system_.masses + play.shaft];
}
double Solver::rate(const System::Play& play, const Vector& state) const {
    return system_.shaft_columns.col(play.shaft).dot(state.head(system_.masses));
}

double Solver::speed_scale(const Vector& state) const {
    return std::max(1.0, state.head(system_.masses).lpNorm<Eigen::Infinity>());
}

void Solver::note(double time, const std::string& device, const char* what) {
    changes.push_back({time, device, what});
}

// ---- torques and rates in a mode ----------------------------------------------------------------------

void Solver::free_torque(When when, const Vector& state, const Mode& trial, Vector& out) {
    system_.force(when, state, out, extra_);
    for (std::size_t p = 0; p < system_.plays.size(); ++p) {
        const auto& play = system_.plays[p];
        out -= system_.shaft_columns.col(play.shaft) *
               play.torque(trial.flank[p], twist(play, state), rate(play, state));
    }
    for (std::size_t f = 0; f < system_.frictions.size(); ++f) {
        const double s = sign_of(trial.friction[f]);
        const auto& friction = system_.frictions[f];
        if (trial.friction[f] == Hold::free && friction.open)
            out -= friction.column * friction.open(friction.column.dot(state.head(system_.masses)));
        if (s == 0) continue;
        const double slip = friction.column.dot(state.head(system_.masses));
        out -= friction.column * (s * friction.slides(when, state, slip, s));
    }
    for (std::size_t m = 0; m < system_.meshes.size(); ++m) {
        const auto& mesh = system_.meshes[m];
        if (mesh.lossy() && trial.mesh[m] != Hold::held)
            out -= mesh.loss_column * (sign_of(trial.mesh[m]) * mesh.offset(trial.x[m]));
    }
}

void Solver::solve(When when, const Vector& state, const Mode& trial, Torques& out) {
    const Response& response = responses_.of(trial);
    free_torque(when, state, trial, out.free);
    out.acceleration.noalias() = response.acceleration * out.free;
    out.mesh.noalias() = response.mesh_torque * out.free;
    out.loss.noalias() = response.loss_torque * out.free;
    out.friction.noalias() = response.friction_torque * out.free;
    if (response.friction_freedom.cols() > 0) share(when, state, trial, response, out);
}

void Solver::share(When when, const Vector& state, const Mode& trial, const Response& response,
                   Torques& out) {
    // Unknowns: the use u of capacities, and how much of each change, forwards and backwards. The limits of a mesh at
    // rest, −f(−M) ≤ L ≤ f(M), f the larger of two lines, are one linear program for each choice of lines.
    const Eigen::Index ways = response.friction_freedom.cols(), unknowns = 1 + 2 * ways;
    std::vector<std::size_t> held_meshes, held_frictions;
    for (std::size_t m = 0; m < system_.meshes.size(); ++m)
        if (system_.meshes[m].lossy() && trial.mesh[m] == Hold::held) held_meshes.push_back(m);
    for (std::size_t f = 0; f < system_.frictions.size(); ++f)
        if (trial.friction[f] == Hold::held) held_frictions.push_back(f);
    const double scale = out.free.lpNorm<Eigen::Infinity>() + 1e-6;
    const auto rows = static_cast<Eigen::Index>(2 * held_frictions.size() + 2 * held_meshes.size());
    Matrix a = Matrix::Zero(rows, unknowns);
    Vector b(rows), cost = Vector::Zero(unknowns), x;
    cost[0] = 1;
    Eigen::Index row = 0;
    const auto limit = [&](const Eigen::RowVectorXd& change, double use, double room) {
        a.row(row).setZero();
        a(row, 0) = -use / scale;
        a.row(row).segment(1, ways) = change;
        a.row(row).segment(1 + ways, ways) = -change;
        b[row++] = room / scale;
    };
    for (const std::size_t f : held_frictions) {
        const auto k = static_cast<Eigen::Index>(f);
        const double holding = system_.frictions[f].holding(when, state);
        limit(response.friction_freedom.row(k), holding, -out.friction[k]);
        limit(-response.friction_freedom.row(k), holding, out.friction[k]);
    }
    const Eigen::Index first_mesh_row = row;
    const int branches = 1 << (2 * held_meshes.size());
    double best = std::numeric_limits<double>::infinity();
    Vector best_change;
    int& last = branch_[&response];
    for (int i = 0; i < branches && best > 1; ++i) {
        const int branch = i == 0 ? last : i - (i <= last);
        row = first_mesh_row;
        for (std::size_t j = 0; j < held_meshes.size(); ++j) {
            const auto& mesh = system_.meshes[held_meshes[j]];
            const auto k = static_cast<Eigen::Index>(held_meshes[j]);
            const int above = (branch >> (2 * j)) & 1 ? -1 : 1, below = (branch >> (2 * j + 1)) & 1 ? -1 : 1;
            const double rise = mesh.slope(above), fall = mesh.slope(below);
            limit(response.loss_freedom.row(k) - rise * response.mesh_freedom.row(k), 0,
                  rise * out.mesh[k] + mesh.offset(above) - out.loss[k]);
            limit(-response.loss_freedom.row(k) + fall * response.mesh_freedom.row(k), 0,
                  out.loss[k] - fall * out.mesh[k] + mesh.offset(below));
        }
        if (!linear_program(a, b, cost, x) || x[0] >= best) continue;
        best = x[0];
        best_change = x.segment(1, ways) - x.segment(1 + ways, ways);
        last = branch;
    }
    if (best_change.size() == 0) return;
    best_change *= scale;
    out.mesh += response.mesh_freedom * best_change;
    out.loss += response.loss_freedom * best_change;
    out.friction += response.friction_freedom * best_change;
}

void Solver::rates(When when, const Vector& state, Vector& dz) {
    const Response& response = responses_.of(mode);
    free_torque(when, state, mode, force_);
    dz.resize(system_.size());
    dz.head(system_.masses).noalias() = response.acceleration * force_;
    dz.segment(system_.masses, system_.shafts).noalias() =
        system_.shaft_columns.transpose() * state.head(system_.masses);
    dz.tail(system_.extras) = extra_;
}

// ---- the mode at an instant ----------------------------------------------------------------------------

double Solver::acceleration_tolerance(const Vector& column, const Torques& torques) const {
    const auto scale = column.cwiseAbs().cwiseProduct(torques.free.cwiseAbs()).cwiseQuotient(system_.inertia);
    return 1e-10 * scale.sum() + 1e-10 * column.cwiseAbs().dot(torques.acceleration.cwiseAbs()) + 1e-12;
}

bool Solver::consistent(const Mode& trial, const Torques& torques) {
    const double torque_tolerance = 1e-9 * (torques.free.lpNorm<Eigen::Infinity>() + 1e-6);
    for (std::size_t m = 0; m < system_.meshes.size(); ++m) {
        const auto& mesh = system_.meshes[m];
        const auto i = static_cast<Eigen::Index>(m);
        if (!mesh.lossy()) continue;
        if (trial.mesh[m] == Hold::held) {
            const double high = mesh.largest_loss(torques.mesh[i]),
                         low = -mesh.largest_loss(-torques.mesh[i]);
            if (torques.loss[i] < low - torque_tolerance || torques.loss[i] > high + torque_tolerance)
                return false;
            continue;
        }
        const double s = sign_of(trial.mesh[m]);
        if (mesh.efficiency * mesh.backward_efficiency < 1 &&
            trial.x[m] * (s * torques.mesh[i] - mesh.threshold()) < -torque_tolerance)
            return false;
        if (trial.at_rest[m] &&
            s * mesh.relative.dot(torques.acceleration) < -acceleration_tolerance(mesh.relative, torques))
            return false;
    }
    return true;
}

double Solver::worst_overload(When when, const Torques& torques, const Mode& trial, int* which) {
    double worst = 0;
    for (std::size_t f = 0; f < system_.frictions.size(); ++f) {
        if (trial.friction[f] != Hold::held) continue;
        const double torque = torques.friction[static_cast<Eigen::Index>(f)];
        // A freewheel without drag lets go at any torque of the wrong sign, but not at rounding.
        const double least = 1e-9 * (torques.free.lpNorm<Eigen::Infinity>() + 1e-6);
        const auto& friction = system_.frictions[f];
        const double limit =
            friction.is_free_side(torque) ? std::max(friction.drag, least) : friction.holding(when, z);
        const double ratio = std::abs(torque) / std::max(limit, 1e-300);
        if (ratio <= worst) continue;
        worst = ratio;
        if (which) *which = static_cast<int>(f);
    }
    return worst;
}

// Tries every combination of loss directions, and of held/released for meshes at rest; of the consistent
// ones takes the one that overloads held devices least, then the one nearest to the present mode.
bool Solver::settle_meshes(When when) {
    struct Option {
        Hold hold;
        int x;
    };
    std::vector<std::size_t> open;
    std::vector<std::vector<Option>> options;
    for (std::size_t m = 0; m < system_.meshes.size(); ++m) {
        if (!system_.meshes[m].lossy()) continue;
        std::vector<Option> list{{mode.mesh[m], mode.x[m]}};  // the present one first
        const auto offer = [&](Option o) {
            if (o.hold != list[0].hold || (o.hold != Hold::held && o.x != list[0].x)) list.push_back(o);
        };
        if (!mode.at_rest[m]) {
            offer({mode.mesh[m], -mode.x[m]});
        } else {
            offer({Hold::held, mode.x[m]});
            for (const Hold hold : {Hold::plus, Hold::minus})
                for (const int x : {1, -1}) offer({hold, x});
        }
        open.push_back(m);
        options.push_back(list);
    }
    Mode best = mode;
    double best_overload = std::numeric_limits<double>::infinity();
    int best_changes = 1000;
    std::vector<std::size_t> digit(open.size(), 0);
    Mode trial = mode;
    Torques torques;
    for (;;) {
        int differing = 0;
        for (std::size_t i = 0; i < open.size(); ++i) {
            const Option& option = options[i][digit[i]];
            trial.mesh[open[i]] = option.hold;
            trial.x[open[i]] = option.x;
            differing += digit[i] != 0;
        }
        solve(when, z, trial, torques);
        if (consistent(trial, torques)) {
            const double overload =
                std::max(1.0 + overload_tolerance, worst_overload(when, torques, trial, nullptr));
            // An event is located where the present combination is overloaded by no more than the tolerances.
            if (overload < best_overload - 1e-13 || (overload <= best_overload && differing < best_changes)) {
                best = trial;
                best_overload = overload;
                best_changes = differing;
            }
            if (differing == 0 && overload <= 1.0 + overload_tolerance) break;
        }
        std::size_t i = 0;
        while (i < digit.size() && ++digit[i] == options[i].size()) digit[i++] = 0;
        if (i == digit.size()) break;
    }
    const bool found = std::isfinite(best_overload);
    for (const std::size_t m : open) {
        if (best.mesh[m] != mode.mesh[m])
            note(when.t, system_.meshes[m].name, best.mesh[m] == Hold::held ? "mesh sticks" : "mesh moves");
        else if (best.x[m] != mode.x[m] && best.mesh[m] != Hold::held)
            note(when.t, system_.meshes[m].name, best.x[m] > 0 ? "link 1 drives" : "link 1 is driven");
    }
    mode = best;
    return found;
}

void Solver::engage_and_release(When when) {
    for (std::size_t f = 0; f < system_.frictions.size(); ++f) {
        const auto& friction = system_.frictions[f];
        const bool engaged = friction.holding(when, z) > 1e-12 * friction.nominal;
        if (engaged == (mode.friction[f] != Hold::free)) continue;
        const double slip = friction.column.dot(z.head(system_.masses));
        mode.friction[f] = !engaged ? Hold::free : std::abs(slip) <= 1e-9 ? Hold::held : toward(slip);
        note(when.t, friction.name, !engaged ? "free" : mode.friction[f] == Hold::held ? "locks" : "slips");
    }
}

// Puts the speeds onto the constraints of the mode, and holds whatever is thereby brought to rest too.
void Solver::join() {
    auto omega = z.head(system_.masses);
    const Matrix& projector = responses_.of(mode).projector;
    omega = (projector * omega).eval();
    const double small = 1e-10 * speed_scale(z);
    const auto pinned = [&](const Vector& column) {
        return (projector.transpose() * column).norm() < 1e-8 * column.norm() &&
               std::abs(column.dot(omega)) < small;
    };
    for (std::size_t f = 0; f < system_.frictions.size(); ++f)
        if (sign_of(mode.friction[f]) != 0 && pinned(system_.frictions[f].column))
            mode.friction[f] = Hold::held;
    for (std::size_t m = 0; m < system_.meshes.size(); ++m)
        if (system_.meshes[m].lossy() && !mode.at_rest[m] && pinned(system_.meshes[m].relative))
            mode.at_rest[m] = true;
}

void Solver::settle(When when) {
    engage_and_release(when);
    for (int pass = 0;; ++pass) {
        const bool found = settle_meshes(when);
        if (!found || pass == 60) {
            ++unresolved;
            note(when.t, "", found ? "no end of settling" : "no consistent mode");
            break;
        }
        solve(when, z, mode, work_);
        int worst = -1;
        if (worst_overload(when, work_, mode, &worst) > 1 + overload_tolerance) {
            const auto f = static_cast<std::size_t>(worst);
            mode.friction[f] = toward(system_.frictions[f].opens_towards(when, z, work_.friction[worst]));
            note(when.t, system_.frictions[f].name, "slips");
            continue;
        }
        bool closed = false;  // opened in this instant, then driven back by another device's opening
        for (std::size_t f = 0; f < system_.frictions.size() && !closed; ++f) {
            const double s = sign_of(mode.friction[f]);
            const auto& column = system_.frictions[f].column;
            if (s == 0 || std::abs(column.dot(z.head(system_.masses))) > 1e-10 * speed_scale(z)) continue;
            if (s * column.dot(work_.acceleration) >= -acceleration_tolerance(column, work_)) continue;
            mode.friction[f] = Hold::held;
            note(when.t, system_.frictions[f].name, "locks");
            closed = true;
        }
        if (!closed) break;
    }
    solve(when, z, mode, work_);
    for (std::size_t m = 0; m < system_.meshes.size(); ++m) {
        const auto& mesh = system_.meshes[m];
        if (!mode.at_rest[m] || mode.mesh[m] == Hold::held) continue;
        if (std::abs(mesh.relative.dot(work_.acceleration)) > acceleration_tolerance(mesh.relative, work_))
            mode.at_rest[m] = false;
    }
}

void Solver::begin(double inside) {
    for (std::size_t f = 0; f < mode.friction.size(); ++f)
        if (mode.friction[f] == Hold::held && system_.frictions[f].holding({0, inside}, z) <= 0)
            mode.friction[f] = Hold::free;
    join();
    settle({0, inside});
}

// ---- events ---------------------------------------------------------------------------------------------

void Solver::margins(When when, const Vector& state, Vector& g) {
    solve(when, state, mode, work_);
    g.resize(static_cast<Eigen::Index>(2 * system_.frictions.size() + 2 * system_.meshes.size() +
                                       system_.plays.size()));
    const double speed_tolerance = 1e-12 * speed_scale(state);
    // Twice what consistent() asks for: a mode it accepts is not left at once.
    const double torque_tolerance = 2e-9 * (work_.free.lpNorm<Eigen::Infinity>() + 1e-6);
    Eigen::Index i = 0;
    for (std::size_t f = 0; f < system_.frictions.size(); ++f) {
        const auto& friction = system_.frictions[f];
        const double holding = friction.holding(when, state);
        const double threshold = 1e-12 * friction.nominal;
        double first = 1, second = holding - threshold;
        if (mode.friction[f] == Hold::free)
            second = threshold - holding;
        else if (mode.friction[f] == Hold::held)
            first = friction.reserve(when, state, work_.friction[static_cast<Eigen::Index>(f)],
                                     2 * overload_tolerance) +
                    (friction.sense != 0 ? torque_tolerance : 0);
        else
            first =
                sign_of(mode.friction[f]) * friction.column.dot(state.head(system_.masses)) + speed_tolerance;
        g[i++] = first;
        g[i++] = second;
    }
    for (std::size_t m = 0; m < system_.meshes.size(); ++m) {
        const auto& mesh = system_.meshes[m];
        const auto k = static_cast<Eigen::Index>(m);
        double first = 1, second = 1;
        if (mesh.lossy() && mode.mesh[m] == Hold::held) {
            const double high = mesh.largest_loss(work_.mesh[k]), low = -mesh.largest_loss(-work_.mesh[k]);
            first = std::min(high - work_.loss[k], work_.loss[k] - low) + torque_tolerance;
        } else if (mesh.lossy()) {
            const double s = sign_of(mode.mesh[m]);
            first = mode.at_rest[m] ? 2 * acceleration_tolerance(mesh.relative, work_) -
                                          std::abs(mesh.relative.dot(work_.acceleration))
                                    : s * mesh.relative.dot(state.head(system_.masses)) + speed_tolerance;
            if (mesh.efficiency * mesh.backward_efficiency < 1)
                second = mode.x[m] * (s * work_.mesh[k] - mesh.threshold()) + torque_tolerance;
        }
        g[i++] = first;
        g[i++] = second;
    }
    for (std::size_t p = 0; p < system_.plays.size(); ++p) {
        const auto& play = system_.plays[p];
        g[i++] = play.margin(mode.flank[p], twist(play, state), rate(play, state)) +
                 1e-12 * (play.stiffness * play.half_gap + play.damping);
    }
}

bool Solver::violated(When when, const Vector& state) {
    margins(when, state, margins_);
    return (margins_.array() < 0).any();
}

// Closes pairs whose slip has just changed sign at (when, z) and brings the mode up to date.
void Solver::apply_violations(When when) {
    margins(when, z, margins_);
    const auto first_play = static_cast<std::size_t>(margins_.size()) - system_.plays.size();
    for (std::size_t p = 0; p < system_.plays.size(); ++p) {
        if (margins_[static_cast<Eigen::Index>(first_play + p)] >= 0) continue;
        const auto& play = system_.plays[p];
        mode.flank[p] = mode.flank[p] != 0 ? 0 : play.pressed(twist(play, z), rate(play, z));
        note(when.t, play.name, mode.flank[p] != 0 ? "closes" : "opens");
    }
    bool joined = false;
    for (std::size_t f = 0; f < system_.frictions.size(); ++f) {
        if (sign_of(mode.friction[f]) == 0 || margins_[static_cast<Eigen::Index>(2 * f)] >= 0) continue;
        mode.friction[f] = Hold::held;
        note(when.t, system_.frictions[f].name, "locks");
        joined = true;
    }
    const auto base = 2 * system_.frictions.size();
    for (std::size_t m = 0; m < system_.meshes.size(); ++m) {
        if (mode.mesh[m] == Hold::held || mode.at_rest[m] ||
            margins_[static_cast<Eigen::Index>(base + 2 * m)] >= 0)
            continue;
        // Joined by the same projection as everything that is held now.
        mode.at_rest[m] = true;
        mode.mesh[m] = Hold::held;
        note(when.t, system_.meshes[m].name, "mesh rests");
        joined = true;
    }
    if (joined) join();
    settle(when);
}

Sample Solver::sample(When when) {
    solve(when, z, mode, work_);
    Sample s;
    s.time = when.t;
    s.z = z;
    s.mode = mode;
    s.friction_torque = work_.friction;
    bool resting = false;
    for (std::size_t f = 0; f < system_.frictions.size(); ++f) {
        const double sign = sign_of(mode.friction[f]);
        if (mode.friction[f] == Hold::free && system_.frictions[f].open)
            s.friction_torque[static_cast<Eigen::Index>(f)] =
                system_.frictions[f].open(system_.frictions[f].column.dot(z.head(system_.masses)));
        if (sign != 0) {
            const double slip = system_.frictions[f].column.dot(z.head(system_.masses));
            s.friction_torque[static_cast<Eigen::Index>(f)] =
                sign * system_.frictions[f].slides(when, z, slip, sign);
            // Pushes against devices that hold: they share the load as their history has it.
            if (std::abs(slip) < 1e-9) resting = true;
        }
    }
    s.mesh_torque = work_.mesh;
    s.loss_torque = work_.loss;
    for (std::size_t m = 0; m < system_.meshes.size(); ++m)
        if (system_.meshes[m].lossy())
            s.loss_torque[static_cast<Eigen::Index>(m)] +=
                sign_of(mode.mesh[m]) * system_.meshes[m].offset(mode.x[m]);
    s.shown.resize(static_cast<Eigen::Index>(system_.shown.size()));
    for (std::size_t i = 0; i < system_.shown.size(); ++i)
        s.shown[static_cast<Eigen::Index>(i)] = system_.shown[i].value(when, z);
    s.input = energy_.input;
    s.dissipated = energy_.dissipated;
    s.stored = stored_energy();
    s.unique = !resting && responses_.of(mode).redundancy == 0 && responses_.of(mode).sound;
    // A lossy mesh that others hold at rest takes any loss within its limits.
    const Matrix& projector = responses_.of(mode).projector;
    for (std::size_t m = 0; m < system_.meshes.size(); ++m) {
        const auto& mesh = system_.meshes[m];
        if (!mesh.lossy() || mode.mesh[m] == Hold::held) continue;
        if ((projector.transpose() * mesh.relative).norm() < 1e-8 * mesh.relative.norm()) s.unique = false;
    }
    return s;
}

}  // namespace shiftrig::reference
