#include "plant/statics.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "plant/connectors.h"
#include "plant/format.h"
#include "plant/plant.h"
#include "plant/rigid_set.h"
#include "plant/structure.h"

namespace shiftrig::plant {
namespace {

std::string list(const std::vector<std::string>& names) {
    std::string text;
    for (const std::string& name : names) text += (text.empty() ? "" : ",") + name;
    return text.empty() ? "nothing" : text;
}

class Solver {
  public:
    Solver(const Description& d, const StaticsProblem& problem)
        : description_(d),
          problem_(problem),
          structure_(build_structure(d)),
          set_(rigid_set(d, structure_, problem.closed)) {}

    StaticsResult solve() {
        read_nodes();
        find_speeds();
        x_.assign(structure_.meshes.size(), 0);
        solve_torques();  // ideal
        if (!problem_.ideal) settle_directions();
        check_limits();
        return report();
    }

  private:
    [[noreturn]] void fail(const std::string& field, const std::string& rule) const {
        throw ModelError("statics", description_.name, field, rule);
    }
    int node(const std::string& field, const std::string& name) const {
        const int index = structure_.mass(name);
        if (index < 0) fail(field, "= \"" + name + "\" is no mass of the model");
        return index;
    }

    void read_nodes() {
        if (problem_.inputs.empty()) fail("input", "is missing: at least one NODE=TORQUE");
        const std::string output = problem_.output.empty() ? description_.output_mass : problem_.output;
        if (output.empty()) fail("output", "is missing: the model names no output mass");
        output_ = node("output", output);
        input_ = node("input", problem_.inputs.front().first);
        external_ = Eigen::VectorXd::Zero(structure_.masses());
        for (const auto& [name, torque] : problem_.inputs) external_[node("input", name)] += torque;
        if (input_ == output_) fail("input", "= \"" + output + "\" is the output node itself");
    }

    // ω = B q with the motions B that the rigid set allows, q from the given speeds; what they leave open
    // is set to rest and remembered.
    void find_speeds() {
        basis_ = motions(set_, structure_.inertia);
        std::vector<std::pair<int, double>> given;
        for (const auto& [name, speed] : problem_.speeds) given.emplace_back(node("speed", name), speed);
        if (given.empty()) given.emplace_back(input_, 1.0);
        const auto rows = static_cast<Eigen::Index>(given.size());
        Eigen::MatrixXd pick(rows, basis_.cols());
        Eigen::VectorXd wanted(rows);
        for (Eigen::Index i = 0; i < rows; ++i) {
            const auto [j, speed] = given[static_cast<std::size_t>(i)];
            wanted[i] = speed;
            pick.row(i) = basis_.row(j);
            const double motion = basis_.cols() > 0 ? basis_.row(j).norm() : 0;
            if (motion * std::sqrt(structure_.inertia[static_cast<std::size_t>(j)]) < 1e-9) {
                if (speed == 0) continue;
                fail("closed", "= " + list(problem_.closed) + " locks node \"" +
                                   structure_.mass_names[static_cast<std::size_t>(j)] +
                                   "\": over-determined, it cannot turn");
            }
        }
        if (basis_.cols() == 0)
            fail("closed", "= " + list(problem_.closed) + " locks every mass: over-determined");
        const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> decomposition(pick);
        const Eigen::VectorXd q = decomposition.solve(wanted);
        if ((pick * q - wanted).norm() > 1e-9 * (1 + wanted.norm())) {
            fail("speed", "contradicts the kinematics of the closed set " + list(problem_.closed));
        }
        speed_ = basis_ * q;
        const double scale = speed_.cwiseAbs().maxCoeff();
        for (double& w : speed_) {
            if (std::fabs(w) < 1e-12 * scale) w = 0;
        }
        open_.resize(structure_.masses(), 0);
        if (decomposition.rank() < basis_.cols())
            open_ = basis_ * Eigen::FullPivLU<Eigen::MatrixXd>(pick).kernel();
    }

    double meshing_speed(const Mesh& mesh) const {
        const double relative = speed_[mesh.first] - (mesh.carrier < 0 ? 0 : speed_[mesh.carrier]);
        return std::fabs(relative) < 1e-12 * speed_.cwiseAbs().maxCoeff() ? 0 : relative;
    }
    bool is_open(const Mesh& mesh) const {
        for (Eigen::Index i = 0; i < open_.cols(); ++i) {
            const double relative = open_(mesh.first, i) - (mesh.carrier < 0 ? 0 : open_(mesh.carrier, i));
            if (std::fabs(relative) > 1e-9 * open_.col(i).norm()) return true;
        }
        return false;
    }

    // Load-independent loss of a mesh as it acts on links 2 and carrier (+u, −u), with the sign of the motion.
    double bearing(std::size_t m) const {
        if (problem_.ideal || x_[m] == 0) return 0;
        const Mesh& mesh = structure_.meshes[m];
        const double torque = x_[m] > 0 ? mesh.forward_bearing : mesh.backward_bearing;
        return meshing_speed(mesh) < 0 ? -torque : torque;
    }

