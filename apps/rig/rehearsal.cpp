#include "apps/rig/rehearsal.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "apps/rig/choices.h"
#include "io/input_error.h"

namespace shiftrig::rig {

namespace {

// The rig without anything that others could notice: no wire leaves the process, no file is written.
Setup in_private(const Setup& original) {
    Setup setup = original;
    setup.resumes = false;
    setup.buses.can_log.clear();
    setup.buses.lockstep = false;
    const bool has_frames = setup.model.can.IsDefined();
    const bool speaks = !setup.buses.names.empty();
    setup.buses.names.clear();
    if (has_frames && speaks) setup.buses.names.push_back("inprocess");
    if (setup.buses.names.empty()) {
        setup.buses.built_in.reset();
        setup.buses.can_replay.clear();
    }
    return setup;
}

// Somebody elsewhere is to command this rig: the shipped controller stands in, if the machine is one that it knows.
std::unique_ptr<Rig> with_a_stand_in(const Setup& setup) {
    try {
        Setup with = setup;
        with.buses.built_in = tcu::read_calibration(shipped_calibration());
        return std::make_unique<Rig>(std::move(with));
    } catch (const io::InputError&) {
        return std::make_unique<Rig>(setup);
    }
}

}  // namespace

std::int64_t rehearse(Rig& rig, std::int64_t most_ticks) {
    if (!rig.setup().scenario) return 0;
    const Setup setup = in_private(rig.setup());
    const BusSetup& buses = setup.buses;
    const bool awaits_somebody = !buses.names.empty() && !buses.built_in && buses.can_replay.empty();
    const auto twin = awaits_somebody ? with_a_stand_in(setup) : std::make_unique<Rig>(setup);
    const double scenario_ticks = setup.scenario->duration * 1e9 / static_cast<double>(setup.tick_ns);
    const std::int64_t ticks = std::min<std::int64_t>(most_ticks, std::llround(scenario_ticks));
    for (std::int64_t i = 0; i < ticks; ++i) twin->tick();
    rig.take_modes_of(*twin);
    return ticks;
}

}  // namespace shiftrig::rig
