#include "analysis/gears.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "plant/structure.h"

namespace shiftrig::analysis {

namespace {

using Column = std::vector<plant::Link>;

bool contains(const std::vector<std::string>& list, const std::string& name) {
    return std::find(list.begin(), list.end(), name) != list.end();
}

template <class Links>
Column column_of(const Links& links) {
    Column column;
    for (const plant::Link& link : links) {
        if (link.mass >= 0 && link.factor != 0) column.push_back(link);
    }
    return column;
}

// Number of devices between a mass and every other one.
std::vector<int> distances(int from, int masses, const std::vector<Column>& devices) {
    constexpr int far = std::numeric_limits<int>::max();
    std::vector<int> distance(static_cast<std::size_t>(masses), far);
    if (from < 0) return distance;
    distance[static_cast<std::size_t>(from)] = 0;
    for (int step = 0; step < masses; ++step) {
        for (const Column& device : devices) {
            const bool reached = std::any_of(device.begin(), device.end(), [&](const plant::Link& link) {
                return distance[static_cast<std::size_t>(link.mass)] == step;
            });
            if (!reached) continue;
            for (const plant::Link& link : device) {
                int& d = distance[static_cast<std::size_t>(link.mass)];
                d = std::min(d, step + 1);
            }
        }
    }
    return distance;
}

// Masses that the rigid devices join with those of `seeds`.
std::vector<bool> joined(int masses, const std::vector<Column>& rigid, const std::vector<Column>& seeds) {
    std::vector<bool> in(static_cast<std::size_t>(masses), false);
    const auto mark = [&in](const Column& device) {
        bool changed = false;
        for (const plant::Link& link : device) {
            auto place = in.begin() + link.mass;
            changed |= !*place;
            *place = true;
        }
        return changed;
    };
    for (const Column& seed : seeds) mark(seed);
    for (bool changed = true; changed;) {
        changed = false;
        for (const Column& device : rigid) {
            const bool touches = std::any_of(device.begin(), device.end(), [&in](const plant::Link& link) {
                return in[static_cast<std::size_t>(link.mass)];
            });
            if (touches) changed |= mark(device);
        }
    }
    return in;
}

int nearest(const std::vector<int>& distance, const std::vector<bool>& among) {
    int best = -1;
    for (std::size_t i = 0; i < distance.size(); ++i) {
        if (among[i] && (best < 0 || distance[i] < distance[static_cast<std::size_t>(best)]))
            best = static_cast<int>(i);
    }
    return best;
}

struct GivenSpeed {
    int mass;
    double speed;
};

// Σ factor · speed over the links of `asked`, from the columns of the rigid devices and the speeds given: of all
// solutions the smallest. None if the given speeds contradict the devices, or if the answer depends on that choice
// (a null vector of the system moves it).
std::optional<double> speed_across(const Column& asked, const std::vector<GivenSpeed>& given, int masses,
                                   const std::vector<Column>& rigid) {
    const auto devices = static_cast<Eigen::Index>(rigid.size());
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(devices + static_cast<Eigen::Index>(given.size()), masses);
    Eigen::VectorXd wanted = Eigen::VectorXd::Zero(rows.rows());
    for (Eigen::Index k = 0; k < devices; ++k) {
        for (const plant::Link& link : rigid[static_cast<std::size_t>(k)]) rows(k, link.mass) += link.factor;
    }
    Eigen::Index row = devices;
    for (const GivenSpeed& each : given) {
        rows(row, each.mass) = 1;
        wanted(row++) = each.speed;
    }
    Eigen::VectorXd direction = Eigen::VectorXd::Zero(masses);
    for (const plant::Link& link : asked) direction(link.mass) += link.factor;
    const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver(rows);
    const Eigen::VectorXd speed = solver.solve(wanted);
    if ((rows * speed - wanted).norm() > 1e-9) return std::nullopt;
    if ((direction - solver.pseudoInverse() * (rows * direction)).norm() > 1e-9) return std::nullopt;
    return direction.dot(speed);
}

// ω_in/ω_out.
std::optional<double> ratio_between(int in, int out, int masses, const std::vector<Column>& rigid) {
    const auto speed = speed_across({{out, 1}}, {{in, 1}}, masses, rigid);
    if (!speed || std::abs(*speed) < 1e-12) return std::nullopt;
    return 1 / *speed;
}

std::vector<Column> meshes_of(const plant::Structure& structure) {
    std::vector<Column> meshes;
    for (const plant::Mesh& mesh : structure.meshes) meshes.push_back(column_of(mesh.column(mesh.ratio)));
    return meshes;
}

}  // namespace

std::vector<Gear> gears_of(const plant::Description& description) {
    const plant::Structure structure = plant::build_structure(description);
    const int masses = structure.masses();
    const std::vector<Column> meshes = meshes_of(structure);
    std::vector<Column> all = meshes;
    for (const plant::FrictionPair& pair : structure.pairs) all.push_back(column_of(pair.links));
    for (const plant::Elastic& shaft : structure.shafts) all.push_back(column_of(shaft.links));
    for (const plant::Elastic& damper : structure.dampers) all.push_back(column_of(damper.links));
    for (const plant::TorqueConverter& converter : description.converters) {
        all.push_back({{structure.mass(converter.pump), 1}, {structure.mass(converter.turbine), -1}});
    }
    const std::vector<int> from_input = distances(structure.mass(description.input_mass), masses, all);
    const std::vector<int> from_output = distances(structure.mass(description.output_mass), masses, all);

    const auto closed_in_every_gear = [&](const std::string& clutch) {
        return description.gear_paths.size() > 1 &&
               std::all_of(description.gear_paths.begin(), description.gear_paths.end(),
                           [&](const plant::GearPath& path) { return contains(path.closed, clutch); });
    };
    std::vector<Gear> gears;
    for (const plant::GearPath& path : description.gear_paths) {
        Gear gear;
        gear.name = path.name;
        std::vector<Column> rigid = meshes, seeds;
        for (const std::string& clutch : path.closed) {
            const int pair = structure.pair(clutch);
            if (pair < 0) continue;
            rigid.push_back(column_of(structure.pairs[static_cast<std::size_t>(pair)].links));
            if (structure.pairs[static_cast<std::size_t>(pair)].kind == plant::PairKind::self_acting) {
                seeds.push_back(rigid.back());  // locks by itself: nobody chooses a gear with it
                continue;
            }
            if (closed_in_every_gear(clutch)) {
                gear.common.push_back(clutch);
            } else {
                gear.selecting.push_back(clutch);
                seeds.push_back(rigid.back());
            }
        }
        const std::vector<bool> gearbox = joined(masses, rigid, seeds);
        const int in = nearest(from_input, gearbox), out = nearest(from_output, gearbox);
        if (in >= 0 && out >= 0) {
            gear.in = structure.mass_names[static_cast<std::size_t>(in)];
            gear.out = structure.mass_names[static_cast<std::size_t>(out)];
            gear.ratio = ratio_between(in, out, masses, rigid);
        }
        gears.push_back(std::move(gear));
    }
    return gears;
}

std::optional<double> slip_per_input_speed(const plant::Description& description, const Gear& from,
                                           const Gear& to, const std::string& clutch) {
    const plant::Structure structure = plant::build_structure(description);
    const int asked = structure.pair(clutch), in = structure.mass(to.in), out = structure.mass(to.out);
    if (asked < 0 || in < 0 || out < 0) return std::nullopt;
    std::vector<Column> rigid = meshes_of(structure);
    std::vector<std::string> held;  // by the old gear
    for (const plant::GearPath& path : description.gear_paths) {
        if (path.name == from.name) held = path.closed;
    }
    for (const plant::GearPath& path : description.gear_paths) {
        if (path.name != to.name) continue;
        for (const std::string& name : path.closed) {
            const int pair = structure.pair(name);
            if (pair >= 0 && contains(held, name))
                rigid.push_back(column_of(structure.pairs[static_cast<std::size_t>(pair)].links));
        }
    }
    const Column slip = column_of(structure.pairs[static_cast<std::size_t>(asked)].links);
    return speed_across(slip, {{in, 1}, {out, 0}}, structure.masses(), rigid);
}

}  // namespace shiftrig::analysis
