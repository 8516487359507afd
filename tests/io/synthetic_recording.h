// A run without a plant: made-up signals, events and states, the same for the same tick.
#pragma once

#include <unistd.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

#include "io/recording/reader.h"
#include "io/recording/writer.h"

namespace shiftrig::io::synthetic {

// A file name of this process, removed at the end of the test.
struct TemporaryFile {
    explicit TemporaryFile(const std::string& suffix)
        : path((std::filesystem::temp_directory_path() /
                ("shiftrig-test-" + std::to_string(::getpid()) + "-" + std::to_string(++count) + suffix))
                   .string()) {}
    ~TemporaryFile() { std::filesystem::remove(path); }
    TemporaryFile(const TemporaryFile&) = delete;
    std::string path;
    static inline int count = 0;
};

inline std::string read_file(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

inline void write_file(const std::string& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

inline plant::Signal signal(const std::string& name, plant::Unit unit) {
    plant::Signal s;
    s.name = name;
    s.unit = unit;
    s.description = "made up";
    return s;
}

inline Manifest manifest() {
    Manifest m;
    m.model_path = "config/made_up.yaml";
    m.model_text = "name: made up\n" + std::string(5000, '#') + "\n";  // more than one chunk
    m.scenario_path = "config/scenarios/none.yaml";
    m.scenario_text = "duration_s: 1\n";
    m.overrides = {{"range", "M"}};
    m.facts = {{"build", "test"}};
    m.kernel = "portable";
    m.seed = 0xFEEDFACECAFEBEEF;
    m.start_utime = 1'700'000'000'000'000;
    for (int i = 0; i < 3; ++i)
        m.inputs.push_back(signal("clutch.F" + std::to_string(i) + ".pressure_command", plant::Unit::pascal));
    for (int i = 0; i < 100; ++i)
        m.outputs.push_back(signal("mass.m" + std::to_string(i) + ".speed", plant::Unit::radian_per_second));
    m.rig = {signal("driver.lever", plant::Unit::one)};
    m.devices = {"F0", "F1", "F2"};
    m.initial_state.assign(3000, std::byte{7});
    return m;
}

struct Tick {
    std::vector<double> inputs, outputs, rig;
    std::vector<plant::Event> events;
    std::vector<std::byte> state;
    TickRecord record;
};

// Inputs change every 10 ticks, outputs 64…99 stand still from tick 5 on; odd numbers are among them.
inline void fill(Tick& t, std::int64_t n) {
    const double x = static_cast<double>(n);
    t.inputs = {1e5 * std::floor(x / 10), 0.0, -0.0};
    t.outputs.assign(100, 0.0);
    for (std::size_t i = 0; i < 64; ++i) t.outputs[i] = std::sin(x + 0.1 * static_cast<double>(i));
    for (std::size_t i = 64; i < 100; ++i) t.outputs[i] = std::min(x, 5.0) / 3;
    t.outputs[0] = n % 7 == 0 ? std::numeric_limits<double>::quiet_NaN() : t.outputs[0];
    t.outputs[1] = n % 5 == 0 ? -std::numeric_limits<double>::infinity() : -0.0;
    t.rig = {std::floor(x / 50)};
    t.events.clear();
    if (n % 4 == 1) {
        plant::Event e;
        e.time = 1e-3 * x + 0.25e-3;
        e.kind = plant::EventKind::lock;
        e.device = 1;
        e.torque = -x;
        e.capacity = 2 * x;
        e.slip = 1e-12;
        if (n % 8 == 1) {
            e.kind = plant::EventKind::tie_up;
            e.value = 0.5 * x;
            e.members = 3;
        }
        t.events.assign(static_cast<std::size_t>(n % 3 + 1), e);
    }
    t.state.assign(3000, static_cast<std::byte>(n % 251));
    TickRecord& r = t.record;
    r.tick = n;
    r.sim_time_ns = (n + 1) * 1'000'000;
    r.inputs = t.inputs;
    r.outputs = t.outputs;
    r.rig = t.rig;
    r.events = t.events;
    r.state = t.state;
    r.certificate.torque_residual = 1e-15 * x;
    r.overruns = n / 3;
    r.messages_lost = n / 7;
    r.wall_ns = 1000 * n;
    r.lateness_ns = n;
    r.compute_ns = 2 * n;
}

inline RecordingSummary write(const std::string& path, int ticks, const RecordingOptions& options = {},
                              const Manifest& m = manifest()) {
    RecordingWriter writer(path, options);
    writer.begin(m);
    Tick t;
    for (int n = 0; n < ticks; ++n) {
        fill(t, n);
        writer.wait_for_room();
        writer.tick(t.record);
    }
    writer.came_to("completed");
    return writer.end();
}

// Every kind of record, in as few bytes as it takes: what fuzzing begins with.
inline RecordingSummary write_small(const std::string& path) {
    Manifest small = manifest();
    small.model_text = "x";
    small.initial_state.resize(100);
    small.outputs.resize(20);
    small.wall_clock = true;
    RecordingOptions options;
    options.keyframe_interval = 2;
    return write(path, 6, options, small);
}

inline bool same_bits(const std::vector<double>& a, const std::vector<double>& b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}

}  // namespace shiftrig::io::synthetic
