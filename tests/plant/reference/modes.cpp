#include "tests/plant/reference/modes.h"

#include <cmath>

namespace shiftrig::reference {
namespace {

constexpr double dependent = 1e-9;  // pivot below which a normalised column counts as dependent

int rank_of(const Matrix& columns) {
    if (columns.cols() == 0) return 0;
    Eigen::ColPivHouseholderQR<Matrix> qr(columns);
    qr.setThreshold(dependent);
    return static_cast<int>(qr.rank());
}

// Least Σ (cost_i·x_i)² among the solutions of k·x = right.
Matrix least_cost_solution(const Matrix& k, const Matrix& right, const Vector& cost) {
    Eigen::JacobiSVD<Matrix> svd(k, Eigen::ComputeFullU | Eigen::ComputeFullV);
    svd.setThreshold(1e-11);
    Matrix x = svd.solve(right);
    const Matrix null_space = svd.matrixV().rightCols(k.cols() - svd.rank());
    const Matrix weighted = cost.asDiagonal() * null_space;
    x -= null_space * weighted.completeOrthogonalDecomposition().solve(Matrix(cost.asDiagonal() * x));
    return x;
}

}  // namespace

const Response& Responses::of(const Mode& mode) {
    if (last_ && mode == last_mode_) return *last_;
    std::vector<int> key;
    for (const Hold h : mode.friction) key.push_back(h == Hold::held);
    for (std::size_t m = 0; m < mode.mesh.size(); ++m)
        key.push_back(!system_.meshes[m].lossy() ? 0 : mode.mesh[m] == Hold::held ? 0 : mode.x[m]);
    auto found = cache_.find(key);
    if (found == cache_.end()) found = cache_.emplace(key, build(mode)).first;
    last_mode_ = mode;
    last_ = &found->second;
    return *last_;
}

Response Responses::build(const Mode& mode) const {
    const int n = system_.masses;
    const int meshes = static_cast<int>(system_.meshes.size());
    const int frictions = static_cast<int>(system_.frictions.size());
    struct Row {
        Vector kinematic, force;
        double cost;
        int mesh, friction, loss;
    };
    std::vector<Row> rows;
    double largest_nominal = 1e-300;
    for (const auto& f : system_.frictions) largest_nominal = std::max(largest_nominal, f.nominal);
    const double mesh_cost = 1e-5 / std::sqrt(largest_nominal);
    for (int m = 0; m < meshes; ++m) {
        const auto& mesh = system_.meshes[static_cast<std::size_t>(m)];
        const auto index = static_cast<std::size_t>(m);
        const bool moves = mesh.lossy() && mode.mesh[index] != Hold::held;
        const double loss = moves ? mesh.slope(mode.x[index]) : 0;
        rows.push_back({mesh.column, mesh.column + loss * mesh.loss_column, mesh_cost, m, -1, -1});
    }
    for (int f = 0; f < frictions; ++f) {
        const auto& friction = system_.frictions[static_cast<std::size_t>(f)];
        if (mode.friction[static_cast<std::size_t>(f)] == Hold::held)
            rows.push_back({friction.column, friction.column, 1 / std::sqrt(friction.nominal), -1, f, -1});
    }
    const std::size_t without_held_meshes = rows.size();
    for (int m = 0; m < meshes; ++m) {
        const auto& mesh = system_.meshes[static_cast<std::size_t>(m)];
        if (mesh.lossy() && mode.mesh[static_cast<std::size_t>(m)] == Hold::held)
            rows.push_back({mesh.relative, mesh.loss_column, mesh_cost, -1, -1, m});
    }
    const int r = static_cast<int>(rows.size());
    const Vector root = system_.inertia.cwiseSqrt().cwiseInverse();
    Matrix c(n, r), c_hat(n, r);
    Vector norm(r), cost = Vector::Zero(n + r);
    for (int i = 0; i < r; ++i) {
        const Row& row = rows[static_cast<std::size_t>(i)];
        c.col(i) = root.cwiseProduct(row.kinematic);
        norm[i] = c.col(i).norm();
        c.col(i) /= norm[i];
        c_hat.col(i) = root.cwiseProduct(row.force) / norm[i];  // unknown of the column: torque·norm
        cost[n + i] = row.cost / norm[i];
    }
    Response response;
    const int base = static_cast<int>(without_held_meshes);
    response.redundancy = base - rank_of(c.leftCols(base));
    response.sound = rank_of(c) == base - response.redundancy + (r - base);

    Matrix k = Matrix::Zero(n + r, n + r);
    k.topLeftCorner(n, n).setIdentity();
    k.topRightCorner(n, r) = c_hat;
    k.bottomLeftCorner(r, n) = c.transpose();
    Matrix right = Matrix::Zero(n + r, n);
    right.topRows(n) = root.asDiagonal();
    const bool regular = response.redundancy == 0 && response.sound;
    const Matrix x = regular ? Matrix(k.partialPivLu().solve(right)) : least_cost_solution(k, right, cost);

    response.acceleration = root.asDiagonal() * x.topRows(n);
    response.mesh_torque = Matrix::Zero(meshes, n);
    response.loss_torque = Matrix::Zero(meshes, n);
    response.friction_torque = Matrix::Zero(frictions, n);
    for (int i = 0; i < r; ++i) {
        const Row& row = rows[static_cast<std::size_t>(i)];
        const auto torque = x.row(n + i) / norm[i];
        if (row.mesh >= 0) response.mesh_torque.row(row.mesh) = torque;
        if (row.friction >= 0) response.friction_torque.row(row.friction) = torque;
        if (row.loss >= 0) response.loss_torque.row(row.loss) = torque;
    }
    if (!response.sound) {
        Eigen::JacobiSVD<Matrix> svd(c_hat, Eigen::ComputeFullV);
        svd.setThreshold(1e-11);
        Matrix free = svd.matrixV().rightCols(r - svd.rank());
        if (sharing_ == Sharing::by_loss) {
            Vector share_cost = cost.tail(r);
            Matrix losses = free;
            for (int i = 0; i < r; ++i) {
                const bool loss = rows[static_cast<std::size_t>(i)].loss >= 0;
                if (loss) share_cost[i] = 0;
                if (!loss) losses.row(i).setZero();
            }
            Eigen::JacobiSVD<Matrix> of_losses(losses, Eigen::ComputeFullV);
            of_losses.setThreshold(1e-9);
            const auto rank = of_losses.rank();
            const Matrix kept = free * of_losses.matrixV().rightCols(free.cols() - rank);  // changes no loss
            const Matrix weighted = share_cost.asDiagonal() * kept;
            const auto cheapest = [&](const Matrix& torques) -> Matrix {
                if (kept.cols() == 0) return torques;
                return torques - kept * weighted.completeOrthogonalDecomposition().solve(
                                            Matrix(share_cost.asDiagonal() * torques));
            };
            free = cheapest(free * of_losses.matrixV().leftCols(rank));
            const Matrix start = cheapest(x.bottomRows(r));
            for (int i = 0; i < r; ++i) {
                const Row& row = rows[static_cast<std::size_t>(i)];
                const auto torque = start.row(i) / norm[i];
                if (row.mesh >= 0) response.mesh_torque.row(row.mesh) = torque;
                if (row.friction >= 0) response.friction_torque.row(row.friction) = torque;
            }
        }
        response.mesh_freedom = Matrix::Zero(meshes, free.cols());
        response.loss_freedom = Matrix::Zero(meshes, free.cols());
        response.friction_freedom = Matrix::Zero(frictions, free.cols());
        for (int i = 0; i < r; ++i) {
            const Row& row = rows[static_cast<std::size_t>(i)];
            const auto torque = free.row(i) / norm[i];
            if (row.mesh >= 0) response.mesh_freedom.row(row.mesh) = torque;
            if (row.friction >= 0) response.friction_freedom.row(row.friction) = torque;
            if (row.loss >= 0) response.loss_freedom.row(row.loss) = torque;
        }
        // Losses of meshes that move follow their torques.
        for (int m = 0; m < meshes; ++m) {
            const auto index = static_cast<std::size_t>(m);
            const auto& mesh = system_.meshes[index];
            if (mesh.lossy() && mode.mesh[index] != Hold::held)
                response.loss_freedom.row(m) = mesh.slope(mode.x[index]) * response.mesh_freedom.row(m);
        }
    }
    for (int m = 0; m < meshes; ++m) {
        const auto index = static_cast<std::size_t>(m);
        const auto& mesh = system_.meshes[index];
        if (mesh.lossy() && mode.mesh[index] != Hold::held)
            response.loss_torque.row(m) = mesh.slope(mode.x[index]) * response.mesh_torque.row(m);
    }
    response.projector = Matrix::Identity(n, n);
    if (r > 0) {
        Eigen::CompleteOrthogonalDecomposition<Matrix> decomposition;
        decomposition.setThreshold(dependent);
        decomposition.compute(c);
        response.projector -=
            root.asDiagonal() * (c * decomposition.pseudoInverse()) * root.cwiseInverse().asDiagonal();
        // Rounding of a solution whose torques are huge beside what they leave of a light body's acceleration would make
        // drift what stands still.
        response.acceleration = (response.projector * response.acceleration).eval();
    }
    return response;
}

}  // namespace shiftrig::reference
