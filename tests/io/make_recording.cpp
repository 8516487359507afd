// usage: make_recording FILE TICKS|small: a recording of made-up signals, for tests of programs that read one.
#include <cstdio>
#include <cstdlib>

#include "synthetic_recording.h"

int main(int argc, char** argv) {
    if (argc != 3) {
        std::fprintf(stderr, "usage: make_recording FILE TICKS|small\n");
        return 2;
    }
    namespace synthetic = shiftrig::io::synthetic;
    const bool small = std::string(argv[2]) == "small";
    const auto summary =
        small ? synthetic::write_small(argv[1]) : synthetic::write(argv[1], std::atoi(argv[2]));
    std::printf("%lld ticks, %lld bytes\n", static_cast<long long>(summary.ticks),
                static_cast<long long>(summary.bytes));
    return summary.error.empty() && summary.lost == 0 ? 0 : 1;
}
