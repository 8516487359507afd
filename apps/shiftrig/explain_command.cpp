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

void require_device(const Options& options) {
    const io::RecordingReader reader(options.recording);
    const auto& devices = reader.manifest().devices;
    if (std::find(devices.begin(), devices.end(), options.device) != devices.end()) return;
    std::string known;
    for (const auto& device : devices) known += (known.empty() ? "" : ", ") + device;
    throw io::InputError(options.recording + ": has no device \"" + options.device + "\"; it has " + known);
}

int run(const Options& options) {
    if (!options.device.empty()) require_device(options);
    // One signal is enough to load the changes.
    const analysis::Run recorded = analysis::load_run(options.recording, {"rig.safe_command"});
    nlohmann::json list = nlohmann::json::array();
    for (const auto& change : recorded.changes) {
        if (!options.device.empty() && change.device != options.device) continue;
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
    app.add_option("--device", options->device, "only this device");
    app.add_flag("--json", options->json, "print one JSON array");
    return [options] { return run(*options); };
}

const Command explain("explain", "every change of state of a recorded run, in words", declare);

}  // namespace

}  // namespace shiftrig::cli
