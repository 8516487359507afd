// Holds a run against what its scenario expects. Every broken expectation is one line that says where it is
// written, when it was broken, by which signal, what was expected and what was found:
//
//     config/scenarios/plough_upshift.yaml:22:7: F2->F3 at 2.000 s: clutch_energy_j.F3 = 6123.4; expected at most 5000
#pragma once

#include <string>
#include <vector>

#include "analysis/run.h"
#include "analysis/scorecard.h"
#include "io/scenario_file.h"

namespace shiftrig::analysis {

// Empty: everything held. Signals are compared in the unit the scenario writes them in. A signal or metric that the
// run does not have breaks the expectation that names it; devices are held against the model before the run
// (io::check_devices).
std::vector<std::string> broken_expectations(const io::ScenarioFile& scenario, const Run& run,
                                             const Scorecard& card);

// How many single statements the scenario makes.
int count_expectations(const io::Expectations& expectations);

}  // namespace shiftrig::analysis
