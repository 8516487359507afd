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

// Beyond it powers and squares would overflow.
constexpr double largest_number = 1e100;

std::string list(const std::vector<std::string>& names) {
    std::string text;
    for (const std::string& name : names) text += (text.empty() ? "" : ",") + name;
    return text.empty() ? "nothing" : text;
}

// Columns that span {x : Ax = 0}, orthonormal.
Eigen::MatrixXd kernel(const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>& a) {
    const Eigen::Index free = a.cols() - a.rank();
    if (free == 0) return Eigen::MatrixXd(a.cols(), 0);
    if (a.rank() == 0) return Eigen::MatrixXd::Identity(a.cols(), a.cols());
    return a.colsPermutation() * a.matrixZ().transpose().rightCols(free);
}

class Solver {
  public:
    Solver(const Description& d, const StaticsProblem& problem)
        : description_(d),
          problem_(problem),
          structure_(build_structure(d)),
          set_(rigid_set(d, structure_, problem.closed)),
          ideal_(problem.ideal) {}

    StaticsResult solve() {
        read_nodes();
        find_speeds();
        find_loops();
        if (!settle() || !directions_settled_) search_directions();
        if (!is_balanced()) refuse_imbalance();
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

    double number(const std::string& field, const std::string& name, double value) const {
        if (!(std::fabs(value) <= largest_number))
            fail(field + " \"" + name + "\"", format("= %g; must be finite, at most 1e100 in size", value));
        return value;
    }
    const std::string& name_of(Eigen::Index mass) const {
        return structure_.mass_names[static_cast<std::size_t>(mass)];
    }
    bool is_translating(int mass) const {
        return description_.masses[static_cast<std::size_t>(mass)].motion == Motion::translating;
    }

    void read_nodes() {
        if (problem_.inputs.empty()) fail("input", "is missing: at least one NODE=TORQUE");
        const std::string output = problem_.output.empty() ? description_.output_mass : problem_.output;
        if (output.empty()) fail("output", "is missing: the model names no output mass");
        output_ = node("output", output);
        input_ = node("input", problem_.inputs.front().first);
        external_ = Eigen::VectorXd::Zero(structure_.masses());
        for (const auto& [name, torque] : problem_.inputs) {
            const int j = node("input", name);
            external_[j] += number("input", name, torque);
            if (std::find(loaded_.begin(), loaded_.end(), j) == loaded_.end()) loaded_.push_back(j);
        }
        if (input_ == output_) fail("input", "= \"" + output + "\" is the output node itself");
    }

    // ω = B q with the motions B that the rigid set allows, q from the given speeds; what they leave open
    // is set to rest and remembered.
    void find_speeds() {
        basis_ = motions(set_, structure_.inertia);
        std::vector<std::pair<int, double>> given;
        for (const auto& [name, speed] : problem_.speeds)
            given.emplace_back(node("speed", name), number("speed", name, speed));
        if (given.empty()) given.emplace_back(input_, 1.0);
        const auto rows = static_cast<Eigen::Index>(given.size());
        Eigen::MatrixXd pick(rows, basis_.cols());
        Eigen::VectorXd wanted(rows);
        for (Eigen::Index i = 0; i < rows; ++i) {
            const auto [j, speed] = given[static_cast<std::size_t>(i)];
            wanted[i] = speed;
            pick.row(i) = basis_.row(j);
            if (can_move(j) || speed == 0) continue;
            fail("closed", "= " + list(problem_.closed) + " locks node \"" + name_of(j) +
                               "\": over-determined, it cannot turn; speed " + name_of(j) +
                               " = 0 asks for the torques at rest");
        }
        if (can_move(output_)) absorbers_ = {output_};
        speed_ = Eigen::VectorXd::Zero(structure_.masses());
        open_.resize(structure_.masses(), 0);
        if (basis_.cols() == 0) return;  // closed devices hold the whole machine
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
        if (decomposition.rank() < basis_.cols())
            open_ = basis_ * Eigen::FullPivLU<Eigen::MatrixXd>(pick).kernel();
    }

    bool can_move(int mass) const {
        const double motion = basis_.cols() > 0 ? basis_.row(mass).norm() : 0;
        return motion * std::sqrt(structure_.inertia[static_cast<std::size_t>(mass)]) > 1e-9;
    }

    // Nᵀθ = 0 as rows on the torques: around every loop the twists of the shafts add up to nothing.
    void find_loops() {
        Eigen::MatrixXd stresses = self_stresses(set_, structure_.inertia);
        const auto devices = static_cast<Eigen::Index>(set_.members.size());
        compatibility_ = Eigen::MatrixXd::Zero(stresses.cols(), devices);
        if (stresses.cols() == 0) return;
        for (auto stress : stresses.colwise()) {  // rounding is not to make a shaft part of a loop
            const double rounding = 1e-9 * stress.cwiseAbs().maxCoeff();
            for (double& torque : stress) torque = std::fabs(torque) < rounding ? 0 : torque;
        }
        double softest = 0;
        for (const Elastic& shaft : structure_.shafts) {
            softest = softest == 0 ? shaft.stiffness : std::min(softest, shaft.stiffness);
        }
        for (Eigen::Index k = 0; k < devices; ++k) {
            const auto& member = set_.members[static_cast<std::size_t>(k)];
            if (member.kind != RigidSet::Kind::shaft) continue;
            const double stiffness = structure_.shafts[static_cast<std::size_t>(member.index)].stiffness;
            compatibility_.col(k) = stresses.row(k).transpose() * (softest / stiffness);
        }
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
        if (ideal_ || x_[m] == 0) return 0;
        const Mesh& mesh = structure_.meshes[m];
        const double torque = x_[m] > 0 ? mesh.forward_bearing : mesh.backward_bearing;
        return meshing_speed(mesh) < 0 ? -torque : torque;
    }

    // Σ_k Â_jk M_k − Σ_absorbers T = T_j for all nodes: unknown M, then what the absorbing nodes take. What is out of
    // balance is left as a residual of the smallest Σ r²/J, so that torques come near those of the accelerating machine.
    void solve_torques() {
        const Eigen::Index n = structure_.masses();
        const auto devices = static_cast<Eigen::Index>(set_.members.size()),
                   unknowns = devices + static_cast<Eigen::Index>(absorbers_.size());
        force_ = Eigen::MatrixXd::Zero(n, unknowns);
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
        for (std::size_t i = 0; i < absorbers_.size(); ++i) {
            force_(absorbers_[i], devices + static_cast<Eigen::Index>(i)) = -1;
        }

        // Minimum norm weighted by capacity: only where a tie-up leaves the split open does the weight matter.
        Eigen::VectorXd weight = Eigen::VectorXd::Constant(unknowns, 1e4);
        double largest = 1;
        for (const FrictionPair& pair : structure_.pairs) largest = std::max(largest, pair.nominal_capacity);
        for (Eigen::Index k = 0; k < devices; ++k) {
            const auto& member = set_.members[static_cast<std::size_t>(k)];
            if (member.kind != RigidSet::Kind::pair) continue;
            weight[k] = structure_.pairs[static_cast<std::size_t>(member.index)].nominal_capacity / largest;
        }
        const Eigen::VectorXd root = weight.cwiseSqrt();
        const Eigen::VectorXd row =
            Eigen::Map<const Eigen::VectorXd>(structure_.inertia.data(), n).cwiseSqrt().cwiseInverse();
        Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> decomposition;
        decomposition.setThreshold(1e-11);
        decomposition.compute(row.asDiagonal() * force_ * root.asDiagonal());
        const auto apply = [&](const Eigen::VectorXd& right) -> Eigen::VectorXd {
            return root.cwiseProduct(decomposition.solve(row.cwiseProduct(right)));
        };
        torque_ = apply(load);
        torque_ += apply(load - force_ * torque_);  // one refinement takes the residual to rounding

        // What the balances leave open, weighted: Z. Shafts decide as much of it as compatibility has a say in.
        Eigen::MatrixXd z = kernel(decomposition);
        in_loops_ = root.asDiagonal() * z;
        if (z.cols() > 0 && !compatibility_.isZero(0)) {
            const Eigen::MatrixXd decided = compatibility_ * in_loops_.topRows(devices);
            Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> stiffness;
            stiffness.setThreshold(1e-11);
            stiffness.compute(decided);
            torque_ -= in_loops_ * stiffness.solve(compatibility_ * torque_.head(devices));
            z *= kernel(stiffness);
        }
        undecided_ = root.asDiagonal() * z;
        residual_ = load - force_ * torque_;
        scale_ = std::max(torque_.size() > 0 ? torque_.cwiseAbs().maxCoeff() : 0, load.cwiseAbs().maxCoeff());
    }

    // The torques, with losses unless ideal. False: nothing holds what the inputs put in.
    bool settle() {
        x_.assign(structure_.meshes.size(), 0);
        directions_settled_ = true;
        solve_torques();  // ideal
        if (!ideal_) settle_directions();
        return is_balanced();
    }
    bool is_balanced() const { return residual_.cwiseAbs().maxCoeff() <= 1e-7 * scale_; }

    // Names what accelerates, and at which node what other torque would keep the balance.
    [[noreturn]] void refuse_imbalance(const std::string& open_mesh = "") {
        const double largest = residual_.cwiseAbs().maxCoeff();
        int worst = 0;
        while (std::fabs(residual_[worst]) < (1 - 1e-6) * largest) ++worst;
        std::vector<int> candidates;
        if (loaded_.size() > 1) candidates = loaded_;  // of one alone it would be none at all
        if (std::find(candidates.begin(), candidates.end(), worst) == candidates.end())
            candidates.push_back(worst);
        const std::vector<int> absorbers = absorbers_;
        const double given = external_.cwiseAbs().maxCoeff();
        std::string balance;
        for (const int j : candidates) {
            absorbers_ = absorbers;
            absorbers_.push_back(j);
            if (!settle() || !directions_settled_) continue;
            double needed = external_[j] + torque_[torque_.size() - 1];
            if (std::fabs(needed) < 1e-9 * given) needed = 0;
            balance += (balance.empty() ? "" : " or ") + name_of(j) + format(" = %.9g", needed) +
                       (is_translating(j) ? " N" : " Nm") + format(" (%.9g given)", external_[j]);
        }
        std::string remedy = is_anything_open() ? "close another clutch or brake, " : "";
        if (balance.empty())
            remedy += "no single torque would balance it";
        else
            remedy += (remedy.empty() ? "balance it: " : "or balance it: ") +
                      std::string(ideal_ ? "without losses " : "") + balance;
        if (!open_mesh.empty())
            remedy += "; with losses it depends on the speed " + open_mesh + ": give another NODE=SPEED";
        fail("closed", "= " + list(problem_.closed) +
                           " is under-determined: nothing holds the torque at node \"" + name_of(worst) +
                           "\", it would accelerate; " + remedy);
    }
    bool is_anything_open() const {
        bool found = false;
        for_each_connector(description_, [&](const auto& device) {
            found =
                found || (may_be_closed(device) && std::find(problem_.closed.begin(), problem_.closed.end(),
                                                             device.name) == problem_.closed.end());
        });
        return found;
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
        const double scale = scale_;
        const std::size_t count = structure_.meshes.size();
        for (std::size_t m = 0; m < count; ++m) {
            x_[m] = wanted_direction(m);
            if (!structure_.meshes[m].lossy() || !is_open(structure_.meshes[m]) ||
                std::fabs(torque_[static_cast<Eigen::Index>(m)]) <= 1e-9 * scale)
                continue;
            const std::string what = "of link 1 of \"" + structure_.meshes[m].name + "\"";
            if (is_balanced())
                fail("speed", what +
                                  " does not follow from the given ones, but its losses depend on it; give "
                                  "another NODE=SPEED");
            ideal_ = true;
            refuse_imbalance(what);
        }
        directions_settled_ = false;
        for (std::size_t turn = 0; turn < 2 * count + 2; ++turn) {
            solve_torques();
            const std::size_t worst = worst_direction(scale);
            if (worst == count) {
                directions_settled_ = true;
                return;
            }
            x_[worst] = -x_[worst];
        }
    }

    // The mesh with the largest torque whose x is wrong; the number of meshes: none is.
    std::size_t worst_direction(double scale) const {
        std::size_t worst = x_.size();
        double largest = 1e-9 * scale;
        for (std::size_t m = 0; m < x_.size(); ++m) {
            const double torque = std::fabs(torque_[static_cast<Eigen::Index>(m)]);
            if (x_[m] != wanted_direction(m) && torque > largest) {
                worst = m;
                largest = torque;
            }
        }
        return worst;
    }

    // Flipping one by one may miss the directions in which loads are in balance: tries all of them, where they are few. What
    // was there stays if none is better.
    void search_directions() {
        std::vector<std::size_t> moving;
        for (std::size_t m = 0; m < x_.size(); ++m) {
            if (x_[m] != 0) moving.push_back(m);
        }
        if (moving.size() > 12) return;
        const std::vector<int> found = x_;
        const double scale = scale_;
        for (unsigned pattern = 0; pattern < 1u << moving.size(); ++pattern) {
            for (std::size_t i = 0; i < moving.size(); ++i) x_[moving[i]] = (pattern >> i & 1) ? -1 : 1;
            solve_torques();
            if (!is_balanced() || worst_direction(scale) != x_.size()) continue;
            directions_settled_ = true;
            return;
        }
        x_ = found;
        solve_torques();
    }

    // What is said to be closed has to be able to pass on its torque. Where a tie-up leaves the split open, the sign of a
    // torque means nothing.
    void check_limits() const {
        const double tolerance = 1e-9 * scale_;
        for (std::size_t k = 0; k < set_.members.size(); ++k) {
            if (is_part_of(undecided_, k)) continue;
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

    // Does device k take part in any of these sets of torques?
    static bool is_part_of(const Eigen::MatrixXd& torques, std::size_t k) {
        return torques.cols() > 0 &&
               torques.row(static_cast<Eigen::Index>(k)).norm() > 1e-9 * torques.cwiseAbs().maxCoeff();
    }

    StaticsResult report() const {
        StaticsResult result;
        const auto devices = static_cast<Eigen::Index>(set_.members.size());
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
                result.links.push_back({member.name + suffix[i], member.name, name_of(mass), torque,
                                        speed_[mass], is_translating(mass)});
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
            if (mesh.lossy() && !problem_.ideal && meshing_speed(mesh) == 0 &&
                std::fabs(torque_[static_cast<Eigen::Index>(m)]) > 1e-9 * scale_)
                result.loss_at_rest.push_back(mesh.name);
        }
        result.output_held = absorbers_.empty();
        if (!result.output_held) result.output_torque = torque_[devices];
        double scale = std::fabs(result.output_torque), power_out = 0;
        for (const auto& link : result.links) scale = std::max(scale, std::fabs(link.torque));
        for (Eigen::Index j = 0; j < speed_.size(); ++j) {
            const double outside = external_[j] + (j == output_ ? result.output_torque : 0);
            result.nodes.push_back(
                {name_of(j), speed_[j], outside, residual_[j], is_translating(static_cast<int>(j))});
            const double power = outside * speed_[j];
            (power > 0 ? result.power_in : power_out) += std::fabs(power);
            if (scale > 0)
                result.worst_residual = std::max(result.worst_residual, std::fabs(residual_[j]) / scale);
        }
        result.input = result.nodes[static_cast<std::size_t>(input_)];
        result.output = result.nodes[static_cast<std::size_t>(output_)];
        result.at_rest = speed_.isZero(0);
        result.loss = result.power_in - power_out;
        result.output_driven = directions_settled_ && power_out <= 1e-9 * result.power_in &&
                               result.output_torque * speed_[output_] > 1e-9 * result.power_in;
        if (result.power_in > 0 && !result.output_driven && directions_settled_)
            result.efficiency = 1 - result.loss / result.power_in;
        if (speed_[output_] != 0) result.ratio = speed_[input_] / speed_[output_];
        result.directions_settled = directions_settled_;
        for (std::size_t k = 0; k < set_.members.size(); ++k) {
            if (is_part_of(undecided_, k))
                result.tie_up.push_back(set_.members[k].name);
            else if (is_part_of(in_loops_, k))
                result.shared_by_stiffness.push_back(set_.members[k].name);
        }
        result.split_not_unique = !result.tie_up.empty();
        return result;
    }

    const Description& description_;
    const StaticsProblem& problem_;
    Structure structure_;
    RigidSet set_;
    bool ideal_ = false;
    int input_ = -1, output_ = -1;
    std::vector<int> loaded_;     // nodes with an input
    std::vector<int> absorbers_;  // the output, unless closed devices hold it
    Eigen::VectorXd external_, speed_, torque_, residual_;
    Eigen::MatrixXd basis_, open_, force_, compatibility_;
    Eigen::MatrixXd in_loops_,
        undecided_;     // torques that leave every balance as it is; those that stiffness leaves open
    double scale_ = 0;  // largest torque
    std::vector<int> x_;
    bool directions_settled_ = true;
};

}  // namespace

StaticsResult solve_statics(const Description& description, const StaticsProblem& problem) {
    return Solver(description, problem).solve();
}

}  // namespace shiftrig::plant
