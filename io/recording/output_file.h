// Where a table or a log for others goes.
#pragma once

#include <cstdio>
#include <string>

namespace shiftrig::io {

// A new file, or `stdout`: for "-", and for whatever else names what standard output goes to (/dev/stdout). Opened a second
// time a file would be written from its beginning by each of the two. nullptr: errno says why.
std::FILE* open_output(const std::string& path);

}  // namespace shiftrig::io
