#include "apps/rig/session.h"

#include <utility>

namespace shiftrig::rig {

namespace {

using Hook = std::function<void(Rig&, const rt::Tick&)>;

// Who sets a hook keeps the loop's promise.
SHIFTRIG_TRUSTED_BEGIN
void call(const Hook& hook, Rig& rig, const rt::Tick& tick) SHIFTRIG_REALTIME {
    if (hook) hook(rig, tick);
}

std::span<const std::byte> bytes_of(const plant::State& state) SHIFTRIG_REALTIME {
    return state.bytes();  // an address and a length
}
SHIFTRIG_TRUSTED_END

}  // namespace

Session::Session(Rig& rig, SessionOptions options)
    : rig_(rig), options_(std::move(options)), loop_(options_.loop) {
    if (options_.trace) {
        span_tick_ = options_.trace->name("tick");
        span_record_ = options_.trace->name("record");
    }
    if (options_.recording) {
        io::Manifest manifest = manifest_of(rig, options_.loop);
        for (const auto& [key, value] : options_.facts) manifest.facts[key] = value;
        options_.recording->begin(manifest);
    }
}

const rt::LoopReport& Session::run() {
    started_ns_ = clock_.now();
    // Paces that can wait lose no tick of the recording.
    const bool waits = options_.recording && options_.loop.pace != rt::Pace::wall;
    const rt::LoopReport& report = loop_.run(
        [this, waits](const rt::Tick& t) {
            if (waits) options_.recording->wait_for_room();
            tick(t);
        },
        [this](std::int64_t timeout_ns) { return rig_.wait_for_answer(timeout_ns); });
    if (options_.recording) options_.recording->came_to(rt::name(report.outcome));
    return report;
}

void Session::tick(const rt::Tick& t) SHIFTRIG_REALTIME {
    call(options_.before, rig_, t);

    const std::int64_t began = clock_.now();
    // Without a wall clock no signal depends on it: two runs give the same recording.
    const bool by_the_clock = options_.loop.pace == rt::Pace::wall;
    const double load = static_cast<double>(compute_ns_) / static_cast<double>(options_.loop.period);
    rig_.report_timing(loop_.report().overruns, by_the_clock ? load : 0);
    rig_.tick();
    const std::int64_t ended = clock_.now();
    compute_ns_ = ended - began;
    rig_time_.record(compute_ns_);
    certificate_.take(rig_.certificate());
    for (std::int64_t latency; rig_.buses().next_command_latency(latency);)
        command_to_signal_.record(latency);

    if (options_.recording) record(t, began);
    if (options_.collector) options_.collector->take(rig_);
    call(options_.after, rig_, t);
    if (options_.trace) {
        options_.trace->span(span_tick_, began, ended, t.slot);
        options_.trace->span(span_record_, ended, clock_.now(), t.slot);
    }
}

void Session::record(const rt::Tick& t, std::int64_t began) SHIFTRIG_REALTIME {
    io::TickRecord r;
    r.tick = rig_.ticks() - 1;
    r.sim_time_ns = rig_.sim_time_ns();
    r.inputs = rig_.input_values();
    r.outputs = rig_.output_values();
    r.rig = rig_.rig_values();
    r.events = rig_.plant_events();
    r.events_not_kept = rig_.plant_events_not_kept();
    r.certificate = rig_.certificate();
    r.state = bytes_of(rig_.state());
    r.overruns = loop_.report().overruns;
    r.messages_lost = static_cast<std::int64_t>(rig_.buses().messages_lost());
    r.wall_ns = began - started_ns_;
    r.lateness_ns = t.start - t.deadline;
    r.compute_ns = compute_ns_;
    options_.recording->tick(r);
}

io::Manifest manifest_of(const Rig& rig, const rt::LoopSettings& loop) {
    const auto& setup = rig.setup();
    const auto& model = rig.model();
    io::Manifest m;
    m.model_path = setup.model.path;
    m.model_text = setup.model.text;
    if (setup.scenario) {
        m.scenario_path = setup.scenario->path;
        m.scenario_text = setup.scenario->text;
        for (const auto& [gear, option] : setup.scenario->start.options) m.overrides[gear] = option;
    }
    m.facts["pace"] = loop.pace == rt::Pace::wall       ? "wall"
                      : loop.pace == rt::Pace::lockstep ? "lockstep"
                                                        : "free";
    m.facts["engine"] = model.engine();
    m.facts["kernel"] = model.kernel();
    m.facts["compiler"] = __VERSION__;
    std::string buses;
    for (const auto& name : setup.buses.names) buses += (buses.empty() ? "" : " ") + name;
    m.facts["buses"] = buses;
    if (!setup.buses.calibration_path.empty()) m.facts["calibration"] = setup.buses.calibration_path;
    m.step_size = model.step_size();
    m.substeps = setup.substeps;
    m.tick_ns = setup.tick_ns;
    m.kernel = model.kernel();
    m.seed = model.seed();
    m.first_tick = rig.ticks();
    m.wall_clock = loop.pace == rt::Pace::wall;
    m.inputs = model.inputs();
    m.outputs = model.outputs();
    m.rig = rig.rig_signals();
    m.devices = model.device_names();
    const auto state = rig.state().bytes();
    m.initial_state.assign(state.begin(), state.end());
    return m;
}

}  // namespace shiftrig::rig
