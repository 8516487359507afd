// What the frames of a bus mean to the rig: a DBC file (layout) and a mapping in YAML (meaning), e.g.
// config/can/tractor.yaml, whose comments describe the format.
#pragma once

#include <yaml-cpp/yaml.h>

#include <string>

namespace shiftrig::io::can {

struct Mapping;

// The file of a mapping. Throws InputError.
Mapping read_mapping(const std::string& path);
// The stanza `can:` of a model file, which is either a mapping or the path of one (relative to the model
// file).
Mapping parse_mapping(const YAML::Node& node, const std::string& path);

}  // namespace shiftrig::io::can
