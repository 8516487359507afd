// A shift of the reference tractor driven straight into the plant, without bus and controller, and recorded.
#pragma once

#include <chrono>

#include "io/model_file.h"
#include "io/recording/rebuild.h"
#include "synthetic_recording.h"

namespace shiftrig::io::synthetic {

struct ShiftOptions {
    int ticks = 1500, substeps = 1;
    plant::KernelKind kernel = plant::KernelKind::portable;
    double handover_pressure = 12e5;  // of F3 [Pa]
    bool starve_the_log = false;      // from tick 400 to 449 a queue of 4 ticks is not waited for
    bool stop_at_a_loss = false;      // the tick that finds the queue full is the last
    RecordingOptions recording;
};

// Range M, F2 closed under the plough; at tick 200 F2 opens and F3 closes.
inline RecordingSummary record_shift(const std::string& path, const ShiftOptions& options = {}) {
    Manifest m;
    m.model_path = SHIFTRIG_SOURCE_DIR "/config/tractor.yaml";
    m.model_text = read_file(m.model_path);
    m.overrides = {{"range", "M"}};
    m.substeps = options.substeps;
    m.step_size = 1e-3 / options.substeps;
    ModelFile file = recorded_model_file(m);
    plant::BuildOptions build;
    build.step_size = m.step_size;
    build.kernel = options.kernel;
    const plant::Model model = build_model(file, build);
    m.kernel = model.kernel();
    m.start_utime = 1'700'000'000'000'000;
    m.inputs = model.inputs();
    m.outputs = model.outputs();
    m.devices = model.device_names();

    plant::Operators operators(model);
    plant::State state(model);
    plant::Inputs inputs(model);
    plant::Outputs outputs(model);
    plant::Scratch scratch(model);
    const auto input = [&](const char* name) -> double& {
        return inputs.value.at(static_cast<std::size_t>(model.input(name)));
    };
    input("driver.throttle") = 0.7281;
    input("environment.draft") = 1;
    input("clutch.F2.pressure_command") = 18e5;
    plant::start(model, state, {{"Fc", "F2"}, {{"engine", 188.6}}}, inputs);
    for (int i = 0; i < 500; ++i) plant::step(model, operators, state, inputs, outputs, scratch);

    const auto bytes = state.bytes();
    m.initial_state.assign(bytes.begin(), bytes.end());
    RecordingOptions recording = options.recording;
    if (options.starve_the_log) {
        recording.queue_bytes = 1;
        recording.flush_interval = std::chrono::hours(1);
    }
    RecordingWriter writer(path, recording);
    writer.begin(m);
    for (std::int64_t tick = 0; tick < options.ticks; ++tick) {
        if (tick >= 200) {
            input("clutch.F3.pressure_command") = options.handover_pressure;
            if (tick >= 300) input("clutch.F2.pressure_command") = 0;
        }
        std::vector<plant::Event> events;
        for (int substep = 0; substep < options.substeps; ++substep) {
            plant::step(model, operators, state, inputs, outputs, scratch);
            events.insert(events.end(), outputs.events.begin(), outputs.events.begin() + outputs.event_count);
        }
        TickRecord r;
        r.tick = tick;
        r.sim_time_ns = (tick + 1) * 1'000'000;
        r.inputs = inputs.value;
        r.outputs = outputs.value;
        r.events = events;
        r.certificate = outputs.certificate;
        r.state = state.bytes();
        const bool waits = tick >= 450 && !options.stop_at_a_loss;
        if (!options.starve_the_log || tick < 400 || waits) writer.wait_for_room();
        writer.tick(r);
        if (options.stop_at_a_loss && writer.lost() > 0) break;
    }
    return writer.end();
}

}  // namespace shiftrig::io::synthetic
