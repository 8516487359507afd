// A YAML file as the readers of models and scenarios want it: places counted from 1, merge keys (`<<`)
// resolved, duplicate keys refused.
#pragma once

#include <yaml-cpp/yaml.h>

#include <string>
#include <vector>

#include "io/input_error.h"
#include "io/text_file.h"

namespace shiftrig::io {

struct Entry {
    std::string key;
    YAML::Mark mark;  // of the key
    YAML::Node value;
};

// The document's root; throws InputError naming the place of a syntax error or an empty document.
YAML::Node parse_yaml(const std::string& text, const std::string& path);

[[noreturn]] void fail(const std::string& path, const YAML::Mark& mark, const std::string& what);

// A map's entries in file order, those merged by `<<` after its own (an own key wins over a merged
// one). Throws InputError for a duplicate key or if `map` is no map; `owner` begins the message.
std::vector<Entry> entries(const std::string& path, const YAML::Node& map, const YAML::Mark& at,
                           const std::string& owner);

// A scalar as written; a list or map in short: what an error message shows after "key = ".
std::string as_written(const YAML::Node& node);

}  // namespace shiftrig::io
