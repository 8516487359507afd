#include "plant/structure.h"

#include <algorithm>

#include "plant/laws/friction.h"
#include "plant/laws/plough.h"
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

// What a friction pair carries at its nominal engagement; only the proportions matter.
double nominal_capacity(const Clutch& clutch) {
    if (const auto* dry = std::get_if<DryFriction>(&clutch.friction)) return dry->sliding_capacity;
    const auto& wet = std::get<WetPlates>(clutch.friction);
    const auto* hydraulic = std::get_if<ActuationHydraulic>(&clutch.actuation);
    const double pressure = hydraulic ? hydraulic->maximum_pressure : 2 * wet.return_pressure + 1e5;
    const FrictionLaw law = friction_law(wet);
    return static_capacity(law, load_from_pressure(law, pressure));
}

// Draft of all ploughs on a body at walking pace, and its tyres' motion resistance, [N].
double nominal_resistance(const Description& d, const std::string& body) {
    double force = 0;
    for (const BrixiusTyre& tyre : d.tyres) {
        if (tyre.body == body) force += tyre.weight / tyre.mobility_number;
    }
    for (const Plough& plough : d.ploughs) {
        if (plough.body == body) force += plough_draft(plough, 0, 1);
    }
    return force;
}

bool is_resisted(const Description& d, const std::string& body) {
    const auto on_body = [&](const auto& device) { return device.body == body; };
    return std::any_of(d.tyres.begin(), d.tyres.end(), on_body) ||
           std::any_of(d.ploughs.begin(), d.ploughs.end(), on_body);
}

}  // namespace

int Structure::mass(std::string_view name) const noexcept {
    for (std::size_t i = 0; i < mass_names.size(); ++i) {
        if (mass_names[i] == name) return static_cast<int>(i);
    }
    return -1;
}
int Structure::pair(std::string_view name) const noexcept { return find_by_name(pairs, name); }
int Structure::mesh(std::string_view name) const noexcept { return find_by_name(meshes, name); }

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

Structure build_structure(const Description& d) {
    validate(d);
    Structure s;
    for (const Mass& mass : d.masses) {
        s.mass_names.push_back(mass.name);
        s.inertia.push_back(mass.inertia);
    }
    const auto link = [&](const std::string& name, double factor) {
        return name.empty() ? Link{} : Link{s.mass(name), factor};
    };

    for (std::size_t i = 0; i < d.clutches.size(); ++i) {
        const Clutch& c = d.clutches[i];
        const double b = c.radius > 0 ? -1 / c.radius : -1;
        s.pairs.push_back({c.name, PairKind::clutch, static_cast<int>(i), {link(c.a, 1), link(c.b, b)},
                           nominal_capacity(c)});
    }
    for (std::size_t i = 0; i < d.freewheels.size(); ++i) {
        const Freewheel& f = d.freewheels[i];
        s.pairs.push_back({f.name,
                           PairKind::freewheel,
                           static_cast<int>(i),
                           {link(f.a, 1), link(f.b, -1)},
                           f.rated_torque});
    }
    for (std::size_t i = 0; i < d.tyres.size(); ++i) {
        const BrixiusTyre& t = d.tyres[i];
        if (t.rolling_coefficient <= 0) continue;
        s.pairs.push_back({t.name + ".rolling", PairKind::rolling, static_cast<int>(i), {link(t.wheel, 1), Link{}},
                           t.rolling_coefficient * t.weight * t.radius});
    }
    for (std::size_t i = 0; i < d.masses.size(); ++i) {
        const std::string& name = d.masses[i].name;
        if (!is_resisted(d, name)) continue;
        s.pairs.push_back({name + ".resistance", PairKind::body_resistance, static_cast<int>(i),
                           {link(name, 1), Link{}}, nominal_resistance(d, name)});
    }

    for (std::size_t i = 0; i < d.engines.size(); ++i) {
        const Engine& e = d.engines[i];
        if (e.stall_speed <= 0 || e.friction_constant <= 0) continue;
        s.pairs.push_back({e.name + ".friction", PairKind::engine_friction, static_cast<int>(i),
                           {link(e.mass, 1), Link{}}, e.friction_constant});
    }

    for (std::size_t i = 0; i < d.gears.size(); ++i) {
        const Gear& g = d.gears[i];
        const double backward = g.backward_efficiency > 0 ? g.backward_efficiency : g.efficiency;
        const double bearing = g.backward_bearing_torque >= 0 ? g.backward_bearing_torque : g.bearing_torque;
        s.meshes.push_back({g.name, false, static_cast<int>(i), s.mass(g.a), s.mass(g.b), -1, g.ratio,
                            g.efficiency, backward, g.bearing_torque, bearing});
    }
    for (std::size_t i = 0; i < d.planetaries.size(); ++i) {
        const Planetary& p = d.planetaries[i];
        s.meshes.push_back({p.name, true, static_cast<int>(i), s.mass(p.sun), s.mass(p.ring), s.mass(p.carrier),
                            p.ratio, p.efficiency, p.efficiency, 0, 0});
    }

    for (std::size_t i = 0; i < d.shafts.size(); ++i) {
        const Shaft& e = d.shafts[i];
        s.shafts.push_back(
            {e.name, {link(e.a, 1), link(e.b, -1)}, e.stiffness, e.damping, static_cast<int>(i), 0});
    }
    for (std::size_t i = 0; i < d.backlashes.size(); ++i) {
        const Backlash& e = d.backlashes[i];
        s.shafts.push_back(
            {e.name, {link(e.a, 1), link(e.b, -1)}, e.stiffness, e.damping, static_cast<int>(i), e.gap});
    }
    for (std::size_t i = 0; i < d.dampers.size(); ++i) {
        const Damper& k = d.dampers[i];
        s.dampers.push_back({k.name, {link(k.a, 1), link(k.b, -1)}, 0, k.damping, static_cast<int>(i), 0});
    }
    return s;
}

}  // namespace shiftrig::plant
