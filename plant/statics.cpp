#include "plant/statics.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "plant/connectors.h"
#include "plant/format.h"
#include "plant/statics_solver.h"

namespace shiftrig::plant {
namespace detail {

void StaticsSolver::refuse_imbalance(const std::string& open_mesh) {
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
    fail("closed", "= " + listed(problem_.closed) +
                       " is under-determined: nothing holds the torque at node \"" + name_of(worst) +
                       "\", it would accelerate; " + remedy);
}

bool StaticsSolver::is_anything_open() const {
    bool found = false;
    for_each_connector(description_, [&](const auto& device) {
        found = found || (may_be_closed(device) && std::find(problem_.closed.begin(), problem_.closed.end(),
                                                             device.name) == problem_.closed.end());
    });
    return found;
}

void StaticsSolver::check_limits() const {
    const double tolerance = 1e-9 * scale_;
    for (std::size_t k = 0; k < set_.members.size(); ++k) {
        if (is_part_of(undecided_, k)) continue;
        if (set_.members[k].kind != RigidSet::Kind::pair) continue;
        const double torque = torque_[static_cast<Eigen::Index>(k)];
        for_each_connector(description_, [&](const auto& device) {
            if (device.name != set_.members[k].name) return;
            const char* instead = beyond_limit(device, torque, tolerance);
            if (!instead) return;
            fail("closed", "= " + listed(problem_.closed) + ": " + kind(device) + " \"" + device.name +
                               format("\" would have to pass on %.6g Nm: it %s", torque, instead));
        });
    }
}

bool StaticsSolver::is_part_of(const Eigen::MatrixXd& torques, std::size_t k) {
    return torques.cols() > 0 &&
           torques.row(static_cast<Eigen::Index>(k)).norm() > 1e-9 * torques.cwiseAbs().maxCoeff();
}

StaticsResult StaticsSolver::report() const {
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
            result.links.push_back({member.name + suffix[i], member.name, name_of(mass), torque, speed_[mass],
                                    is_translating(mass)});
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

}  // namespace detail

StaticsResult solve_statics(const Description& description, const StaticsProblem& problem) {
    return detail::StaticsSolver(description, problem).solve();
}

}  // namespace shiftrig::plant
