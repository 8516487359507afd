#include "apps/shiftrig/resumed_rig.h"

#include <fmt/format.h>

#include <stdexcept>
#include <utility>

#include "apps/rig/snapshot.h"
#include "io/recording/snapshot.h"

namespace shiftrig::cli {

void refuse_what_a_snapshot_settles(const CLI::App& app, const rig::Choices& choices) {
    constexpr const char* settled =
        ": --from brings its own model, scenario, ticks, kernel, buses and controller";
    for (const char* name :
         {"MODEL", "--scenario", "--rate-hz", "--substeps", "--kernel", "--bus", "--can-replay"})
        if (app.get_option(name)->count() > 0) throw std::invalid_argument(std::string(name) + settled);
    const bool none_to_start = rig::controller_command(choices).empty();
    if (app.get_option("--controller")->count() > 0 && none_to_start)
        throw std::invalid_argument("--controller " + choices.controller + settled);
}

std::unique_ptr<rig::Rig> resumed_rig(const std::string& from, const RigOptions& options) {
    const io::Manifest snapshot = io::read_snapshot(from);
    rig::Setup setup = rig::setup_of(snapshot);
    options.check_files(setup);
    setup.buses.lockstep = options.pacing() == rt::Pace::lockstep;
    setup.buses.can_log = options.choices.can_log;
    if (setup.buses.built_in && !options.choices.controller.empty())
        throw std::invalid_argument("--controller: the controller of " + from + " is the built-in one");
    const std::int64_t end = options.loop(setup).slots;
    if (end <= snapshot.first_tick)
        throw std::invalid_argument(
            fmt::format("--from {}: the snapshot is of {:.7g} s, and the run ends at {:.7g} s (--duration)",
                        from, 1e-9 * static_cast<double>(snapshot.first_tick * setup.tick_ns),
                        1e-9 * static_cast<double>(end * setup.tick_ns)));
    auto rig = std::make_unique<rig::Rig>(std::move(setup));
    rig::resume(*rig, snapshot);
    return rig;
}

}  // namespace shiftrig::cli