    // Σ_k Â_jk M_k − δ_j,out T_out = T_j for all nodes: unknown M and T_out.
    void solve_torques() {
        const Eigen::Index n = structure_.masses();
        const auto devices = static_cast<Eigen::Index>(set_.members.size());
        force_ = Eigen::MatrixXd::Zero(n, devices + 1);
        force_.leftCols(devices) = set_.columns;
        Eigen::VectorXd load = external_;
        for (std::size_t m = 0; m < structure_.meshes.size(); ++m) {  // meshes come first in the set
            const Mesh& mesh = structure_.meshes[m];
            const auto k = static_cast<Eigen::Index>(m);
            force_.col(k).setZero();
            for (const Link& link : mesh.column(mesh.force_ratio(x_[m]))) {
                if (link.mass >= 0) force_(link.mass, k) += link.factor;
            }
            load[mesh.second] -= mesh.ratio * bearing(m);
            if (mesh.carrier >= 0) load[mesh.carrier] += mesh.ratio * bearing(m);
        }
        force_(output_, devices) = -1;

        // Minimum norm weighted by capacity: only where a tie-up leaves the split open does the weight matter.
        Eigen::VectorXd weight = Eigen::VectorXd::Constant(devices + 1, 1);
        double largest = 1;
        for (const FrictionPair& pair : structure_.pairs) largest = std::max(largest, pair.nominal_capacity);
        for (Eigen::Index k = 0; k < devices; ++k) {
            const auto& member = set_.members[static_cast<std::size_t>(k)];
            const bool pair = member.kind == RigidSet::Kind::pair;
            weight[k] =
                pair ? structure_.pairs[static_cast<std::size_t>(member.index)].nominal_capacity / largest
                     : 1e4;
        }
        weight[devices] = 1e4;
        const Eigen::VectorXd root = weight.cwiseSqrt();
        Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> decomposition;
        decomposition.setThreshold(1e-11);
        decomposition.compute(force_ * root.asDiagonal());
        const auto apply = [&](const Eigen::VectorXd& right) -> Eigen::VectorXd {
            return root.cwiseProduct(decomposition.solve(right));
        };
        torque_ = apply(load);
        torque_ += apply(load - force_ * torque_);  // one refinement takes the residual to rounding
        residual_ = load - force_ * torque_;
        split_not_unique_ = decomposition.rank() < devices + 1;
        const double scale = std::max(torque_.cwiseAbs().maxCoeff(), load.cwiseAbs().maxCoeff());
        if (residual_.cwiseAbs().maxCoeff() > 1e-7 * scale) {
            Eigen::Index worst = 0;
            residual_.cwiseAbs().maxCoeff(&worst);
            fail("closed", "= " + list(problem_.closed) +
                               " is under-determined: nothing holds the torque at node \"" +
                               structure_.mass_names[static_cast<std::size_t>(worst)] +
                               "\", it would accelerate; close another clutch or brake");
        }
    }

    // x that mesh m should have by the present torques.
    int wanted_direction(std::size_t m) const {
        const Mesh& mesh = structure_.meshes[m];
        const double relative = meshing_speed(mesh);
        if (!mesh.lossy() || relative == 0) return 0;
        const double slope = mesh.forward_efficiency - 1 / mesh.backward_efficiency;
        const double kink = slope < 0 ? (mesh.forward_bearing - mesh.backward_bearing) / slope : 0;
        const double torque = torque_[static_cast<Eigen::Index>(m)] * (relative > 0 ? 1 : -1);
        return torque >= kink ? 1 : -1;
    }

    void settle_directions() {
        const double scale = torque_.cwiseAbs().maxCoeff();
        const std::size_t count = structure_.meshes.size();
        for (std::size_t m = 0; m < count; ++m) {
            x_[m] = wanted_direction(m);
            if (structure_.meshes[m].lossy() && is_open(structure_.meshes[m]) &&
                std::fabs(torque_[static_cast<Eigen::Index>(m)]) > 1e-9 * scale) {
                fail("speed", "of link 1 of \"" + structure_.meshes[m].name +
                                  "\" does not follow from the given ones, but its losses depend on it; give "
                                  "another NODE=SPEED");
            }
        }
        directions_settled_ = false;
        for (std::size_t turn = 0; turn < 2 * count + 2; ++turn) {
            solve_torques();
            std::size_t worst = count;
            double largest = 1e-9 * scale;
            for (std::size_t m = 0; m < count; ++m) {
                const double torque = std::fabs(torque_[static_cast<Eigen::Index>(m)]);
                if (x_[m] != wanted_direction(m) && torque > largest) {
                    worst = m;
                    largest = torque;
                }
            }
            if (worst == count) {
                directions_settled_ = true;
                return;
            }
            x_[worst] = -x_[worst];
        }
    }

