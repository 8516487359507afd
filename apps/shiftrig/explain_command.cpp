// shiftrig explain: every change of state of a recorded run, in words.
#include <algorithm>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "analysis/change_json.h"
#include "analysis/load_run.h"
#include "apps/shiftrig/command.h"
#include "io/nearest.h"
#include "io/recording/reader.h"

namespace shiftrig::cli {

namespace {

struct Options {
    std::string recording, device;
    bool json = false;
};

// Its place among the recording's devices.
int place_of(const Options& options) {
    const io::RecordingReader reader(options.recording);
    const auto& devices = reader.manifest().devices;
    const auto place = std::find(devices.begin(), devices.end(), options.device);
    if (place != devices.end()) return static_cast<int>(place - devices.begin());
    std::string known;
    for (const auto& device : devices) known += (known.empty() ? "" : ", ") + device;
    throw io::InputError(options.recording + ": has no device \"" + options.device + "\"; it has " + known);
}

// Is it of this device, alone or with others? What is untold may be.
bool concerns(const analysis::Change& change, const std::string& device, int place) {
    if (change.device == device) return true;
    if (change.device.empty()) return change.of_machine();
    const bool among_others =
        change.event.members >> plant::most_members && place >= change.event.device + plant::most_members;
    return among_others ||
           std::find(change.members.begin(), change.members.end(), device) != change.members.end();
}

int run(const Options& options) {
    const int place = options.device.empty() ? -1 : place_of(options);
    // One signal is enough to load the changes.
    const analysis::Run recorded = analysis::load_run(options.recording, {"rig.safe_command"});
    nlohmann::json list = nlohmann::json::array();
    for (const auto& change : recorded.changes) {
        if (!options.device.empty() && !concerns(change, options.device, place)) continue;
        if (!options.json) {
            std::cout << change.text << '\n';
            continue;
        }
        list.push_back(analysis::to_json(change));
    }
    if (options.json) std::cout << list.dump(2) << '\n';
    if (!recorded.unfinished.empty()) tell(recorded.unfinished);
    const std::string incomplete = recorded.incomplete();
    if (incomplete.empty()) return good;
    tell(incomplete);
    return bad_input;
}

Command::Run declare(CLI::App& app) {
    auto options = std::make_shared<Options>();
    app.add_option("RECORDING", options->recording, "what `shiftrig run --record` wrote")->required();
    app.add_option(
        "--device", options->device,
        "only what concerns this device: also loops that it is in, and what a step could not tell");
    app.add_flag("--json", options->json, "print one JSON array");
    return [options] { return run(*options); };
}

const Command explain("explain", "every change of state of a recorded run, in words", declare);

}  // namespace

}  // namespace shiftrig::cli
