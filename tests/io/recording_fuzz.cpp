// The reader against anything at all. Two ways to run it:
//   as a test (recording_fuzz_test): mutations of a sound recording, their checksums made right again or not, from a
//   fixed seed; with the sanitizers in the asan build;
//   with libFuzzer (fuzz_recording, docs/recording.md): whatever it comes upon, as it is and with its checksums made right.
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <span>
#include <string>

#include "io/recording/checksum.h"
#include "io/recording/event_log.h"
#include "io/recording/reader.h"

namespace {

using shiftrig::io::crc32;
using shiftrig::io::event_log_header_size;

// Reads what there is; only RecordingError may come out.
void read(const std::uint8_t* data, std::size_t size) {
    const int fd = ::memfd_create("recording", 0);
    if (::write(fd, data, size) != static_cast<ssize_t>(size)) ::abort();
    try {
        shiftrig::io::RecordingReader reader("/proc/self/fd/" + std::to_string(fd));
        shiftrig::io::RecordedTick tick;
        while (reader.next(tick)) {
            if (tick.outputs.size() != reader.manifest().outputs.size()) ::abort();
        }
        if ((reader.ending() == shiftrig::io::Ending::complete) != reader.complaint().empty()) ::abort();
        if (reader.complaint().find('\n') != std::string::npos) ::abort();
    } catch (const shiftrig::io::RecordingError& error) {
        const std::string line = error.what();
        if (line.empty() || line.find('\n') != std::string::npos) ::abort();
    }
    ::close(fd);
}

// Makes the checksums of all records right again, so that what is behind them is reached.
std::string with_sound_checksums(const std::string& bytes) {
    std::string result = bytes;
    std::size_t at = 0;
    while (at + event_log_header_size <= result.size()) {
        const auto length = [&](std::size_t offset) {
            std::uint32_t value = 0;
            for (std::size_t i = 0; i < 4; ++i)
                value = value << 8 | static_cast<std::uint8_t>(result[at + offset + i]);
            return std::size_t{value};
        };
        const std::size_t begin = at + event_log_header_size + length(20), end = begin + length(24);
        if (end > result.size() || end < begin + 4) break;
        const auto crc = crc32(std::as_bytes(std::span(result)).subspan(begin, end - begin - 4));
        for (std::size_t i = 0; i < 4; ++i) result[end - 4 + i] = static_cast<char>(crc >> (24 - 8 * i));
        at = end;
    }
    return result;
}

}  // namespace

#ifdef SHIFTRIG_LIBFUZZER

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    read(data, size);
    const std::string sound = with_sound_checksums({reinterpret_cast<const char*>(data), size});
    read(reinterpret_cast<const std::uint8_t*>(sound.data()), sound.size());
    return 0;
}

#else

#include <gtest/gtest.h>

#include <cstring>
#include <random>

#include "synthetic_recording.h"

namespace shiftrig::io {
namespace {

class Fuzzed : public testing::TestWithParam<const char*> {};

TEST_P(Fuzzed, RecordingNeverDoesMoreHarmThanOneLine) {
    synthetic::TemporaryFile file(GetParam());
    synthetic::write_small(file.path);
    const std::string sound = synthetic::read_file(file.path);
    std::mt19937 random(3);
    for (int trial = 0; trial < 1500; ++trial) {
        std::string wrong = sound;
        for (unsigned mutations = 1 + random() % 4; mutations > 0; --mutations) {
            const std::size_t at = random() % wrong.size();
            const std::size_t length = std::min<std::size_t>(random() % 64, wrong.size() - at);
            switch (random() % 5) {
                case 0:
                    wrong[at] = static_cast<char>(random());
                    break;
                case 1:
                    wrong.erase(at, length);
                    break;
                case 2:
                    wrong.insert(at, wrong.substr(random() % wrong.size(), length));
                    break;
                case 3:
                    for (std::size_t i = 0; i < std::min<std::size_t>(4, length); ++i)
                        wrong[at + i] = static_cast<char>(0xFF);
                    break;
                default:
                    wrong.resize(at);
            }
            if (wrong.empty()) break;
        }
        if (trial % 2 == 1) wrong = with_sound_checksums(wrong);
        read(reinterpret_cast<const std::uint8_t*>(wrong.data()), wrong.size());
    }
}

INSTANTIATE_TEST_SUITE_P(PlainAndCompressed, Fuzzed, testing::Values(".lcmlog", ".lcmlog.zst"));

}  // namespace
}  // namespace shiftrig::io

#endif