    // What is said to be closed has to be able to pass on its torque. Where a tie-up leaves the split open, the sign of a
    // torque means nothing.
    void check_limits() const {
        if (split_not_unique_) return;
        const double tolerance = 1e-9 * torque_.cwiseAbs().maxCoeff();
        for (std::size_t k = 0; k < set_.members.size(); ++k) {
            if (set_.members[k].kind != RigidSet::Kind::pair) continue;
            const double torque = torque_[static_cast<Eigen::Index>(k)];
            for_each_connector(description_, [&](const auto& device) {
                if (device.name != set_.members[k].name) return;
                const char* instead = beyond_limit(device, torque, tolerance);
                if (!instead) return;
                fail("closed", "= " + list(problem_.closed) + ": " + kind(device) + " \"" + device.name +
                                   format("\" would have to pass on %.6g Nm: it %s", torque, instead));
            });
        }
    }

    StaticsResult report() const {
        StaticsResult result;
        const auto devices = static_cast<Eigen::Index>(set_.members.size());
        const auto& names = structure_.mass_names;
        for (Eigen::Index k = 0; k < devices; ++k) {
            const RigidSet::Member& member = set_.members[static_cast<std::size_t>(k)];
            const bool is_mesh = member.kind == RigidSet::Kind::mesh;
            const auto index = static_cast<std::size_t>(member.index);
            const bool row = is_mesh && structure_.meshes[index].planetary;
            const std::array<const char*, 3> suffix =
                row ? std::array{".sun", ".ring", ".carrier"} : std::array{".a", ".b", ""};
            for (std::size_t i = 0; i < 3; ++i) {
                const int mass = member.links[i].mass;
                if (mass < 0) continue;
                double torque = member.links[i].factor * torque_[k];
                if (is_mesh) {
                    const Mesh& mesh = structure_.meshes[index];
                    const auto column = mesh.column(mesh.force_ratio(x_[index]));
                    const double extra = mesh.ratio * bearing(index);
                    torque = column[i].factor * torque_[k] + (i == 1 ? extra : i == 2 ? -extra : 0);
                }
                result.links.push_back({member.name + suffix[i], member.name,
                                        names[static_cast<std::size_t>(mass)], torque, speed_[mass]});
            }
        }
        for (std::size_t m = 0; m < structure_.meshes.size(); ++m) {
            const Mesh& mesh = structure_.meshes[m];
            double in = 0;
            for (const auto& link : result.links) {
                if (link.device == mesh.name) in += link.torque * link.speed;
            }
            const double power = torque_[static_cast<Eigen::Index>(m)] * meshing_speed(mesh);
            const int x = mesh.lossy() && !problem_.ideal ? x_[m] : power > 0 ? 1 : power < 0 ? -1 : 0;
            result.meshes.push_back({mesh.name, x, power, problem_.ideal ? 0 : in});
        }
        result.output_torque = torque_[devices];
        double scale = std::fabs(result.output_torque);
        for (const auto& link : result.links) scale = std::max(scale, std::fabs(link.torque));
        for (Eigen::Index j = 0; j < speed_.size(); ++j) {
            const double outside = external_[j] + (j == output_ ? result.output_torque : 0);
            result.nodes.push_back({names[static_cast<std::size_t>(j)], speed_[j], outside, residual_[j]});
            const double power = outside * speed_[j];
            if (power > 0) result.power_in += power;
            result.loss += power;
            if (scale > 0)
                result.worst_residual = std::max(result.worst_residual, std::fabs(residual_[j]) / scale);
        }
        if (result.power_in > 0) result.efficiency = 1 - result.loss / result.power_in;
        if (speed_[output_] != 0) result.ratio = speed_[input_] / speed_[output_];
        result.directions_settled = directions_settled_;
        for (const TieUp& tie : tie_ups(set_, structure_.inertia)) {
            for (const std::string& device : tie.devices) {
                if (std::find(result.tie_up.begin(), result.tie_up.end(), device) == result.tie_up.end()) {
                    result.tie_up.push_back(device);
                }
            }
        }
        result.split_not_unique = split_not_unique_ && !result.tie_up.empty();
        return result;
    }

    const Description& description_;
    const StaticsProblem& problem_;
    Structure structure_;
    RigidSet set_;
    int input_ = -1, output_ = -1;
    Eigen::VectorXd external_, speed_, torque_, residual_;
    Eigen::MatrixXd basis_, open_, force_;
    std::vector<int> x_;
    bool split_not_unique_ = false, directions_settled_ = true;
};

}  // namespace

StaticsResult solve_statics(const Description& description, const StaticsProblem& problem) {
    return Solver(description, problem).solve();
}

}  // namespace shiftrig::plant
