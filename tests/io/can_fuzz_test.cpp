// Random and mutated input, the same in every run: 1 000 000 frames, 100 000 DBC files, logs, datagrams. Worth most
// in the address-sanitizer build; can_fuzzer.cpp hands the same targets to libFuzzer.
#include <gtest/gtest.h>

#include <fstream>
#include <random>
#include <sstream>

#include "io/can/codec.h"
#include "tests/io/can_fuzz_targets.h"
#include "tests/io/count_allocations.h"

namespace shiftrig::io::can {
namespace {

class Mutator {
  public:
    explicit Mutator(std::uint32_t seed) : random(seed) {}
    // A few of: a byte changed, a piece cut out, doubled, moved, or another word put in.
    std::string mutate(std::string text) {
        static const char* const kWords[] = {"BO_ ",
                                             "SG_ ",
                                             "\"",
                                             ";",
                                             "m0M",
                                             "4294967295",
                                             "-1",
                                             "1e999",
                                             "@0-",
                                             "|",
                                             "\n",
                                             "BA_ ",
                                             "SG_MUL_VAL_ ",
                                             "nan",
                                             "18446744073709551616",
                                             "0",
                                             "##1",
                                             "(",
                                             "\xFF"};
        for (std::uint32_t changes = 1 + below(4); changes > 0; --changes) {
            if (text.empty()) text = "x";
            const std::size_t at = below(text.size()),
                              length = std::min<std::size_t>(below(40), text.size() - at);
            switch (below(5)) {
                case 0:
                    text[at] = static_cast<char>(random());
                    break;
                case 1:
                    text.erase(at, length);
                    break;
                case 2:
                    text.insert(at, text.substr(at, length));
                    break;
                case 3:
                    text.insert(below(text.size()), text.substr(at, length));
                    break;
                default:
                    text.insert(at, kWords[below(std::size(kWords))]);
                    break;
            }
        }
        return text;
    }
    std::uint32_t below(std::size_t bound) { return static_cast<std::uint32_t>(random() % bound); }
    std::mt19937 random;
};

Bytes bytes_of(const std::string& text) {
    return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

// Parts of the shipped file, so that mutations hit something: some messages with all that is said about them.
std::string small_dbc() {
    std::ifstream in(SHIFTRIG_SOURCE_DIR "/config/can/shiftrig.dbc");
    std::ostringstream text;
    std::string line;
    int kept = 0;
    while (std::getline(in, line)) {
        const bool message = line.starts_with("BO_") || line.starts_with(" SG_");
        if (!message || ++kept < 16) text << line << '\n';
    }
    const std::string all = text.str();
    return all.substr(0, all.rfind('\n', 3000) + 1) +
           "BO_ 291 Muxed: 8 Engine\n SG_ Page M : 0|8@1+ (1,0) [0|255] \"\" Brakes\n SG_ A m0 : 8|32@1- "
           "(1,0) [0|0] \"\" Brakes\n"
           " SG_ B m1M : 8|16@0+ (1,0) [0|0] \"\" Brakes\nSIG_VALTYPE_ 291 A : 1;\nSG_MUL_VAL_ 291 A Page "
           "0-0, 5-7;\n"
           "VAL_ 291 Page 0 \"first\" 1 \"second\" ;\nBA_DEF_ BO_ \"GenMsgCycleTime\" INT 0 65535;\nBA_ "
           "\"GenMsgCycleTime\" BO_ 291 20;\n";
}

TEST(Fuzz, AHundredThousandMutatedDbcFilesAreReadOrRefused) {
    const std::string original = small_dbc();
    ASSERT_TRUE(fuzz_dbc(bytes_of(original)));
    Mutator mutator(1);
    int accepted = 0;
    for (int i = 0; i < 100'000; ++i) accepted += fuzz_dbc(bytes_of(mutator.mutate(original)));
    EXPECT_GT(accepted, 5'000);
    EXPECT_LT(accepted, 95'000);
}

TEST(Fuzz, MutatedLogLinesAndDatagramsAreReadOrRefused) {
    const std::string line = "(1436509052.249713) vcan0 18FF1003#E803000000000720 R";
    Mutator mutator(2);
    int accepted = 0;
    for (int i = 0; i < 200'000; ++i) accepted += fuzz_candump(bytes_of(mutator.mutate(line)));
    EXPECT_GT(accepted, 10'000);

    std::array<std::uint8_t, 320> packed;
    Frame frame;
    frame.length = 8;
    const std::string datagram(reinterpret_cast<const char*>(packed.data()),
                               pack_udp_frame(frame, 1, packed));
    for (int i = 0; i < 200'000; ++i) fuzz_datagram(bytes_of(mutator.mutate(datagram)));
}

TEST(Fuzz, AMillionRandomAndMutatedFramesLeaveFiniteValuesAndAllocateNothing) {
    FuzzedRig rig;
    Mutator mutator(3);
    const std::uint32_t ours[] = {
        0x18FF1003, 0x18FF1103, 0x18FF1203, 0x0C000003, 0x0CF00203, 0x18F00503,  // commands, ETC1, ETC2
        0x18EAFFF9, 0x18EA80F9, 0x18EEFF80, 0x1CECFF03, 0x1CEBFF03, 0x1CEC8003, 0x1CEB8003};
    const CountAllocations allocations;
    for (int i = 0; i < 1'000'000; ++i) {
        Frame frame;
        frame.extended = mutator.below(10) != 0;
        const std::uint32_t random_id = static_cast<std::uint32_t>(mutator.random());
        frame.id = mutator.below(4) == 0 ? random_id : ours[mutator.below(std::size(ours))];
        if (mutator.below(8) == 0) frame.id ^= 1U << mutator.below(29);
        frame.id &= frame.extended ? 0x1FFFFFFFU : 0x7FFU;
        frame.length = static_cast<std::uint8_t>(mutator.below(4) == 0 ? mutator.below(9) : 8);
        frame.remote = mutator.below(50) == 0;
        for (std::size_t k = 0; k < 8; k += 4) {
            const auto four = static_cast<std::uint32_t>(mutator.random());
            std::memcpy(&frame.data[k], &four, 4);
        }
        if (mutator.below(2) == 0) {  // sealed as it should be, so that the contents are looked at
            const unsigned counter = static_cast<unsigned>(i) & 15U;
            frame.data[7] =
                static_cast<std::uint8_t>(counter | tsc1_checksum(frame.id, frame.data.data(), counter) << 4);
        }
        // Transport frames with plausible controls.
        if (((frame.id >> 16) & 0xFF) == 0xEC)
            frame.data[0] = static_cast<std::uint8_t>(std::array{16, 17, 19, 32, 255}[mutator.below(5)]);
        if (((frame.id >> 16) & 0xFF) == 0xEB)
            frame.data[0] = static_cast<std::uint8_t>(1 + mutator.below(4));
        rig.hear(frame);
        if (i % 1000 == 0) {
            ASSERT_FALSE(rig.wrong()) << "after frame " << i;
        }
    }
    EXPECT_EQ(allocations.count(), 0);
    EXPECT_FALSE(rig.wrong());
    EXPECT_GT(rig.good(), 10'000U) << "enough of them were believed";
}

}  // namespace
}  // namespace shiftrig::io::can
