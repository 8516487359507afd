// What a recording says of itself before its first tick: enough to build the same plant again, to name
// every number, and to know what made it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "io/input_error.h"
#include "plant/signal.h"

namespace shiftrig::io {

// A recording or snapshot that cannot be written or read; what() is one line, beginning with the path.
class RecordingError : public InputError {
  public:
    using InputError::InputError;
};

struct Manifest {
    std::string model_path, model_text;        // as read; the path is for people
    std::string scenario_path, scenario_text;  // empty if there was none
    // What was changed after loading the model, in the words of the command line or scenario
    // ("range" → "M"), so that the same Description comes out again.
    std::map<std::string, std::string> overrides;
    // Version, compiler, kernel ("portable"), engine ("etd3"), pacing, bus URLs, what the machine did not
    // grant …; for people and for the first line of a report.
    std::map<std::string, std::string> facts;

    double step_size = 1e-3;           // h of the plant [s]
    int substeps = 1;                  // plant steps per tick
    std::int64_t tick_ns = 1'000'000;  // period of a tick [ns] = substeps · step_size
    std::string kernel;                // plant::Model::kernel()
    std::uint64_t seed = 1;            // plant::Model::seed()
    std::int64_t first_tick = 0;       // number of the first tick; > 0 if the run continued a snapshot
    bool wall_clock = false;           // record_timing_t are kept
    std::int64_t start_utime = 0;      // wall clock at the start [µs since 1970]; 0: begin() takes it

    std::vector<plant::Signal> inputs, outputs;  // plant::Model's, in its order
    std::vector<plant::Signal> rig;              // the rig's own signals
    std::vector<std::string> devices;            // plant::Model::device_names()

    std::vector<std::byte> initial_state;  // plant::State::bytes() before the first tick
    // Of a snapshot, else empty: the changing parts of the whole assembly (io/archive.h), in the bytes of the
    // program that wrote them, and what the run was like before (whoever writes it knows the format).
    std::vector<std::byte> assembly, history;

    std::string model_hash() const;     // SHA-256 of model_text, hexadecimal (what sha256sum prints)
    std::string scenario_hash() const;  // of scenario_text, empty if there was none
    // The manifest chunk: everything above but the texts and the state. from_json throws RecordingError
    // (without a path).
    std::string to_json() const;
    static Manifest from_json(const std::string& text);
};

}  // namespace shiftrig::io
