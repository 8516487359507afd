// shiftrig statics: internal torque on every link of every device at zero acceleration.
#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/shiftrig/arguments.h"
#include "apps/shiftrig/command.h"
#include "apps/shiftrig/text_table.h"
#include "io/model_file.h"
#include "plant/statics.h"

namespace shiftrig::cli {
namespace {

struct Options {
    std::string model;
    std::vector<std::string> closed, inputs, speeds, options;
    std::string output;
    bool ideal = false, json = false;
};

nlohmann::ordered_json as_json(const plant::StaticsResult& result) {
    nlohmann::ordered_json links = nlohmann::ordered_json::object(), meshes = links, nodes = links;
    for (const auto& link : result.links) links[link.name] = link.torque;
    for (const auto& mesh : result.meshes)
        meshes[mesh.name] = {{"x", mesh.x}, {"power_w", mesh.power}, {"loss_w", mesh.loss}};
    for (const auto& node : result.nodes)
        nodes[node.name] = {{"speed", node.speed}, {"external", node.external}, {"residual", node.residual}};
    return {{"links", links},
            {"meshes", meshes},
            {"nodes", nodes},
            {"output_torque", result.output_torque},
            {"ratio", result.ratio},
            {"efficiency", result.efficiency},
            {"power_in_w", result.power_in},
            {"loss_w", result.loss},
            {"worst_residual", result.worst_residual},
            {"split_not_unique", result.split_not_unique},
            {"tie_up", result.tie_up},
            {"directions_settled", result.directions_settled}};
}

void print(const plant::StaticsResult& result, const Options& options) {
    TextTable links;
    links.row({"link", "node", "torque Nm", "speed rad/s"});
    for (const auto& link : result.links)
        links.row({link.name, link.node, decimals(link.torque, 4), decimals(link.speed, 4)});
    links.print(std::cout, "");
    if (!result.meshes.empty()) {
        std::cout << '\n';
        TextTable meshes;
        meshes.row({"mesh", "x", "power W", "loss W"});
        for (const auto& mesh : result.meshes)
            meshes.row({mesh.name, std::to_string(mesh.x), decimals(mesh.power, 4), decimals(mesh.loss, 4)});
        meshes.print(std::cout, "");
    }
    std::cout << "\noutput torque " << decimals(result.output_torque, 4) << " Nm, ratio "
              << decimals(result.ratio, 4) << ", efficiency " << decimals(result.efficiency, 4)
              << (options.ideal ? " (losses left out)" : "") << '\n';
    if (result.split_not_unique) {
        std::cout << "tie-up: the split between";
        for (const auto& device : result.tie_up) std::cout << ' ' << device;
        std::cout << " is not unique; shared by capacity\n";
    }
    if (!result.directions_settled)
        std::cout << "no consistent directions of power were found (an η below 0.5?)\n";
}

int run(const Options& options) {
    io::ModelFile file = io::read_model(options.model);
    for (const auto& text : options.options) {
        const auto [gear, option] = named_word("--option", text);
        io::select_option(file.description, gear, option);
    }
    plant::StaticsProblem problem;
    problem.closed = options.closed;
    for (const auto& text : options.inputs) problem.inputs.push_back(named_number("--input", text));
    for (const auto& text : options.speeds) problem.speeds.push_back(named_number("--speed", text));
    problem.output = options.output;
    problem.ideal = options.ideal;

    const auto result = plant::solve_statics(file.description, problem);
    if (options.json)
        std::cout << as_json(result).dump(2) << '\n';
    else
        print(result, options);
    return good;
}

Command::Run declare_statics(CLI::App& app) {
    auto options = std::make_shared<Options>();
    app.add_option("MODEL", options->model, "model file (YAML)")->required();
    app.add_option("--closed", options->closed, "clutches and brakes that are closed: C1,C3")->delimiter(',');
    app.add_option("--input", options->inputs, "NODE=TORQUE on a mass, in Nm")->delimiter(',')->required();
    app.add_option("--speed", options->speeds, "NODE=VALUE in rad/s; otherwise the first input turns at +1")
        ->delimiter(',');
    app.add_option("--output", options->output, "the mass that absorbs; otherwise the model's output_mass");
    app.add_option("--option", options->options, "GEAR=OPTION to be in use: range=L")->delimiter(',');
    app.add_flag("--ideal", options->ideal, "leave the losses out");
    app.add_flag("--json", options->json, "print one JSON object");
    return [options] { return run(*options); };
}

const Command statics("statics", "internal torque on every link of every device, at rest or in steady motion",
                      declare_statics);

}  // namespace
}  // namespace shiftrig::cli
