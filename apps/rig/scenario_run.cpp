#include "apps/rig/scenario_run.h"

#include <cmath>

#include "apps/rig/session.h"

namespace shiftrig::rig {

ScenarioRun run_scenario(const io::ScenarioFile& scenario, const Choices& choices) {
    Rig rig(make_setup(choices, scenario));
    SessionOptions options;
    options.loop.period = rig.setup().tick_ns;
    options.loop.pace = choices.lockstep ? rt::Pace::lockstep : rt::Pace::free;
    options.loop.slots = std::llround(scenario.duration * 1e9 / static_cast<double>(options.loop.period));
    CollectorOptions room;
    room.most_bytes = std::size_t{4} << 30;  // all signals of a quarter of an hour
    Collector collector(rig, options.loop.slots, room);
    options.collector = &collector;
    Session session(rig, std::move(options));

    ScenarioRun result;
    result.report = session.run();
    result.run = collector.finish(rig);
    result.scorecard = analysis::score(result.run);
    return result;
}

}  // namespace shiftrig::rig
