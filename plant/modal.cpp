#include "plant/modal.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "plant/laws/tyre.h"
#include "plant/structure.h"

namespace shiftrig::plant {
namespace {

// Speed of mass `to` while mass `from` moves at 1, if the motions determine it.
std::optional<double> follows(const Eigen::MatrixXd& basis, const std::vector<double>& inertia, int from,
                              int to) {
    const auto scaled = [&](int j) -> Eigen::RowVectorXd {
        return basis.row(j) * std::sqrt(inertia[static_cast<std::size_t>(j)]);
    };
    if (basis.cols() == 0 || scaled(from).norm() < 1e-9) return std::nullopt;
    const Eigen::RowVectorXd a = scaled(from), b = scaled(to);
    const double share = a.dot(b) / a.squaredNorm();
    if ((b - share * a).norm() > 1e-9) return std::nullopt;  // it can move by itself
    return share * std::sqrt(inertia[static_cast<std::size_t>(from)] / inertia[static_cast<std::size_t>(to)]);
}

// The wheel that carries a translating mass, or the mass itself.
int wheel_of(const Description& d, const Structure& s, int mass) {
    const std::string& name = s.mass_names[static_cast<std::size_t>(mass)];
    for (const BrixiusTyre& tyre : d.tyres) {
        if (tyre.body == name) return s.mass(tyre.wheel);
    }
    for (const Clutch& clutch : d.clutches) {
        if (clutch.radius > 0 && clutch.b == name) return s.mass(clutch.a);
    }
    return mass;
}

void find_ratio(GearVariant& gear) {
    const Description& d = gear.description;
    const Structure s = build_structure(d);
    gear.tie_ups = tie_ups(rigid_set(d, s, gear.closed, rigid_alone), s.inertia);
    gear.blocked_by = output_held_by(d, s, gear.closed);
    const RigidSet set = rigid_set(d, s, gear.closed);
    const int input = s.mass(d.input_mass), output = s.mass(d.output_mass);
    if (input < 0 || output < 0) return;
    const Eigen::MatrixXd basis = motions(set, s.inertia);
    const auto out = follows(basis, s.inertia, input, wheel_of(d, s, output));
    if (out && std::fabs(*out) > 1e-12) gear.ratio = 1 / *out;
    for (std::size_t j = 0; j < d.masses.size() && !gear.metres_per_radian; ++j) {
        if (d.masses[j].motion != Motion::translating) continue;
        const auto travel = follows(basis, s.inertia, input, static_cast<int>(j));
        if (travel && std::fabs(*travel) > 1e-12) gear.metres_per_radian = travel;
    }
}

// The state with every combination of options: "F2/L", "F2/M", …
void add_combinations(const Description& description, const std::string& name,
                      const std::vector<std::string>& closed, std::vector<GearVariant>& variants) {
    GearVariant first;
    first.name = name;
    first.closed = closed;
    first.description = description;
    std::vector<GearVariant> combinations{first};
    for (std::size_t g = 0; g < description.gears.size(); ++g) {
        const Gear& gear = description.gears[g];
        if (gear.options.empty()) continue;
        std::vector<GearVariant> extended;
        for (const GearVariant& base : combinations) {
            for (const auto& [option, ratio] : gear.options) {
                GearVariant variant = base;
                variant.name += "/" + option;
                variant.options.emplace_back(gear.name, option);
                variant.description.gears[g].ratio = ratio;
                extended.push_back(std::move(variant));
            }
        }
        combinations = std::move(extended);
    }
    for (GearVariant& variant : combinations) {
        find_ratio(variant);
        variants.push_back(std::move(variant));
    }
}

// One spring of the linear system: shaft, damper (stiffness 0) or tyre.
struct Spring {
    std::string name;
    std::array<Link, 2> links;
    double stiffness = 0, damping = 0;
    double leak = 0;  // of its twist [1/s]
};

std::vector<Spring> springs_of(const Description& d, const Structure& s, const ModalOptions& options) {
    std::vector<Spring> springs;
    for (const Elastic& e : s.shafts) {
        if (e.gap > 0 && !options.closed_flanks) continue;
        springs.push_back({e.name, e.links, e.stiffness, e.damping, 0});
    }
    for (const Elastic& e : s.dampers) springs.push_back({e.name, e.links, 0, e.damping, 0});
    for (const BrixiusTyre& tyre : d.tyres) {
        const double slope = tyre_force_slope(tyre_soil(tyre, tyre.mobility_number));
        const double stiffness = slope * tyre.radius * tyre.radius / tyre.relaxation_length;
        const double speed = std::fabs(options.body_speed);
        const double damping = stiffness * tyre.slip_damping_time * tyre.relaxation_length /
                               (tyre.relaxation_length + tyre.slip_damping_time * speed);
        springs.push_back({tyre.name,
                           {Link{s.mass(tyre.wheel), 1}, Link{s.mass(tyre.body), -1 / tyre.radius}},
                           stiffness,
                           damping,
                           speed / tyre.relaxation_length});
    }
    return springs;
}

Eigen::MatrixXd columns_of(const std::vector<Spring>& springs, int masses) {
    Eigen::MatrixXd a = Eigen::MatrixXd::Zero(masses, static_cast<Eigen::Index>(springs.size()));
    for (std::size_t k = 0; k < springs.size(); ++k) {
        for (const Link& link : springs[k].links) {
            if (link.mass >= 0) a(link.mass, static_cast<Eigen::Index>(k)) += link.factor;
        }
    }
    return a;
}

// Eigenvalues of ṗ = −Gᵀ(K ψ + D ψ̇), ψ̇ = G p − leak ψ with G = A_Eᵀ Q: the damped system.
std::vector<DampedMode> damped_modes(const Eigen::MatrixXd& basis, const Eigen::MatrixXd& g,
                                     const std::vector<Spring>& springs, const std::vector<double>& inertia) {
    const Eigen::Index d = g.cols(), e = g.rows();
    Eigen::VectorXd root(e), damping(e), leak(e);  // twists scaled by √k, so that both halves carry √J
    for (Eigen::Index k = 0; k < e; ++k) {
        const Spring& spring = springs[static_cast<std::size_t>(k)];
        root[k] = std::sqrt(spring.stiffness);
        damping[k] = spring.damping;
        leak[k] = spring.leak;
    }
    Eigen::VectorXd twist_force = root;  // K ψ − D leak ψ in units of √k ψ
    for (Eigen::Index k = 0; k < e; ++k) {
        if (root[k] > 0) twist_force[k] = root[k] - damping[k] * leak[k] / root[k];
    }
    Eigen::MatrixXd a = Eigen::MatrixXd::Zero(d + e, d + e);
    a.topLeftCorner(d, d) = -g.transpose() * damping.asDiagonal() * g;
    a.topRightCorner(d, e) = -g.transpose() * twist_force.asDiagonal();
    a.bottomLeftCorner(e, d) = root.asDiagonal() * g;
    a.bottomRightCorner(e, e) = (-leak).asDiagonal();
    std::vector<DampedMode> result;
    const Eigen::EigenSolver<Eigen::MatrixXd> solver(a);
    const Eigen::VectorXcd& values = solver.eigenvalues();
    const double rounding = std::max(1e-6, 1e-12 * values.cwiseAbs().maxCoeff());
    const Eigen::MatrixXcd vectors = solver.eigenvectors();
    for (Eigen::Index i = 0; i < values.size(); ++i) {
        const double size = std::abs(values[i]);
        if (!(values[i].imag() > 1e-6 * size && size > rounding)) continue;
        DampedMode mode{size / (2 * pi), -values[i].real() / size, {}};
        const Eigen::VectorXd amplitude = (basis * vectors.col(i).head(d)).cwiseAbs();
        double kinetic = 0;
        for (Eigen::Index j = 0; j < amplitude.size(); ++j) {
            mode.kinetic_share.push_back(inertia[static_cast<std::size_t>(j)] * amplitude[j] * amplitude[j]);
            kinetic += mode.kinetic_share.back();
        }
        for (double& share : mode.kinetic_share) share /= kinetic;
        result.push_back(std::move(mode));
    }
    std::sort(result.begin(), result.end(),
              [](const auto& a1, const auto& b1) { return a1.frequency < b1.frequency; });
    return result;
}

Mode make_mode(const Eigen::VectorXd& shape, double square, const Eigen::MatrixXd& a,
               const std::vector<Spring>& springs, const std::vector<double>& inertia) {
    Mode mode;
    const double omega = std::sqrt(square);
    mode.frequency = omega / (2 * pi);
    double kinetic = 0;
    Eigen::Index leader = 0;
    for (Eigen::Index j = 0; j < shape.size(); ++j) {
        const double energy = inertia[static_cast<std::size_t>(j)] * shape[j] * shape[j];
        kinetic += energy;
        mode.kinetic_share.push_back(energy);
        if (energy > mode.kinetic_share[static_cast<std::size_t>(leader)]) leader = j;
    }
    for (double& share : mode.kinetic_share) share /= kinetic;
    const Eigen::VectorXd twist = a.transpose() * shape;
    double damping = 0;
    for (std::size_t k = 0; k < springs.size(); ++k) {
        const double t2 = twist[static_cast<Eigen::Index>(k)] * twist[static_cast<Eigen::Index>(k)];
        damping += springs[k].damping * t2;
        if (springs[k].stiffness > 0)
            mode.elastic_share.emplace_back(springs[k].name, springs[k].stiffness * t2 / (kinetic * square));
    }
    mode.damping_ratio = damping / (2 * omega * kinetic);
    for (Eigen::Index j = 0; j < shape.size(); ++j) mode.shape.push_back(shape[j] / shape[leader]);
    return mode;
}

}  // namespace

std::vector<std::string> output_held_by(const Description& d, const Structure& s,
                                        const std::vector<std::string>& closed, const RigidOptions& options) {
    std::vector<std::string> names;
    const int output = s.mass(d.output_mass);
    if (output < 0) return names;
    const RigidSet set = rigid_set(d, s, closed, options);
    const auto holders = held_by(set, s.inertia);
    std::vector<int> members = holders[static_cast<std::size_t>(output)];
    if (members.empty()) members = holders[static_cast<std::size_t>(wheel_of(d, s, output))];
    for (const int k : members) names.push_back(set.members[static_cast<std::size_t>(k)].name);
    return names;
}

bool ModalResult::damping_shifts() const noexcept {
    return !std::equal(modes.begin(), modes.end(), damped.begin(), damped.end(),
                       [](const Mode& undamped, const DampedMode& mode) {
                           return std::fabs(mode.frequency / undamped.frequency - 1) <= 0.01;
                       });
}

double GearVariant::kmh(double input_rpm) const noexcept {
    return metres_per_radian ? 3.6 * *metres_per_radian * input_rpm * (pi / 30) : 0;
}

std::vector<GearVariant> gear_variants(const Description& description) {
    std::vector<GearVariant> variants;
    for (const GearPath& path : description.gear_paths)
        add_combinations(description, path.name, path.closed, variants);
    return variants;
}

std::vector<GearVariant> other_states(const Description& description) {
    std::vector<GearVariant> states;
    if (!description.gear_paths.empty()) {
        GearVariant open;
        open.name = "all open";
        open.description = description;
        return {open};
    }
    std::vector<std::string> start, all;
    for (const FrictionPair& pair : build_structure(description).pairs) {
        if (pair.rolling_contact || !can_be_closed(pair)) continue;
        all.push_back(pair.name);
        if (pair.initially_locked) start.push_back(pair.name);
    }
    if (!start.empty() && start != all) add_combinations(description, "as it starts", start, states);
    if (!all.empty()) add_combinations(description, "all closed", all, states);
    add_combinations(description, "all open", {}, states);
    return states;
}

Eigen::MatrixXd swinging_motions(const Description& d, const Structure& s,
                                 const std::vector<std::string>& closed) {
    return motions(rigid_set(d, s, closed, rigid_alone), s.inertia);
}

ModalResult natural_modes(const Description& d, const std::vector<std::string>& closed,
                          const ModalOptions& options) {
    const Structure s = build_structure(d);
    const Eigen::MatrixXd basis = swinging_motions(d, s, closed);
    const std::vector<Spring> springs = springs_of(d, s, options);
    const Eigen::MatrixXd a = columns_of(springs, s.masses());
    const Eigen::MatrixXd g = a.transpose() * basis;

    ModalResult result;
    if (basis.cols() == 0) return result;
    Eigen::VectorXd stiffness(a.cols());
    for (Eigen::Index k = 0; k < a.cols(); ++k) stiffness[k] = springs[static_cast<std::size_t>(k)].stiffness;
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(g.transpose() * stiffness.asDiagonal() * g);
    const Eigen::VectorXd& squares = solver.eigenvalues();
    const double zero = 1e-10 * std::max(squares.cwiseAbs().maxCoeff(), 1e-12);
    for (Eigen::Index i = 0; i < squares.size(); ++i) {
        if (squares[i] <= zero) {
            ++result.rigid_motions;
        } else {
            result.modes.push_back(
                make_mode(basis * solver.eigenvectors().col(i), squares[i], a, springs, s.inertia));
        }
    }
    result.damped = damped_modes(basis, g, springs, s.inertia);
    return result;
}

}  // namespace shiftrig::plant
