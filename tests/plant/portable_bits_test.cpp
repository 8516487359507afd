// The portable kernel gives the same bits on every processor: random forests, both engines, as hashes of the speeds after half a
// second, in tests/data/portable_bits.txt. Made anew with SHIFTRIG_UPDATE_GOLDEN=1.
#include <bit>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iomanip>
#include <sstream>

#include "rig.h"
#include "tests/plant/random_forests.h"

namespace shiftrig::plant {
namespace {

std::uint64_t hash_of(std::span<const double> values) {  // FNV-1a, by words
    std::uint64_t hash = 14695981039346656037u;
    for (const double value : values) hash = (hash ^ std::bit_cast<std::uint64_t>(value)) * 1099511628211u;
    return hash;
}

std::string hashes() {
    std::ostringstream lines;
    for (std::uint64_t seed = 1; seed <= 40; ++seed) {
        for (const Method method : {Method::etd3, Method::ark3}) {
            Description d = Forest(seed + 1000).build(seed % 2 == 1);
            d.method = method;
            Rig rig(d, {1e-3, KernelKind::portable});
            for (int step = 0; step < 500; ++step) rig.step();
            lines << seed << ' ' << rig.model.engine() << ' ' << std::hex << std::setw(16)
                  << std::setfill('0') << hash_of(rig.state.speeds()) << std::dec << '\n';
        }
    }
    return lines.str();
}

TEST(PortableKernel, GivesTheSameBitsOnEveryProcessor) {
    const std::string path = SHIFTRIG_TEST_DATA "/portable_bits.txt", found = hashes();
    if (std::getenv("SHIFTRIG_UPDATE_GOLDEN")) std::ofstream(path) << found;
    std::ostringstream expected;
    expected << std::ifstream(path).rdbuf();
    EXPECT_EQ(found, expected.str());
}

}  // namespace
}  // namespace shiftrig::plant
