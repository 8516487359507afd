// usage: make_recording FILE TICKS: a recording of made-up signals, for tests of programs that read one.
#include <cstdio>
#include <cstdlib>

#include "synthetic_recording.h"

int main(int argc, char** argv) {
    if (argc != 3) {
        std::fprintf(stderr, "usage: make_recording FILE TICKS\n");
        return 2;
    }
    const auto summary = shiftrig::io::synthetic::write(argv[1], std::atoi(argv[2]));
    std::printf("%lld ticks, %lld bytes\n", static_cast<long long>(summary.ticks),
                static_cast<long long>(summary.bytes));
    return summary.error.empty() && summary.lost == 0 ? 0 : 1;
}
