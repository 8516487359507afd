#include "tests/plant/reference/system.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace shiftrig::reference {
namespace {

Vector unit(int size, int i) {
    return Vector::Unit(size, i);
}

void collect_breaks(const plant::Waveform& waveform, std::vector<double>& breaks) {
    for (const auto& piece : waveform.pieces)
        for (const double time : {piece.from, piece.until})
            if (time > 0 && time < 1e9) breaks.push_back(time);
}

double slip_factor(const plant::DryFriction& law, double slip) {
    const auto& table = law.factor_over_slip;
    if (table.empty())
        return law.falling > 0 ? 1 - law.falling * (1 - std::exp(-slip / law.falling_speed)) : 1;
    if (table.size() == 1 || slip <= table.front().first) return table.front().second;
    std::size_t right = 1;
    while (right + 1 < table.size() && table[right].first < slip) ++right;
    const auto& [x0, y0] = table[right - 1];
    const auto& [x1, y1] = table[right];
    return std::max(0.0, y0 + (y1 - y0) * (slip - x0) / (x1 - x0));
}

Friction friction_of(const plant::Clutch& clutch, const System& system) {
    const auto* law = std::get_if<plant::DryFriction>(&clutch.friction);
    const auto* direct = std::get_if<plant::ActuationDirect>(&clutch.actuation);
    if (!law || !(direct || std::holds_alternative<plant::ActuationConstant>(clutch.actuation)))
        throw std::invalid_argument("reference: clutch " + clutch.name + " is of a kind it does not know");
    Friction result;
    result.name = clutch.name;
    result.column = unit(system.masses, system.mass(clutch.a));
    if (!clutch.b.empty())
        result.column -=
            unit(system.masses, system.mass(clutch.b)) / (clutch.radius > 0 ? clutch.radius : 1.0);
    result.nominal = law->sliding_capacity;
    for (std::size_t i = 1; i < law->factor_over_slip.size(); ++i) {
        const auto& [x0, y0] = law->factor_over_slip[i - 1];
        const auto& [x1, y1] = law->factor_over_slip[i];
        result.steepest = std::max(result.steepest, law->sliding_capacity * std::abs((y1 - y0) / (x1 - x0)));
    }
    result.initially_held = clutch.initially_locked;
    const plant::Waveform profile = direct ? direct->profile : plant::Waveform{};
    const double constant = direct ? direct->initial : 1.0;
    const auto engagement = [profile, constant](When when) {
        return profile.pieces.empty() ? constant : std::max(0.0, evaluate(profile, when));
    };
    result.sliding = [law = *law, engagement](When when, const Vector&, double slip) {
        return law.sliding_capacity * engagement(when) * slip_factor(law, std::abs(slip));
    };
    result.holding = [law = *law, engagement](When when, const Vector&) {
        return law.static_ratio * law.sliding_capacity * engagement(when) * slip_factor(law, 0);
    };
    return result;
}

}  // namespace

double evaluate(const plant::Waveform& waveform, When when) {
    double sum = 0;
    for (const auto& p : waveform.pieces) {
        if (when.inside < p.from || when.inside >= p.until) continue;
        sum += p.offset;
        if (p.slope != 0) sum += p.slope * (when.t - p.from);
        if (p.amplitude != 0)
            sum += p.amplitude * std::sin(2 * std::numbers::pi * p.frequency * (when.t - p.phase_time));
    }
    return sum;
}

int System::mass(const std::string& name) const {
    const auto found = std::find(mass_names.begin(), mass_names.end(), name);
    if (found == mass_names.end()) throw std::invalid_argument("reference: no mass " + name);
    return static_cast<int>(found - mass_names.begin());
}

