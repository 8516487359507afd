#include "apps/shiftrig/rig_options.h"

#include <cmath>
#include <stdexcept>

#include "apps/rig/rehearsal.h"
#include "apps/shiftrig/arguments.h"
#include "io/can/mapping.h"

namespace shiftrig::cli {

void RigOptions::add_to(CLI::App& app) {
    files.read(app.add_option("MODEL", choices.model,
                              "the machine (YAML); may be left out where a scenario names it"));
    files.read(app.add_option("--scenario", choices.scenario, "what happens to it (YAML)"));
    add_number(app, "--duration", duration_s, {0, longest_s, true},
               "simulated seconds; else the scenario's, else until SIGINT");
    add_common_to(app);
}

void RigOptions::add_common_to(CLI::App& app, const std::string& usual_pace) {
    pace = usual_pace;
    constexpr double most_ticks = 1e9;
    add_number(app, "--rate-hz", choices.rate_hz, {1, 1e5}, "ticks per simulated second")
        ->capture_default_str();
    add_number(app, "--substeps", choices.substeps, {1, 1000}, "plant steps per tick")->capture_default_str();
    app.add_option("--pace", pace,
                   "wall: by the clock; lockstep: each tick waits for the controller's answer; free: as fast "
                   "as it goes")
        ->check(CLI::IsMember({"wall", "lockstep", "free"}))
        ->capture_default_str();
    add_number(app, "--factor", factor, {0.001, 10'000}, "wall pace: simulated time per wall time")
        ->capture_default_str();
    app.add_option("--bus", choices.buses,
                   "inprocess | can:vcan0 | udpcan:239.74.163.2:43113 | lcm:udpm://239.255.76.67:7667?ttl=0; "
                   "repeatable");
    app.add_option("--controller", choices.controller,
                   "builtin[:CALIBRATION] on the in-process bus | none | a command to start");
    app.add_option("--kernel", choices.kernel, "auto | portable | avx2 | avx512")->capture_default_str();
    add_number(app, "--catch-up", catch_up, {0, most_ticks},
               "wall pace: ticks it may be behind before it skips or aborts")
        ->capture_default_str();
    app.add_option("--overrun", overrun, "what happens then")
        ->check(CLI::IsMember({"skip", "abort"}))
        ->capture_default_str();
    add_number(app, "--late-limit", late_limit, {0, most_ticks},
               "wall pace: late ticks in a row that are too many; 0: any number will do")
        ->capture_default_str();
    app.add_option("--when-late", when_late, "what happens then")
        ->check(CLI::IsMember({"record", "skip", "abort"}))
        ->capture_default_str();
    add_number(app, "--answer-timeout", answer_timeout_s, {0, 3600, true},
               "lockstep: seconds to wait for an answer")
        ->capture_default_str();
    add_number(app, "--priority", priority, {0, 99}, "wall pace: FIFO priority of the plant thread; 0: none")
        ->capture_default_str();
    add_number(app, "--rehearse", rehearsal, {0, most_ticks},
               "wall pace: ticks of the scenario that are lived through before the start, so that what is "
               "built when a mode is first met is there; 0: none")
        ->capture_default_str();
    add_number(app, "--cpu", processors, {0, rt::most_processors - 1},
               "processors the plant thread may run on");
}

void RigOptions::add_controller_start_to(CLI::App& app) {
    add_number(app, "--controller-start", controller_start_s, {0, 3600},
               "seconds a command given as --controller has to get ready")
        ->capture_default_str();
}

rt::Pace RigOptions::pacing() const {
    return pace == "wall" ? rt::Pace::wall : pace == "lockstep" ? rt::Pace::lockstep : rt::Pace::free;
}

rt::LoopSettings RigOptions::loop(const rig::Setup& setup) const {
    rt::LoopSettings settings;
    settings.period = setup.tick_ns;
    settings.pace = pacing();
    settings.factor = factor;
    settings.catch_up = catch_up;
    settings.beyond_bound = overrun == "abort" ? rt::BeyondBound::abort : rt::BeyondBound::skip;
    settings.late_run_limit = late_limit;
    settings.late_run = when_late == "abort"  ? rt::LateRun::abort
                        : when_late == "skip" ? rt::LateRun::skip
                                              : rt::LateRun::record;
    settings.answer_timeout = std::llround(answer_timeout_s * 1e9);
    const double duration = duration_s.value_or(setup.scenario ? setup.scenario->duration : 0);
    if (duration > 0) settings.slots = std::llround(duration * 1e9 / static_cast<double>(setup.tick_ns));
    if (settings.slots == 0) throw std::invalid_argument("--duration: less than half a tick");
    return settings;
}

std::vector<NamedFile> files_of(const io::ModelFile& model) {
    std::vector<NamedFile> read = {{"the model", model.path}};
    if (model.can.IsDefined()) {
        const io::can::Mapping mapping = io::can::parse_mapping(model.can, model.path);
        read.push_back({"the CAN mapping", mapping.file});
        read.push_back({"the mapping's DBC", mapping.database.file});
    }
    return read;
}

std::vector<NamedFile> files_of(const rig::Setup& setup) {
    std::vector<NamedFile> read = files_of(setup.model);
    if (setup.scenario) read.push_back({"the scenario", setup.scenario->path});
    if (!setup.buses.calibration_path.empty())
        read.push_back({"the controller's calibration", setup.buses.calibration_path});
    return read;
}

void RigOptions::check_files(const rig::Setup& setup) const {
    files.check(files_of(setup));
}

void rehearse(const RigOptions& options, rig::Rig& rig) {
    if (options.pacing() == rt::Pace::wall) rig::rehearse(rig, options.rehearsal);
}

rt::Refusals prepare_process(const RigOptions& options, rt::AwakeProcessors& awake) {
    if (options.pacing() != rt::Pace::wall) return {};
    rt::Refusals refusals = rt::set_up_memory({});
    for (auto& refusal : awake.hold()) refusals.push_back(std::move(refusal));
    return refusals;
}

rt::Refusals prepare_thread(const RigOptions& options) {
    if (options.pacing() != rt::Pace::wall) return {};
    rt::ThreadSettings settings;
    settings.fifo_priority = options.priority;
    settings.processors = options.processors;
    return rt::set_up_thread(settings);
}

}  // namespace shiftrig::cli
