// shiftrig check: what a machine is, and what is wrong with it.
#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/shiftrig/command.h"
#include "apps/shiftrig/examination.h"
#include "io/model_file.h"
#include "io/scenario_file.h"

namespace shiftrig::cli {
namespace {

struct Options {
    std::string model, schema;
    bool json = false, shapes = false;
};

int run(const Options& options) {
    if (!options.schema.empty()) {
        std::cout << (options.schema == "model" ? io::model_schema() : io::scenario_schema()).dump(2) << '\n';
        return good;
    }
    if (options.model.empty()) throw CLI::RequiredError("MODEL");
    const Examination examination = examine(io::read_model(options.model));
    if (options.json)
        std::cout << as_json(examination).dump(2) << '\n';
    else
        print(std::cout, examination, options.shapes);
    return good;
}

Command::Run declare_check(CLI::App& app) {
    auto options = std::make_shared<Options>();
    app.add_option("MODEL", options->model, "model file (YAML)");
    app.add_flag("--json", options->json, "print one JSON object");
    app.add_flag("--shapes", options->shapes, "print the mode shapes of every gear");
    app.add_option("--schema", options->schema, "print the JSON Schema of model or scenario files")
        ->check(CLI::IsMember({"model", "scenario"}));
    return [options] { return run(*options); };
}

const Command check("check", "masses, distribution matrix, gear table, natural frequencies, tie-ups",
                    declare_check);

}  // namespace
}  // namespace shiftrig::cli
