// One of the targets (SHIFTRIG_FUZZ_TARGET) for libFuzzer; built with clang and -DSHIFTRIG_FUZZ=ON, see scripts/fuzz.
#include <cstddef>
#include <cstdint>

#include "tests/io/can_fuzz_targets.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    shiftrig::io::can::SHIFTRIG_FUZZ_TARGET(shiftrig::io::can::Bytes(data, size));
    return 0;
}
