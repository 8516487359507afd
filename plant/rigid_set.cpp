#include "plant/rigid_set.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "plant/plant.h"

namespace shiftrig::plant {
namespace {

constexpr double rank_threshold = 1e-9;

// J^(−1/2) C with columns of length 1: rows and columns of very different units become comparable.
Eigen::MatrixXd scaled_columns(const RigidSet& set, const std::vector<double>& inertia) {
    Eigen::MatrixXd c = set.columns;
    for (Eigen::Index j = 0; j < c.rows(); ++j) c.row(j) /= std::sqrt(inertia[static_cast<std::size_t>(j)]);
    for (Eigen::Index k = 0; k < c.cols(); ++k) c.col(k).normalize();
    return c;
}

Eigen::ColPivHouseholderQR<Eigen::MatrixXd> factor(const Eigen::MatrixXd& scaled) {
    Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr;
    qr.setThreshold(rank_threshold);
    qr.compute(scaled);
    return qr;
}

// The independent columns that make up Q·rotated, by their places before pivoting.
std::vector<int> needed_for(const Eigen::ColPivHouseholderQR<Eigen::MatrixXd>& qr,
                            const Eigen::VectorXd& rotated) {
    const Eigen::Index rank = qr.rank();
    const Eigen::MatrixXd r = qr.matrixR().topLeftCorner(rank, rank);
    const Eigen::VectorXd parts = r.triangularView<Eigen::Upper>().solve(rotated.head(rank));
    std::vector<int> needed;
    for (Eigen::Index i = 0; i < rank; ++i) {
        if (std::fabs(parts[i]) > 1e-7) needed.push_back(qr.colsPermutation().indices()[i]);
    }
    return needed;
}

TieUp named(const RigidSet& set, const std::vector<int>& members) {
    TieUp tie;
    for (const int k : members) tie.devices.push_back(set.members[static_cast<std::size_t>(k)].name);
    return tie;
}

}  // namespace

bool can_be_closed(const FrictionPair& pair) noexcept {
    return pair.kind == PairKind::clutch || pair.kind == PairKind::self_acting;
}

RigidSet rigid_set(const Description& d, const Structure& s, const std::vector<std::string>& closed,
                   const RigidOptions& options) {
    for (const std::string& name : closed) {
        const int index = s.pair(name);
        if (index < 0 || !can_be_closed(s.pairs[static_cast<std::size_t>(index)])) {
            throw ModelError("model", d.name, "closed",
                             "= \"" + name + "\" is no clutch, brake or freewheel");
        }
    }
    RigidSet set;
    const auto add = [&set](const std::string& name, RigidSet::Kind kind, std::size_t index,
                            std::array<Link, 3> links) {
        set.members.push_back({name, kind, static_cast<int>(index), links});
    };
    for (std::size_t i = 0; i < s.meshes.size(); ++i) {
        add(s.meshes[i].name, RigidSet::Kind::mesh, i, s.meshes[i].column(s.meshes[i].ratio));
    }
    for (std::size_t i = 0; i < s.pairs.size(); ++i) {
        const FrictionPair& pair = s.pairs[i];
        if (!can_be_closed(pair)) continue;
        const bool named = std::find(closed.begin(), closed.end(), pair.name) != closed.end();
        if (named || (pair.rolling_contact && options.wheel_contacts)) {
            add(pair.name, RigidSet::Kind::pair, i, {pair.links[0], pair.links[1], Link{}});
        }
    }
    for (std::size_t i = 0; options.stiff_shafts && i < s.shafts.size(); ++i) {
        add(s.shafts[i].name, RigidSet::Kind::shaft, i, {s.shafts[i].links[0], s.shafts[i].links[1], Link{}});
    }
    for (std::size_t i = 0; options.rolling_tyres && i < s.rolling_contacts.size(); ++i) {
        const RollingContact& tyre = s.rolling_contacts[i];
        add(tyre.name, RigidSet::Kind::tyre, i, {tyre.links[0], tyre.links[1], Link{}});
    }
    set.columns = Eigen::MatrixXd::Zero(s.masses(), static_cast<Eigen::Index>(set.members.size()));
    for (std::size_t k = 0; k < set.members.size(); ++k) {
        for (const Link& link : set.members[k].links) {
            if (link.mass >= 0) set.columns(link.mass, static_cast<Eigen::Index>(k)) += link.factor;
        }
    }
    return set;
}

Eigen::MatrixXd motions(const RigidSet& set, const std::vector<double>& inertia) {
    const auto n = static_cast<Eigen::Index>(inertia.size());
    Eigen::MatrixXd basis = Eigen::MatrixXd::Identity(n, n);
    if (set.columns.cols() > 0) {
        const auto qr = factor(scaled_columns(set, inertia));
        basis = qr.householderQ() * basis;
        basis = basis.rightCols(n - qr.rank()).eval();
    }
    for (Eigen::Index j = 0; j < n; ++j) basis.row(j) /= std::sqrt(inertia[static_cast<std::size_t>(j)]);
    return basis;
}

std::vector<std::vector<int>> held_by(const RigidSet& set, const std::vector<double>& inertia) {
    std::vector<std::vector<int>> result(inertia.size());
    if (set.members.empty()) return result;
    const Eigen::MatrixXd basis = motions(set, inertia);
    std::optional<Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>> constraints;
    for (std::size_t j = 0; j < inertia.size(); ++j) {
        const auto row = static_cast<Eigen::Index>(j);
        if (basis.row(row).norm() * std::sqrt(inertia[j]) > 1e-9) continue;
        // Which constraints together say that this mass does not move?
        if (!constraints) constraints.emplace(scaled_columns(set, inertia));
        const Eigen::VectorXd parts = constraints->solve(Eigen::VectorXd::Unit(basis.rows(), row));
        for (int k = 0; k < parts.size(); ++k) {
            if (std::fabs(parts[k]) > 1e-7) result[j].push_back(k);
        }
    }
    return result;
}

Eigen::MatrixXd self_stresses(const RigidSet& set, const std::vector<double>& inertia) {
    const Eigen::Index cols = set.columns.cols();
    if (cols == 0) return {};
    const Eigen::MatrixXd scaled = scaled_columns(set, inertia);
    const auto qr = factor(scaled);
    const Eigen::Index rank = qr.rank();
    const Eigen::MatrixXd r = qr.matrixR().topRows(rank).triangularView<Eigen::Upper>();
    Eigen::MatrixXd parts(cols, cols - rank);
    parts.topRows(rank) =
        -r.leftCols(rank).triangularView<Eigen::Upper>().solve(r.rightCols(cols - rank)).eval();
    parts.bottomRows(cols - rank).setIdentity();
    parts = qr.colsPermutation() * parts;
    for (Eigen::Index k = 0; k < cols; ++k) {  // undo the scaling of the columns
        double square = 0;
        for (Eigen::Index j = 0; j < scaled.rows(); ++j)
            square += set.columns(j, k) * set.columns(j, k) / inertia[static_cast<std::size_t>(j)];
        parts.row(k) /= std::sqrt(square);
    }
    return parts;
}

std::vector<TieUp> tie_ups(const RigidSet& set, const std::vector<double>& inertia) {
    if (set.columns.cols() == 0) return {};
    std::vector<std::vector<int>> loops;
    const auto qr = factor(scaled_columns(set, inertia));
    const auto& order = qr.colsPermutation().indices();
    const Eigen::MatrixXd& r = qr.matrixR();
    for (Eigen::Index dependent = qr.rank(); dependent < r.cols(); ++dependent) {
        std::vector<int> members = needed_for(qr, r.col(dependent));
        members.push_back(order[dependent]);
        std::sort(members.begin(), members.end());
        loops.push_back(std::move(members));
    }
    std::sort(loops.begin(), loops.end());
    std::vector<TieUp> result;
    result.reserve(loops.size());
    for (const std::vector<int>& members : loops) result.push_back(named(set, members));
    return result;
}

std::optional<TieUp> loop_through(const RigidSet& set, const std::vector<double>& inertia,
                                  const std::string& member) {
    const auto own = std::find_if(set.members.begin(), set.members.end(),
                                  [&](const RigidSet::Member& other) { return other.name == member; });
    if (own == set.members.end()) return std::nullopt;
    const Eigen::Index k = own - set.members.begin(), last = set.columns.cols() - 1;
    Eigen::MatrixXd others = scaled_columns(set, inertia);
    const Eigen::VectorXd column = others.col(k);
    others.middleCols(k, last - k) = others.rightCols(last - k).eval();
    others.conservativeResize(Eigen::NoChange, last);
    if (last == 0) return std::nullopt;
    const auto qr = factor(others);
    const Eigen::VectorXd rotated = qr.householderQ().adjoint() * column;
    if (rotated.tail(rotated.size() - qr.rank()).norm() > rank_threshold) return std::nullopt;
    std::vector<int> members = needed_for(qr, rotated);
    for (int& other : members) other += other >= k;
    members.push_back(static_cast<int>(k));
    std::sort(members.begin(), members.end());
    return named(set, members);
}

}  // namespace shiftrig::plant
