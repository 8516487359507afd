// shiftrig statics: internal torque on every link of every device at zero acceleration.
#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/shiftrig/arguments.h"
#include "apps/shiftrig/command.h"
#include "apps/shiftrig/text_table.h"
#include "io/model_file.h"
#include "io/nearest.h"
#include "plant/connectors.h"
#include "plant/statics.h"

namespace shiftrig::cli {
namespace {

struct Options {
    std::string model;
    std::vector<std::string> closed, inputs, speeds, options;
    std::string output;
    bool ideal = false, json = false;
};

const char* torque_unit(bool translating) {
    return translating ? "N" : "Nm";
}
const char* speed_unit(bool translating) {
    return translating ? "m/s" : "rad/s";
}
// Of input over output.
const char* ratio_unit(const plant::StaticsResult& result) {
    if (result.input.translating == result.output.translating) return "1";
    return result.output.translating ? "rad/m" : "m/rad";
}

nlohmann::ordered_json as_json(const plant::StaticsResult& result) {
    using json = nlohmann::ordered_json;
    json links = json::object(), link_units = links, meshes = links, nodes = links;
    for (const auto& link : result.links) {
        links[link.name] = link.torque;
        link_units[link.name] = torque_unit(link.translating);
    }
    for (const auto& mesh : result.meshes)
        meshes[mesh.name] = {{"x", mesh.x}, {"power_w", mesh.power}, {"loss_w", mesh.loss}};
    for (const auto& node : result.nodes)
        nodes[node.name] = {{"speed", node.speed},
                            {"external", node.external},
                            {"residual", node.residual},
                            {"speed_unit", speed_unit(node.translating)},
                            {"torque_unit", torque_unit(node.translating)}};
    const auto or_null = [](const std::optional<double>& value) { return value ? json(*value) : json(); };
    return {{"links", links},
            {"link_units", link_units},
            {"meshes", meshes},
            {"nodes", nodes},
            {"output_torque", result.output_torque},
            {"output_torque_unit", torque_unit(result.output.translating)},
            {"output_held", result.output_held},
            {"self_locking", result.output_driven},
            {"at_rest", result.at_rest},
            {"ratio", or_null(result.ratio)},
            {"ratio_unit", ratio_unit(result)},
            {"efficiency", or_null(result.efficiency)},
            {"power_in_w", result.power_in},
            {"loss_w", result.loss},
            {"loss_at_rest", result.loss_at_rest},
            {"worst_residual", result.worst_residual},
            {"shared_by_stiffness", result.shared_by_stiffness},
            {"split_not_unique", result.split_not_unique},
            {"tie_up", result.tie_up},
            {"directions_settled", result.directions_settled}};
}

std::string words(const std::vector<std::string>& names) {
    std::string text;
    for (const auto& name : names) text += (text.empty() ? "" : " ") + name;
    return text;
}

void print_summary(const plant::StaticsResult& result, bool ideal) {
    const char* const unit = torque_unit(result.output.translating);
    const std::string torque = decimals(result.output_torque, 4) + " " + unit;
    std::cout << '\n' << (result.output_held ? "output held" : "output torque " + torque);
    if (result.ratio) {
        std::cout << ", ratio " << decimals(*result.ratio, 4);
        if (result.input.translating != result.output.translating) std::cout << ' ' << ratio_unit(result);
    }
    if (result.at_rest) std::cout << ", at rest";
    if (result.efficiency) std::cout << ", efficiency " << decimals(*result.efficiency, 4);
    std::cout << (ideal ? " (losses left out)" : "") << '\n';
    if (result.output_driven)
        std::cout << "self-locking in this direction: the output has to be driven as well, with " << torque
                  << " (" << decimals(result.output_torque * result.output.speed, 4)
                  << " W); all that is put in is lost\n";
    if (!result.loss_at_rest.empty())
        std::cout << "losses at rest are not determined: " << words(result.loss_at_rest)
                  << " may take any up to their limit, either way; the torques shown are those without\n";
    if (!result.shared_by_stiffness.empty())
        std::cout << "loop: " << words(result.shared_by_stiffness)
                  << " share by the stiffness of the shafts, untwisted without load\n";
    if (result.split_not_unique)
        std::cout << "tie-up: the split between " << words(result.tie_up)
                  << " is not unique; shared by capacity\n";
    if (!result.directions_settled)
        std::cout << "no consistent directions of power were found (self-locking, or an η below 0.5): the "
                     "torques shown cannot be\n";
}

void print(const plant::StaticsResult& result, const Options& options) {
    TextTable links;
    links.row({"link", "node", "torque", "", "speed", ""});
    for (const auto& link : result.links)
        links.row({link.name, link.node, decimals(link.torque, 4), torque_unit(link.translating),
                   decimals(link.speed, 4), speed_unit(link.translating)});
    links.print(std::cout, "");
    if (!result.meshes.empty()) {
        std::cout << '\n';
        TextTable meshes;
        meshes.row({"mesh", "x", "power W", "loss W"});
        for (const auto& mesh : result.meshes)
            meshes.row({mesh.name, std::to_string(mesh.x), decimals(mesh.power, 4), decimals(mesh.loss, 4)});
        meshes.print(std::cout, "");
    }
    print_summary(result, options.ideal);
}

// One of the model's names in an option, "--closed C1".
void require_name(const io::ModelFile& file, const std::string& option, const std::string& name,
                  const std::vector<std::string>& known, const char* what) {
    if (std::find(known.begin(), known.end(), name) == known.end())
        throw CLI::ValidationError(option + " " + name, file.path + " has no " + what + " of this name" +
                                                            io::nearest_hint(name, known));
}

void check_names(const io::ModelFile& file, const plant::StaticsProblem& problem) {
    std::vector<std::string> closable, masses;
    plant::for_each_connector(file.description, [&](const auto& device) {
        if (may_be_closed(device)) closable.push_back(device.name);
    });
    for (const auto& mass : file.description.masses) masses.push_back(mass.name);
    for (auto name = problem.closed.begin(); name != problem.closed.end(); ++name) {
        require_name(file, "--closed", *name, closable, "clutch, brake or freewheel");
        if (std::find(problem.closed.begin(), name, *name) != name)
            throw CLI::ValidationError("--closed " + *name, "must be named once");
    }
    for (const auto& input : problem.inputs) require_name(file, "--input", input.first, masses, "mass");
    for (const auto& speed : problem.speeds) require_name(file, "--speed", speed.first, masses, "mass");
    if (!problem.output.empty()) require_name(file, "--output", problem.output, masses, "mass");
}

int run(const Options& options) {
    io::ModelFile file = io::read_model(options.model);
    for (const auto& text : options.options) {
        const auto [gear, option] = named_word("--option", text);
        select_option(file, gear, option);
    }
    plant::StaticsProblem problem;
    problem.closed = options.closed;
    for (const auto& text : options.inputs) problem.inputs.push_back(named_number("--input", text));
    for (const auto& text : options.speeds) problem.speeds.push_back(named_number("--speed", text));
    problem.output = options.output;
    problem.ideal = options.ideal;

    check_names(file, problem);
    const auto result = plant::solve_statics(file.description, problem);
    if (options.json)
        std::cout << as_json(result).dump(2) << '\n';
    else
        print(result, options);
    return result.directions_settled ? good : failed;
}

Command::Run declare_statics(CLI::App& app) {
    auto options = std::make_shared<Options>();
    app.add_option("MODEL", options->model, "model file (YAML)")->required();
    app.add_option("--closed", options->closed, "clutches and brakes that are closed: C1,C3")->delimiter(',');
    app.add_option(
           "--input", options->inputs,
           "NODE=TORQUE on a mass, in Nm (N on a translating one); several: in balance with the losses, "
           "where nothing holds them")
        ->delimiter(',')
        ->required();
    app.add_option(
           "--speed", options->speeds,
           "NODE=VALUE in rad/s (m/s); otherwise the first input turns at +1. 0: at rest, where losses are "
           "not determined and closed clutches may hold the machine")
        ->delimiter(',');
    app.add_option(
        "--output", options->output,
        "the mass that absorbs, unless closed clutches hold it; otherwise the model's output_mass");
    app.add_option("--option", options->options, "GEAR=OPTION to be in use: range=L")->delimiter(',');
    app.add_flag("--ideal", options->ideal, "leave the losses out");
    app.add_flag("--json", options->json, "print one JSON object");
    return [options] { return run(*options); };
}

const Command statics("statics", "internal torque on every link of every device, at rest or in steady motion",
                      declare_statics);

}  // namespace
}  // namespace shiftrig::cli
