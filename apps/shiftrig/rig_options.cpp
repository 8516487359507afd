#include "apps/shiftrig/rig_options.h"

#include <cmath>

#include "apps/rig/rehearsal.h"

namespace shiftrig::cli {

void RigOptions::add_to(CLI::App& app) {
    app.add_option("MODEL", choices.model, "the machine (YAML); may be left out where a scenario names it");
    app.add_option("--scenario", choices.scenario, "what happens to it (YAML)");
    app.add_option("--duration", duration_s, "simulated seconds; else the scenario's, else until SIGINT")
        ->check(CLI::PositiveNumber);
    add_common_to(app);
}

void RigOptions::add_common_to(CLI::App& app, const std::string& usual_pace) {
    pace = usual_pace;
    app.add_option("--rate-hz", choices.rate_hz, "ticks per simulated second")->capture_default_str();
    app.add_option("--substeps", choices.substeps, "plant steps per tick")->capture_default_str();
    app.add_option("--pace", pace,
                   "wall: by the clock; lockstep: each tick waits for the controller's answer; free: as fast "
                   "as it goes")
        ->check(CLI::IsMember({"wall", "lockstep", "free"}))
        ->capture_default_str();
    app.add_option("--factor", factor, "wall pace: simulated time per wall time")
        ->check(CLI::PositiveNumber)
        ->capture_default_str();
    app.add_option("--bus", choices.buses,
                   "inprocess | can:vcan0 | udpcan:239.74.163.2:43113 | lcm:udpm://239.255.76.67:7667?ttl=0; "
                   "repeatable");
    app.add_option("--controller", choices.controller,
                   "builtin[:CALIBRATION] on the in-process bus | none | a command to start");
    app.add_option("--kernel", choices.kernel, "auto | portable | avx2 | avx512")->capture_default_str();
    app.add_option("--catch-up", catch_up, "wall pace: ticks it may be behind before it skips or aborts")
        ->check(CLI::NonNegativeNumber)
        ->capture_default_str();
    app.add_option("--overrun", overrun, "what happens then")
        ->check(CLI::IsMember({"skip", "abort"}))
        ->capture_default_str();
    app.add_option("--late-limit", late_limit,
                   "wall pace: late ticks in a row that are too many; 0: any number will do")
        ->check(CLI::NonNegativeNumber)
        ->capture_default_str();
    app.add_option("--when-late", when_late, "what happens then")
        ->check(CLI::IsMember({"record", "skip", "abort"}))
        ->capture_default_str();
    app.add_option("--answer-timeout", answer_timeout_s, "lockstep: seconds to wait for an answer")
        ->check(CLI::PositiveNumber)
        ->capture_default_str();
    app.add_option("--priority", priority, "wall pace: FIFO priority of the plant thread; 0: none")
        ->check(CLI::Range(0, 99))
        ->capture_default_str();
    app.add_option("--rehearse", rehearsal,
                   "wall pace: ticks of the scenario that are lived through before the start, so that what "
                   "is built when a "
                   "mode is first met is there; 0: none")
        ->check(CLI::NonNegativeNumber)
        ->capture_default_str();
    app.add_option("--cpu", processors, "processors the plant thread may run on");
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
    return settings;
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
