#include "plant/plant.h"

namespace shiftrig::plant {

ModelError::ModelError(std::string device_kind, std::string device_name, std::string field_name,
                       std::string rule_text)
    : std::runtime_error(device_kind + " \"" + device_name +
                         "\":" + (field_name.empty() ? "" : " " + field_name) + " " + rule_text),
      kind(std::move(device_kind)),
      device(std::move(device_name)),
      field(std::move(field_name)),
      rule(std::move(rule_text)) {}

}  // namespace shiftrig::plant
