#include "io/recording/output_file.h"

#include <sys/stat.h>
#include <unistd.h>

namespace shiftrig::io {

std::FILE* open_output(const std::string& path) {
    struct stat named = {}, standard = {};
    const bool is_standard_output = stat(path.c_str(), &named) == 0 && fstat(STDOUT_FILENO, &standard) == 0 &&
                                    !S_ISCHR(named.st_mode) && named.st_dev == standard.st_dev &&
                                    named.st_ino == standard.st_ino;
    return path == "-" || is_standard_output ? stdout : std::fopen(path.c_str(), "wbe");
}

}  // namespace shiftrig::io
