#include "plant/structure.h"

#include <algorithm>
#include <utility>

#include "plant/assembly.h"
#include "plant/connectors.h"
#include "plant/validation.h"

namespace shiftrig::plant {
namespace {

template <typename Items>
int find_by_name(const Items& items, std::string_view name) noexcept {
    for (std::size_t i = 0; i < items.size(); ++i) {
        if (items[i].name == name) return static_cast<int>(i);
    }
    return -1;
}

template <typename Links>
void put(Eigen::MatrixXd& matrix, int column, const Links& links) {
    for (const Link& link : links) {
        if (link.mass >= 0) matrix(link.mass, column) += link.factor;
    }
}

}  // namespace

int Structure::mass(std::string_view name) const noexcept {
    for (std::size_t i = 0; i < mass_names.size(); ++i) {
        if (mass_names[i] == name) return static_cast<int>(i);
    }
    return -1;
}
int Structure::pair(std::string_view name) const noexcept {
    return find_by_name(pairs, name);
}
int Structure::mesh(std::string_view name) const noexcept {
    return find_by_name(meshes, name);
}

Eigen::MatrixXd Structure::pair_columns() const {
    Eigen::MatrixXd a = Eigen::MatrixXd::Zero(masses(), static_cast<int>(pairs.size()));
    for (int k = 0; k < a.cols(); ++k) put(a, k, pairs[static_cast<std::size_t>(k)].links);
    return a;
}

Eigen::MatrixXd Structure::mesh_columns() const {
    const std::vector<int> ideal(meshes.size(), 0);
    return mesh_force_columns(ideal);
}

Eigen::MatrixXd Structure::mesh_force_columns(std::span<const int> x) const {
    Eigen::MatrixXd a = Eigen::MatrixXd::Zero(masses(), static_cast<int>(meshes.size()));
    for (std::size_t k = 0; k < meshes.size(); ++k) {
        put(a, static_cast<int>(k), meshes[k].column(meshes[k].force_ratio(x[k])));
    }
    return a;
}

Eigen::MatrixXd Structure::shaft_columns() const {
    Eigen::MatrixXd a = Eigen::MatrixXd::Zero(masses(), static_cast<int>(shafts.size()));
    for (int k = 0; k < a.cols(); ++k) put(a, k, shafts[static_cast<std::size_t>(k)].links);
    return a;
}

Eigen::MatrixXd Structure::damper_columns() const {
    Eigen::MatrixXd a = Eigen::MatrixXd::Zero(masses(), static_cast<int>(dampers.size()));
    for (int k = 0; k < a.cols(); ++k) put(a, k, dampers[static_cast<std::size_t>(k)].links);
    return a;
}

Assembly::Assembly(const Description& d) : resistance_(d.masses.size()) {
    for (const Mass& mass : d.masses) {
        structure.mass_names.push_back(mass.name);
        structure.inertia.push_back(mass.inertia);
    }
}

void Assembly::resist(const std::string& body, double force) {
    auto& sum = resistance_[static_cast<std::size_t>(mass(body))];
    sum = sum.value_or(0) + force;
}

Structure Assembly::finish() {
    for (std::size_t i = 0; i < resistance_.size(); ++i) {
        if (!resistance_[i]) continue;
        structure.pairs.push_back({structure.mass_names[i] + ".resistance",
                                   PairKind::body_resistance,
                                   {Link{static_cast<int>(i), 1}, Link{}},
                                   *resistance_[i]});
    }
    std::stable_sort(structure.pairs.begin(), structure.pairs.end(),
                     [](const FrictionPair& a, const FrictionPair& b) { return a.kind < b.kind; });
    // Whichever order connectors came in: a shaft with play has a contact byte behind, rows are shown as the last meshes.
    std::stable_partition(structure.shafts.begin(), structure.shafts.end(),
                          [](const Elastic& shaft) { return shaft.gap == 0; });
    std::stable_partition(structure.meshes.begin(), structure.meshes.end(),
                          [](const Mesh& mesh) { return !mesh.planetary; });
    return std::move(structure);
}

Structure build_structure(const Description& d) {
    validate(d);
    Assembly assembly(d);
    for_each_connector(d, [&](const auto& connector) { assemble(assembly, connector); });
    return assembly.finish();
}

}  // namespace shiftrig::plant
