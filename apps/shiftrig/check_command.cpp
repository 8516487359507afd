// shiftrig check: what a machine is, and what is wrong with it.
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "analysis/driveline_dot.h"
#include "analysis/driveline_svg.h"
#include "apps/shiftrig/arguments.h"
#include "apps/shiftrig/command.h"
#include "apps/shiftrig/examination.h"
#include "apps/shiftrig/files.h"
#include "apps/shiftrig/rig_options.h"
#include "io/model_file.h"
#include "io/scenario_file.h"

namespace shiftrig::cli {
namespace {

struct Options {
    std::string model, schema, dot, svg;
    Files files;
    bool json = false, shapes = false;
    double rate_hz = 1000;
};

void write(const std::string& path, const std::string& text) {
    std::ofstream file(path);
    if (!(file << text << std::flush)) throw io::InputError(path, 0, 0, "cannot be written");
}

int run(const Options& options) {
    if (!options.schema.empty()) {
        std::cout << (options.schema == "model" ? io::model_schema() : io::scenario_schema()).dump(2) << '\n';
        return good;
    }
    if (options.model.empty()) throw CLI::RequiredError("MODEL");
    const io::ModelFile file = io::read_model(options.model);
    if (!options.dot.empty() || !options.svg.empty()) options.files.check(files_of(file));
    const Examination examination = examine(file, 1 / options.rate_hz);
    if (!options.dot.empty()) write(options.dot, analysis::driveline_dot(file.description));
    if (!options.svg.empty()) write(options.svg, analysis::driveline_svg(file.description, true));
    if (options.json)
        std::cout << as_json(examination).dump(2) << '\n';
    else
        print(std::cout, examination, options.shapes);
    return good;
}

Command::Run declare_check(CLI::App& app) {
    auto options = std::make_shared<Options>();
    Files& files = options->files;
    files.read(app.add_option(
        "MODEL", options->model,
        "model file (YAML); warned of are efficiencies below 0.5, rigid parts and initial speeds that "
        "contradict one another, what a step cannot resolve, gears that block their output or share torque "
        "in no unique way, and modes that an engine's main order meets"));
    app.add_flag("--json", options->json, "print one JSON object");
    app.add_flag("--shapes", options->shapes, "print the mode shapes of every gear and state");
    add_number(app, "--rate-hz", options->rate_hz, {1, 1e5},
               "of the run to be: warn of what its steps cannot resolve")
        ->capture_default_str();
    files.written(
        app.add_option("--dot", options->dot, "write the driveline as Graphviz text into this file"));
    files.written(
        app.add_option("--svg", options->svg, "draw the driveline and its gear table into this file"));
    app.add_option("--schema", options->schema, "print the JSON Schema of model or scenario files")
        ->check(CLI::IsMember({"model", "scenario"}));
    return [options] {
        options->files.check();
        return run(*options);
    };
}

const Command check("check",
                    "masses, distribution matrix, gear table, natural frequencies, tie-ups, warnings",
                    declare_check);

}  // namespace
}  // namespace shiftrig::cli
