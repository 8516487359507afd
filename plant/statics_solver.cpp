#include "plant/statics_solver.h"

#include <algorithm>

#include "plant/format.h"

namespace shiftrig::plant::detail {
namespace {

// Beyond it powers and squares would overflow.
constexpr double largest_number = 1e100;

// Columns that span {x : Ax = 0}, orthonormal.
Eigen::MatrixXd kernel(const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>& a) {
    const Eigen::Index free = a.cols() - a.rank();
    if (free == 0) return Eigen::MatrixXd(a.cols(), 0);
    if (a.rank() == 0) return Eigen::MatrixXd::Identity(a.cols(), a.cols());
    return a.colsPermutation() * a.matrixZ().transpose().rightCols(free);
}

}  // namespace

std::string listed(const std::vector<std::string>& names) {
    std::string text;
    for (const std::string& name : names) text += (text.empty() ? "" : ",") + name;
    return text.empty() ? "nothing" : text;
}

StaticsSolver::StaticsSolver(const Description& d, const StaticsProblem& problem)
    : description_(d),
      problem_(problem),
      structure_(build_structure(d)),
      set_(rigid_set(d, structure_, problem.closed)),
      ideal_(problem.ideal) {}

StaticsResult StaticsSolver::solve() {
    read_nodes();
    find_speeds();
    find_loops();
    if (!settle() || !directions_settled_) search_directions();
    if (!is_balanced()) refuse_imbalance();
    check_limits();
    return report();
}

int StaticsSolver::node(const std::string& field, const std::string& name) const {
    const int index = structure_.mass(name);
    if (index < 0) fail(field, "= \"" + name + "\" is no mass of the model");
    return index;
}

double StaticsSolver::number(const std::string& field, const std::string& name, double value) const {
    if (!(std::fabs(value) <= largest_number))
        fail(field + " \"" + name + "\"", format("= %g; must be finite, at most 1e100 in size", value));
    return value;
}

void StaticsSolver::read_nodes() {
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

void StaticsSolver::find_speeds() {
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
        fail("closed", "= " + listed(problem_.closed) + " locks node \"" + name_of(j) +
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
        fail("speed", "contradicts the kinematics of the closed set " + listed(problem_.closed));
    }
    speed_ = basis_ * q;
    const double scale = speed_.cwiseAbs().maxCoeff();
    for (double& w : speed_) {
        if (std::fabs(w) < 1e-12 * scale) w = 0;
    }
    if (decomposition.rank() < basis_.cols())
        open_ = basis_ * Eigen::FullPivLU<Eigen::MatrixXd>(pick).kernel();
}

bool StaticsSolver::can_move(int mass) const {
    const double motion = basis_.cols() > 0 ? basis_.row(mass).norm() : 0;
    return motion * std::sqrt(structure_.inertia[static_cast<std::size_t>(mass)]) > 1e-9;
}

void StaticsSolver::find_loops() {
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

double StaticsSolver::meshing_speed(const Mesh& mesh) const {
    const double relative = speed_[mesh.first] - (mesh.carrier < 0 ? 0 : speed_[mesh.carrier]);
    return std::fabs(relative) < 1e-12 * speed_.cwiseAbs().maxCoeff() ? 0 : relative;
}

bool StaticsSolver::is_open(const Mesh& mesh) const {
    for (Eigen::Index i = 0; i < open_.cols(); ++i) {
        const double relative = open_(mesh.first, i) - (mesh.carrier < 0 ? 0 : open_(mesh.carrier, i));
        if (std::fabs(relative) > 1e-9 * open_.col(i).norm()) return true;
    }
    return false;
}

double StaticsSolver::bearing(std::size_t m) const {
    if (ideal_ || x_[m] == 0) return 0;
    const Mesh& mesh = structure_.meshes[m];
    const double torque = x_[m] > 0 ? mesh.forward_bearing : mesh.backward_bearing;
    return meshing_speed(mesh) < 0 ? -torque : torque;
}

void StaticsSolver::solve_torques() {
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
    const double of_mesh = structure_.mesh_weight();  // as modes share
    Eigen::VectorXd weight = Eigen::VectorXd::Ones(unknowns);
    for (Eigen::Index k = 0; k < devices; ++k) {
        const auto& member = set_.members[static_cast<std::size_t>(k)];
        const auto i = static_cast<std::size_t>(member.index);
        if (member.kind == RigidSet::Kind::pair) weight[k] = structure_.pairs[i].nominal_capacity / of_mesh;
        if (member.kind == RigidSet::Kind::mesh) weight[k] = structure_.meshes[i].first_link_weight();
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

bool StaticsSolver::settle() {
    x_.assign(structure_.meshes.size(), 0);
    directions_settled_ = true;
    solve_torques();  // ideal
    if (!ideal_) settle_directions();
    return is_balanced();
}

int StaticsSolver::wanted_direction(std::size_t m) const {
    const Mesh& mesh = structure_.meshes[m];
    const double relative = meshing_speed(mesh);
    if (!mesh.lossy() || relative == 0) return 0;
    const double torque = torque_[static_cast<Eigen::Index>(m)] * (relative > 0 ? 1 : -1);
    return torque >= mesh.loss_kink() ? 1 : -1;
}

void StaticsSolver::settle_directions() {
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

std::size_t StaticsSolver::worst_direction(double scale) const {
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

void StaticsSolver::search_directions() {
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

}  // namespace shiftrig::plant::detail
