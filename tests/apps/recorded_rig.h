// The rig with its built-in controller in free pace, recorded or remembered, as fast as it goes.
#pragma once

#include <string>
#include <vector>

#include "apps/rig/choices.h"
#include "apps/rig/session.h"
#include "apps/rig/snapshot.h"

namespace shiftrig::rig {

inline Setup setup_for(const std::string& scenario, const std::string& kernel = "portable") {
    Choices choices;
    choices.scenario = SHIFTRIG_SOURCE_DIR "/config/scenarios/" + scenario + ".yaml";
    choices.kernel = kernel;
    return make_setup(choices);
}

// All values of one tick.
inline std::vector<double> values_of(const Rig& rig) {
    std::vector<double> all;
    for (const auto part : {rig.input_values(), rig.output_values(), rig.rig_values()})
        all.insert(all.end(), part.begin(), part.end());
    return all;
}

}  // namespace shiftrig::rig