System::System(const plant::Description& d) {
    masses = static_cast<int>(d.masses.size());
    const int plain = static_cast<int>(d.shafts.size());
    shafts = plain + static_cast<int>(d.backlashes.size());
    inertia.resize(masses);
    start = Vector::Zero(masses + shafts);
    for (int i = 0; i < masses; ++i) {
        const auto& m = d.masses[static_cast<std::size_t>(i)];
        mass_names.push_back(m.name);
        inertia[i] = m.inertia;
        start[i] = m.initial_speed;
    }
    shaft_columns = Matrix::Zero(masses, shafts);
    stiffness.resize(shafts);
    damping.resize(shafts);
    for (int e = 0; e < plain; ++e) {
        const auto& s = d.shafts[static_cast<std::size_t>(e)];
        shaft_names.push_back(s.name);
        shaft_columns.col(e) += unit(masses, mass(s.a));
        if (!s.b.empty()) shaft_columns.col(e) -= unit(masses, mass(s.b));
        stiffness[e] = s.stiffness;
        damping[e] = s.damping;
        start[masses + e] = s.initial_twist;
    }
    for (int e = plain; e < shafts; ++e) {
        const auto& b = d.backlashes[static_cast<std::size_t>(e - plain)];
        shaft_names.push_back(b.name);
        shaft_columns.col(e) += unit(masses, mass(b.a)) - unit(masses, mass(b.b));
        stiffness[e] = damping[e] = 0;
        start[masses + e] = b.initial_twist;
        plays.push_back({b.name, e, b.stiffness, b.damping, 0.5 * b.gap});
    }
    damper = Matrix::Zero(masses, masses);
    for (const auto& k : d.dampers) {
        Vector c = unit(masses, mass(k.a));
        if (!k.b.empty()) c -= unit(masses, mass(k.b));
        damper += k.damping * c * c.transpose();
    }
    for (const auto& clutch : d.clutches) {
        frictions.push_back(friction_of(clutch, *this));
        if (const auto* direct = std::get_if<plant::ActuationDirect>(&clutch.actuation))
            collect_breaks(direct->profile, breaks);
    }
    for (const auto& f : d.freewheels) {
        Friction friction;
        friction.name = f.name;
        friction.column = unit(masses, mass(f.a));
        if (!f.b.empty()) friction.column -= unit(masses, mass(f.b));
        friction.nominal = f.rated_torque;
        friction.sense = f.blocks == plant::Sense::forward ? 1 : -1;
        friction.drag = f.drag_torque;
        const double sliding = f.sliding_share * f.rated_torque, holding = f.rated_torque;
        friction.sliding = [sliding](When, const Vector&, double) { return sliding; };
        friction.holding = [holding](When, const Vector&) { return holding; };
        frictions.push_back(friction);
    }
    const auto add_mesh = [this](const std::string& name, double u, double eta, int one, int two,
                                 int carrier) {
        const Vector housing = Vector::Zero(masses);
        const Vector c = carrier < 0 ? housing : unit(masses, carrier);
        Mesh mesh;
        mesh.name = name;
        mesh.ratio = u;
        mesh.efficiency = mesh.backward_efficiency = eta;
        mesh.relative = unit(masses, one) - c;
        mesh.loss_column = u * (unit(masses, two) - c);
        mesh.column = mesh.relative - mesh.loss_column;  // Willis: (ω1 − ωc) − u (ω2 − ωc) = 0
        meshes.push_back(mesh);
    };
    for (const auto& g : d.gears) {
        add_mesh(g.name, g.ratio, g.efficiency, mass(g.a), mass(g.b), -1);
        meshes.back().bearing = meshes.back().backward_bearing = g.bearing_torque;
        if (g.backward_efficiency > 0) meshes.back().backward_efficiency = g.backward_efficiency;
        if (g.backward_bearing_torque >= 0) meshes.back().backward_bearing = g.backward_bearing_torque;
    }
    for (const auto& p : d.planetaries)
        add_mesh(p.name, p.ratio, p.efficiency, mass(p.sun), mass(p.ring), mass(p.carrier));
    for (const auto& s : d.sources) {
        sources.push_back(s);
        source_mass.push_back(mass(s.mass));
        collect_breaks(s.waveform, breaks);
    }
    if (!d.tyres.empty() || !d.converters.empty() || !d.engines.empty() || !d.roads.empty() ||
        !d.ploughs.empty())
        throw std::invalid_argument("reference: a law it does not know; add it through System::law");
    std::sort(breaks.begin(), breaks.end());
    breaks.erase(std::unique(breaks.begin(), breaks.end()), breaks.end());
}

void System::force(When when, const Vector& z, Vector& out, Eigen::Ref<Vector> extra_rate) const {
    const auto omega = z.head(masses);
    out.noalias() = -(damper * omega);
    for (int e = 0; e < shafts; ++e) {
        const auto column = shaft_columns.col(e);
        out.noalias() -= column * (stiffness[e] * z[masses + e] + damping[e] * column.dot(omega));
    }
    for (std::size_t s = 0; s < sources.size(); ++s) {
        const double w = z[source_mass[s]];
        out[source_mass[s]] += evaluate(sources[s].waveform, when) - sources[s].quadratic * w * std::abs(w);
    }
    if (law) law(when, z, out, extra_rate);
}

}  // namespace shiftrig::reference
