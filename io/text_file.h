// A file's text, for every reader of something that a user wrote.
#pragma once

#include <string>

namespace shiftrig::io {

// The whole file's text; throws InputError if it cannot be read, and says why: "m.yaml: cannot be read: Is a directory".
std::string read_text(const std::string& path);

}  // namespace shiftrig::io
