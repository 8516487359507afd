// A plant event as JSON: what `explain --json`, `run --json` and exports write.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "plant/plant.h"

namespace shiftrig::io {

// time_s, kind, device, torque_nm, capacity_nm, slip_rad_s; margin_nm where a torque is compared with a capacity; and what else the
// kind has: x, flank, speed_rad_s, temperature_degc, members, passes_through, count.
nlohmann::json event_json(const plant::Event& event, const std::string& device,
                          const std::vector<std::string>& members = {});

// Names of the pairs that share a load, of a tie-up; `devices` in the order of the model.
std::vector<std::string> loop_members(const plant::Event& event, const std::vector<std::string>& devices);

}  // namespace shiftrig::io
