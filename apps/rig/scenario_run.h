// A scenario from beginning to end in memory, as fast as it goes: for scenario tests and for branches of a run.
#pragma once

#include "analysis/run.h"
#include "analysis/scorecard.h"
#include "apps/rig/choices.h"
#include "io/scenario_file.h"
#include "rt/loop.h"

namespace shiftrig::rig {

struct ScenarioRun {
    analysis::Run run;
    analysis::Scorecard scorecard;
    rt::LoopReport report;
};

// `choices.scenario` is not looked at; buses and controller are as in `shiftrig run`. Throws what make_setup throws.
ScenarioRun run_scenario(const io::ScenarioFile& scenario, const Choices& choices = {});

}  // namespace shiftrig::rig
