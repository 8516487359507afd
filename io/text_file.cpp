#include "io/text_file.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>

#include "io/input_error.h"

namespace shiftrig::io {

std::string read_text(const std::string& path) {
    errno = 0;
    std::ifstream file(path, std::ios::binary);
    std::ostringstream text;
    if (file && file.peek() != std::ifstream::traits_type::eof()) text << file.rdbuf();
    if (!file && errno != 0)
        throw InputError(path, 0, 0, std::string("cannot be read: ") + std::strerror(errno));
    return text.str();
}

}  // namespace shiftrig::io
