// The same targets for libFuzzer; the first byte chooses. Built with clang and -DSHIFTRIG_FUZZ=ON:
//     build/fuzz/can_fuzzer -max_total_time=600
#include <cstddef>
#include <cstdint>

#include "tests/io/can_fuzz_targets.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace shiftrig::io::can;
    if (size == 0) return 0;
    const Bytes rest{data + 1, size - 1};
    switch (data[0] % 4) {
        case 0:
            fuzz_dbc(rest);
            break;
        case 1:
            fuzz_candump(rest);
            break;
        case 2:
            fuzz_datagram(rest);
            break;
        default: {
            static FuzzedRig rig;
            rig.hear(rest);
            if (rig.wrong()) __builtin_trap();
        }
    }
    return 0;
}
