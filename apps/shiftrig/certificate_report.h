// The certificate of a run as people and programs read it.
#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>

#include "apps/rig/certificate.h"

namespace shiftrig::cli {

// {"torque_residual", "constraint_violation_rad_s", "energy_defect_j", "changes_located", "fall_backs", "mode_lookups", "modes_built",
// "ticks": {"tie_up", "direction_search_gave_up", "not_finite", "coarse", "instant_not_found"}}; null for what is not finite, and
// for `coarse` where the machine's steps are taken whole, whatever happens in them.
nlohmann::json to_json(const rig::RunCertificate& certificate, const plant::Description& machine);

// One line, and one for each flag that was set in some tick. `told`: events of the machine, as `explain` lists them; what is
// located are the changes that made a step end early, fewer or more. `dissipated`: in this run [J].
std::string describe(const rig::RunCertificate& certificate, std::ptrdiff_t told, double dissipated);

}  // namespace shiftrig::cli
