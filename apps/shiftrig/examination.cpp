#include "apps/shiftrig/examination.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <ostream>

#include "apps/shiftrig/text_table.h"
#include "plant/rigid_set.h"
#include "plant/structure.h"
#include "plant/warnings.h"

namespace shiftrig::cli {

namespace {

using json = nlohmann::ordered_json;

constexpr double slow_rpm = 1800, fast_rpm = 2100;  // of the gear table

std::vector<double> frequencies(const plant::ModalResult& modal) {
    std::vector<double> result;
    for (const auto& mode : modal.modes) result.push_back(mode.frequency);
    return result;
}

json damped_as_json(const plant::ModalResult& modal) {
    json modes = json::array();
    for (const auto& mode : modal.damped)
        modes.push_back({{"frequency_hz", mode.frequency}, {"damping_ratio", mode.damping_ratio}});
    return modes;
}

json modes_as_json(const Examination& examination, const plant::ModalResult& modal) {
    json modes = json::array();
    for (const auto& mode : modal.modes) {
        json shape = json::object(), kinetic = json::object(), elastic = json::object();
        for (std::size_t i = 0; i < examination.machine.masses.size(); ++i) {
            shape[examination.machine.masses[i].name] = mode.shape[i];
            kinetic[examination.machine.masses[i].name] = mode.kinetic_share[i];
        }
        for (const auto& [device, share] : mode.elastic_share) elastic[device] = share;
        modes.push_back({{"frequency_hz", mode.frequency},
                         {"modal_damping_ratio", mode.damping_ratio},
                         {"shape", shape},
                         {"kinetic_share", kinetic},
                         {"elastic_share", elastic}});
    }
    return modes;
}

std::string joined(const std::vector<std::string>& words, const char* between) {
    std::string text;
    for (const auto& word : words) text += (text.empty() ? "" : between) + word;
    return text;
}

void print_masses(std::ostream& out, const Examination& examination) {
    out << "masses\n";
    TextTable table;
    for (const auto& mass : examination.machine.masses)
        table.row({mass.name, digits(mass.inertia), mass.motion == plant::Motion::rotating ? "kg m²" : "kg"});
    table.print(out);
}

void print_distribution(std::ostream& out, const Examination& examination) {
    out << "\ndistribution matrix (the share of each device's torque that a mass passes into it)\n";
    // Printed by device, because there are more of them than fit across a terminal.
    TextTable table;
    for (std::size_t k = 0; k < examination.devices.size(); ++k) {
        std::string links;
        for (std::size_t j = 0; j < examination.masses.size(); ++j) {
            const double factor =
                examination.distribution(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(k));
            if (factor != 0)
                links += (links.empty() ? "" : ", ") + examination.masses[j] + " " + digits(factor);
        }
        table.row({examination.devices[k] + ":  " + links});
    }
    table.print(out);
}

void print_gears(std::ostream& out, const Examination& examination) {
    if (!examination.gears.empty()) {
        out << "\ngears\n";
        TextTable table;
        table.row({"gear", "ratio", "km/h at 1800", "km/h at 2100", "closed"});
        for (const auto& [variant, modal] : examination.gears)
            table.row({variant.name, variant.ratio ? digits(*variant.ratio) : "-",
                       variant.metres_per_radian ? decimals(variant.kmh(slow_rpm), 2) : "-",
                       variant.metres_per_radian ? decimals(variant.kmh(fast_rpm), 2) : "-",
                       joined(variant.closed, " ")});
        table.print(out);
    }
}

// A line for each gear and state: its frequencies, each in its own words.
template <class Modes, class Say>
std::string listed(const Modes& modes, Say&& say) {
    std::string text;
    for (const auto& mode : modes) text += (text.empty() ? "" : "  ") + say(mode);
    return text.empty() ? "none" : text;
}

void print_frequencies(std::ostream& out, const Examination& examination) {
    TextTable undamped, damped;
    bool shifted = false;
    const auto row = [&](const Examination::Gear& at) {
        const std::string name = at.variant.name + "  ";
        undamped.row({name + listed(at.modal.modes,
                                    [](const plant::Mode& mode) { return digits(mode.frequency, 4); })});
        if (!at.modal.damping_shifts()) return;
        shifted = true;
        damped.row({name + listed(at.modal.damped, [](const plant::DampedMode& mode) {
                        return digits(mode.frequency, 4) + " (" + decimals(mode.damping_ratio, 2) + ")";
                    })});
    };
    for (const auto& gear : examination.gears) row(gear);
    for (const auto& state : examination.states) row(state);
    out << "\nnatural frequencies, undamped, Hz\n";
    undamped.print(out);
    if (!shifted) return;
    out << "\nwith damping, where that shifts one by more than 1 %, Hz (damping ratio)\n";
    damped.print(out);
}

void print_shapes(std::ostream& out, const Examination& examination, const std::string& name,
                  const plant::ModalResult& modal) {
    out << "\nmode shapes, " << name << " (speed of each mass, 1 where most of the kinetic energy is)\n";
    TextTable table;
    std::vector<std::string> head{"Hz"}, damping{"modal damping ratio"};
    for (const auto& mode : modal.modes) {
        head.push_back(digits(mode.frequency, 4));
        damping.push_back(digits(mode.damping_ratio, 2));
    }
    table.row(head);
    table.row(damping);
    for (std::size_t i = 0; i < examination.machine.masses.size(); ++i) {
        std::vector<std::string> row{examination.machine.masses[i].name};
        for (const auto& mode : modal.modes) row.push_back(decimals(mode.shape[i], 3));
        table.row(row);
    }
    table.print(out);
}

std::vector<Examination::TieUp> find_tie_ups(const plant::Description& machine,
                                             const plant::Structure& structure) {
    std::vector<Examination::TieUp> result;
    const auto examine = [&](const std::string& gear, const std::string& with,
                             std::vector<std::string> closed) {
        if (!with.empty()) {
            // A freewheel holds the path as it is; what one more clutch drives it to, it lets go.
            std::erase_if(closed, [&](const std::string& name) {
                const int pair = structure.pair(name);
                return pair >= 0 &&
                       structure.pairs[static_cast<std::size_t>(pair)].kind == plant::PairKind::self_acting;
            });
            closed.push_back(with);
        }
        const auto set = plant::rigid_set(machine, structure, closed, plant::rigid_alone);
        Examination::TieUp found{gear, with, !plant::output_held_by(machine, structure, closed).empty(), {}};
        if (with.empty())
            found.loops = plant::tie_ups(set, structure.inertia);
        else if (auto loop = plant::loop_through(set, structure.inertia, with))
            found.loops.push_back(std::move(*loop));
        if (found.blocks || !found.loops.empty()) result.push_back(std::move(found));
    };
    for (const auto& path : machine.gear_paths) {
        examine(path.name, "", path.closed);
        for (const auto& clutch : machine.clutches)
            if (std::find(path.closed.begin(), path.closed.end(), clutch.name) == path.closed.end())
                examine(path.name, clutch.name, path.closed);
    }
    return result;
}

void print_tie_ups(std::ostream& out, const Examination& examination) {
    if (examination.tie_ups.empty()) return;
    out << "\ntie-ups\n";
    for (const auto& path : examination.machine.gear_paths) {
        std::vector<std::string> blocking;
        for (const auto& tie_up : examination.tie_ups) {
            if (tie_up.gear != path.name) continue;
            if (tie_up.blocks && tie_up.with.empty()) out << "  " << path.name << " blocks the output\n";
            if (tie_up.blocks && !tie_up.with.empty()) blocking.push_back(tie_up.with);
            for (const auto& loop : tie_up.loops)
                out << "  " << path.name << (tie_up.with.empty() ? "" : " with " + tie_up.with) << ": "
                    << joined(loop.devices, ", ")
                    << " form a loop, the split of their torques is not unique\n";
        }
        if (!blocking.empty())
            out << "  " << path.name << " with any of " << joined(blocking, ", ") << " blocks the output\n";
    }
}

}  // namespace

Examination examine(const io::ModelFile& file, double step_size) {
    try {
        Examination result;
        result.machine = file.description;
        plant::BuildOptions build;
        build.step_size = step_size;
        const plant::Model model =
            io::build_model(file, build);  // everything that can be wrong comes out here
        result.engine = model.engine();
        result.engine_reason = model.engine_reason();
        const plant::Structure structure = plant::build_structure(file.description);
        result.masses = structure.mass_names;
        for (const auto& pair : structure.pairs) result.devices.push_back(pair.name);
        for (const auto& mesh : structure.meshes) result.devices.push_back(mesh.name);
        for (const auto& shaft : structure.shafts) result.devices.push_back(shaft.name);
        for (const auto& damper : structure.dampers) result.devices.push_back(damper.name);
        result.distribution.resize(structure.masses(), static_cast<Eigen::Index>(result.devices.size()));
        result.distribution << structure.pair_columns(), structure.mesh_columns(), structure.shaft_columns(),
            structure.damper_columns();
        for (auto& variant : plant::gear_variants(file.description)) {
            auto modal = plant::natural_modes(variant.description, variant.closed);
            result.gears.push_back({std::move(variant), std::move(modal)});
        }
        result.open = plant::natural_modes(file.description, {});
        for (auto& state : plant::other_states(file.description)) {
            auto modal = plant::natural_modes(state.description, state.closed);
            result.states.push_back({std::move(state), std::move(modal)});
        }
        result.tie_ups = find_tie_ups(file.description, structure);
        result.warnings = plant::model_warnings(model);
        return result;
    } catch (const plant::ModelError& error) {
        throw io::located(file, error);
    }
}

nlohmann::ordered_json as_json(const Examination& examination) {
    json masses = json::array(), matrix = json::array(), gears = json::array(), states = json::array(),
         modes = json::object(), tie_ups = json::array();
    for (const auto& mass : examination.machine.masses) {
        const bool rotating = mass.motion == plant::Motion::rotating;
        masses.push_back({{"name", mass.name}, {rotating ? "inertia_kg_m2" : "mass_kg", mass.inertia}});
    }
    for (Eigen::Index j = 0; j < examination.distribution.rows(); ++j) {
        json row = json::array();
        for (const double factor : examination.distribution.row(j)) row.push_back(factor);
        matrix.push_back(row);
    }
    for (const auto& [variant, modal] : examination.gears) {
        json gear = {{"name", variant.name}, {"closed", variant.closed}};
        gear["ratio"] = variant.ratio ? json(*variant.ratio) : json();
        const bool drives_a_body = variant.metres_per_radian.has_value();
        gear["kmh_at_1800_rpm"] = drives_a_body ? json(variant.kmh(slow_rpm)) : json();
        gear["kmh_at_2100_rpm"] = drives_a_body ? json(variant.kmh(fast_rpm)) : json();
        gear["modes_hz"] = frequencies(modal);
        gear["damped_modes"] = damped_as_json(modal);
        gears.push_back(gear);
        modes[variant.name] = modes_as_json(examination, modal);
    }
    for (const auto& tie_up : examination.tie_ups) {
        json loops = json::array();
        for (const auto& loop : tie_up.loops) loops.push_back(loop.devices);
        tie_ups.push_back({{"gear", tie_up.gear},
                           {"with", tie_up.with.empty() ? json() : json(tie_up.with)},
                           {"blocks", tie_up.blocks},
                           {"loops", loops}});
    }
    for (const auto& [state, modal] : examination.states) {
        states.push_back({{"name", state.name},
                          {"closed", state.closed},
                          {"modes_hz", frequencies(modal)},
                          {"damped_modes", damped_as_json(modal)}});
        modes[state.name] = modes_as_json(examination, modal);
    }
    modes["open"] = modes_as_json(examination, examination.open);
    return {
        {"name", examination.machine.name},
        {"engine", examination.engine},
        {"engine_reason", examination.engine_reason},
        {"masses", masses},
        {"distribution_matrix",
         {{"masses", examination.masses}, {"devices", examination.devices}, {"values", matrix}}},
        {"gears", gears},
        {"open",
         {{"modes_hz", frequencies(examination.open)}, {"damped_modes", damped_as_json(examination.open)}}},
        {"states", states},
        {"modes", modes},
        {"tie_ups", tie_ups},
        {"warnings", examination.warnings}};
}

void print(std::ostream& out, const Examination& examination, bool with_shapes) {
    out << examination.machine.name << " (" << examination.machine.masses.size() << " masses, "
        << examination.devices.size() << " devices, integrated by " << examination.engine << ": "
        << examination.engine_reason << ")\n\n";
    print_masses(out, examination);
    print_distribution(out, examination);
    print_gears(out, examination);
    print_frequencies(out, examination);
    if (with_shapes) {
        for (const auto& [variant, modal] : examination.gears)
            print_shapes(out, examination, variant.name, modal);
        for (const auto& [state, modal] : examination.states)
            print_shapes(out, examination, state.name, modal);
    }
    print_tie_ups(out, examination);
    if (!examination.warnings.empty()) out << "\nwarnings\n";
    for (const auto& warning : examination.warnings) out << "  " << warning << '\n';
}

}  // namespace shiftrig::cli
