// Results of scenario tests as JUnit XML, as continuous-integration systems read it.
#pragma once

#include <string>
#include <vector>

namespace shiftrig::analysis {

struct TestResult {
    std::string name;                   // "plough_upshift"
    std::string file;                   // "config/scenarios/plough_upshift.yaml"
    std::vector<std::string> failures;  // one line each
    std::string error;                  // it could not be run at all
    double sim_time_s = 0, wall_time_s = 0;
    int expectations = 0;
    bool passed() const { return failures.empty() && error.empty(); }
};

std::string junit_xml(const std::vector<TestResult>& results);

}  // namespace shiftrig::analysis
