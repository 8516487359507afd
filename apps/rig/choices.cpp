#include "apps/rig/choices.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <stdexcept>

#include "io/yaml_document.h"

namespace shiftrig::rig {

namespace {

// The stanza `controller:` of a scenario: `none`, or a map {calibration: FILE, silent: [{from_s, until_s}]}.
struct ScenarioController {
    bool none = false;
    std::string calibration;  // empty: not given
    std::vector<Silence> silences;
};

std::int64_t nanoseconds(const std::string& path, const io::Entry& entry) {
    double seconds = 0;
    if (!YAML::convert<double>::decode(entry.value, seconds) || !(seconds >= 0 && seconds < 1e9))
        io::fail(path, entry.mark,
                 "controller: " + entry.key + " = " + io::as_written(entry.value) + "; must be a time in s");
    return std::llround(seconds * 1e9);
}

ScenarioController read_controller(const io::ScenarioFile& scenario) {
    ScenarioController result;
    const YAML::Node& node = scenario.controller;
    if (!node.IsDefined() || node.IsNull()) return result;
    if (node.IsScalar() && node.Scalar() == "none") {
        result.none = true;
        return result;
    }
    for (const auto& entry : io::entries(scenario.path, node, node.Mark(), "controller ")) {
        if (entry.key == "calibration" && entry.value.IsScalar()) {
            result.calibration =
                (std::filesystem::path(scenario.path).parent_path() / entry.value.Scalar()).string();
        } else if (entry.key == "silent" && entry.value.IsSequence()) {
            for (const auto& item : entry.value) {
                Silence silence;
                for (const auto& time :
                     io::entries(scenario.path, item, item.Mark(), "controller: silent ")) {
                    if (time.key == "from_s")
                        silence.from_ns = nanoseconds(scenario.path, time);
                    else if (time.key == "until_s")
                        silence.until_ns = nanoseconds(scenario.path, time);
                    else
                        io::fail(
                            scenario.path, time.mark,
                            "controller: silent." + time.key + " is not a known key; known: from_s, until_s");
                }
                result.silences.push_back(silence);
            }
        } else {
            io::fail(scenario.path, entry.mark,
                     "controller: " + entry.key +
                         " is not a known key, or not of its kind; known: calibration: FILE, silent: "
                         "[{from_s, until_s}]; or `controller: none`");
        }
    }
    return result;
}

bool is_built_in(const std::string& controller) {
    return controller == "builtin" || controller.starts_with("builtin:");
}

plant::KernelKind kernel_named(const std::string& name) {
    static const std::map<std::string, plant::KernelKind> kinds = {{"auto", plant::KernelKind::automatic},
                                                                   {"portable", plant::KernelKind::portable},
                                                                   {"avx2", plant::KernelKind::avx2},
                                                                   {"avx512", plant::KernelKind::avx512}};
    const auto found = kinds.find(name);
    if (found == kinds.end())
        throw std::invalid_argument("--kernel " + name + ": it is auto, portable, avx2 or avx512");
    return found->second;
}

void choose_controller(const Choices& choices, Setup& setup) {
    auto& buses = setup.buses;
    const ScenarioController scripted =
        setup.scenario ? read_controller(*setup.scenario) : ScenarioController{};
    std::string controller = choices.controller;
    const auto inprocess_given = [&] {
        return std::count(buses.names.begin(), buses.names.end(), "inprocess") > 0;
    };

    if (!choices.can_replay.empty() && !controller.empty() && controller != "none")
        throw std::invalid_argument("--can-replay and --controller " + controller +
                                    " exclude each other: the log takes the controller's place");
    if (controller.empty()) {
        const bool nobody = scripted.none || !choices.can_replay.empty() || !setup.model.can.IsDefined() ||
                            (!buses.names.empty() && !inprocess_given());
        controller = nobody ? "none" : "builtin";
    }
    const bool logs = !choices.can_log.empty() || !choices.can_replay.empty();
    const bool needs_a_bus = is_built_in(controller) || (logs && buses.names.empty());
    if (needs_a_bus && !inprocess_given()) buses.names.push_back("inprocess");
    if (!is_built_in(controller)) return;
    const std::string given = controller.size() > 8 ? controller.substr(8) : scripted.calibration;
    const std::string path = given.empty() ? shipped_calibration() : given;
    build_in(buses, io::read_text(path), path);
}

// What is wrong within the model is told with the model's place, that there is none with the scenario's.
io::ModelFile model_of(const io::ScenarioFile& scenario) {
    std::string text;
    try {
        text = io::read_text(scenario.model_path);
    } catch (const io::InputError& error) {
        throw io::InputError(scenario.path, scenario.model_place.line, scenario.model_place.column,
                             std::string("model: ") + error.what());
    }
    return io::parse_model(text, scenario.model_path);
}

Setup complete(const Choices& choices, Setup setup) {
    setup.tick_ns = std::llround(1e9 / choices.rate_hz);
    setup.substeps = choices.substeps;
    setup.kernel = kernel_named(choices.kernel);
    setup.buses.names = choices.buses;
    setup.buses.lockstep = choices.lockstep;
    setup.buses.can_log = choices.can_log;
    setup.buses.can_replay = choices.can_replay;
    if (setup.scenario) follow_scenario(*setup.scenario, setup.buses);
    choose_controller(choices, setup);
    return setup;
}

}  // namespace

void follow_scenario(const io::ScenarioFile& scenario, BusSetup& buses) {
    buses.silences = read_controller(scenario).silences;
    if (!scenario.bus_faults.IsDefined()) return;
    buses.faults = scenario.bus_faults;
    buses.faults_file = scenario.path;
}

void build_in(BusSetup& buses, const std::string& calibration_text, const std::string& calibration_path) {
    buses.calibration_path = calibration_path;
    buses.calibration_text = calibration_text;
    buses.built_in =
        tcu::parse_calibration(io::parse_yaml(calibration_text, calibration_path), calibration_path);
}

std::string shipped_calibration() {
    return SHIFTRIG_CONFIG "/calibration/tractor.yaml";
}

Setup make_setup(const Choices& choices) {
    Setup setup;
    if (!choices.scenario.empty()) return make_setup(choices, io::read_scenario(choices.scenario));
    if (choices.model.empty()) throw std::invalid_argument("a model or a scenario is needed");
    setup.model = io::read_model(choices.model);
    return complete(choices, std::move(setup));
}

Setup make_setup(const Choices& choices, io::ScenarioFile scenario) {
    Setup setup;
    setup.model = choices.model.empty() ? model_of(scenario) : io::read_model(choices.model);
    setup.scenario = std::move(scenario);
    return complete(choices, std::move(setup));
}

std::string controller_command(const Choices& choices) {
    const auto& c = choices.controller;
    return c.empty() || c == "none" || is_built_in(c) ? "" : c;
}

}  // namespace shiftrig::rig
