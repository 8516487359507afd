// What the page must know of the machine before the first sample: signals, gauges, plots, controls, faults.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "apps/rig/rig.h"

namespace shiftrig::serve {

// The JSON of GET /api/model: what it holds is read by web/src/dashboard.js.
nlohmann::json machine_page(const rig::Rig& rig);

// A fault the page can switch: the input that carries it and its value while it is on.
struct Fault {
    std::string name, label;
    int signal = -1;
    double active = 1, healthy = 0;
};
std::vector<Fault> faults_of(const rig::Rig& rig);

// A number of the model file that may be changed while the rig runs, in the file's unit.
struct Parameter {
    std::string name;  // "clutches.F2.wet_plates.mu_sliding"
    std::string device, label, unit;
    double value = 0;
};
std::vector<Parameter> parameters_of(const plant::Description& machine);

}  // namespace shiftrig::serve
