// shiftrig run: the rig at work.
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iostream>
#include <memory>
#include <thread>

#include "analysis/change_json.h"
#include "analysis/scorecard.h"
#include "apps/rig/session.h"
#include "apps/rig/snapshot.h"
#include "apps/shiftrig/arguments.h"
#include "apps/shiftrig/certificate_report.h"
#include "apps/shiftrig/child.h"
#include "apps/shiftrig/command.h"
#include "apps/shiftrig/ending_signals.h"
#include "apps/shiftrig/live_line.h"
#include "apps/shiftrig/loop_report.h"
#include "apps/shiftrig/resumed_rig.h"
#include "apps/shiftrig/rig_options.h"
#include "io/recording/csv.h"
#include "io/recording/reader.h"
#include "plant/warnings.h"
#include "rt/machine.h"

namespace shiftrig::cli {

namespace {

struct RunOptions : RigOptions {
    std::string record, csv, trace;
    std::pair<double, std::string> snapshot_at{-1, ""};  // time [s], file
    std::string from;                                    // snapshot to go on from
    bool json = false;
};

// A new rig, or one that goes on from a snapshot.
std::unique_ptr<rig::Rig> make_rig(const RunOptions& options) {
    if (!options.from.empty()) return resumed_rig(options.from, options);
    rig::Choices choices = options.choices;
    choices.lockstep = options.pacing() == rt::Pace::lockstep;
    rig::Setup setup = rig::make_setup(choices);
    options.check_files(setup);
    return std::make_unique<rig::Rig>(std::move(setup));
}

// What the model file says of its start, where that counts: a scenario and a snapshot may have brought their own.
void warn_of_initial_speeds(const RunOptions& options, const rig::Rig& rig) {
    const auto& scenario = rig.setup().scenario;
    const bool own_start = !options.from.empty() ||
                           (scenario && !(scenario->start.locked.empty() && scenario->start.speeds.empty()));
    if (own_start) return;
    const std::string warning = plant::initial_speed_warning(rig.model());
    if (!warning.empty()) std::cerr << warning << '\n';
}

// Nothing is taken outside of the run: `slots` ticks from where the rig stands.
void check_snapshot_time(double at_s, const rig::Rig& rig, std::int64_t slots) {
    const std::int64_t tick_ns = rig.setup().tick_ns;
    const std::int64_t at = (std::llround(at_s * 1e9) + tick_ns - 1) / tick_ns;  // the tick that ends there
    const auto refuse = [&](const char* what, std::int64_t tick) {
        const double time = 1e-9 * static_cast<double>(tick) * static_cast<double>(tick_ns);
        throw std::invalid_argument("--snapshot-at " + io::in_digits(at_s) + ": the run " + what + " " +
                                    io::in_digits(time) + " s");
    };
    if (at < rig.ticks()) refuse("goes on from", rig.ticks());
    if (at > rig.ticks() + slots) refuse("ends at", rig.ticks() + slots);
}

std::atomic<bool> asked_to_stop{false};
std::atomic<rt::LoopControl*> running{nullptr};

void on_signal(int) {
    asked_to_stop = true;
    if (rt::LoopControl* control = running.load()) control->stop();
}

void catch_ending_signals() {
    struct sigaction action = {};
    action.sa_handler = on_signal;
    for (const int signal : ending_signals()) sigaction(signal, &action, nullptr);
}

// Signals end this loop, also those that came before it.
class SignalsStop {
  public:
    explicit SignalsStop(rt::LoopControl& control) {
        running = &control;
        if (asked_to_stop) control.stop();
    }
    ~SignalsStop() { running = nullptr; }
};

// Starts the controller and gives it its time, unless the run is over before it began. False if it turns out to be no program.
bool get_ready(const RunOptions& options, std::optional<Child>& controller) {
    const auto command = rig::controller_command(options.choices);
    if (command.empty()) return true;
    controller.emplace(command);
    if (const auto how =
            controller->ends_within(options.controller_start_s, [] { return asked_to_stop.load(); }))
        std::cerr << *how << '\n';
    return !controller->was_no_program();
}

// What the session needs beside the rig, and what is left of it afterwards.
struct Beside {
    std::unique_ptr<PassingFile> passing;  // a recording for the CSV alone
    std::unique_ptr<io::RecordingWriter> recording;
    std::string recording_path;  // "" if nothing is recorded
    std::unique_ptr<rig::Collector> collector;
    std::unique_ptr<rt::Trace> trace;
    io::RecordingSummary recorded;
};

Beside prepare(const RunOptions& options, const rig::Rig& rig, const rt::LoopSettings& loop) {
    Beside beside;
    beside.recording_path = options.record;
    if (options.record.empty() && !options.csv.empty()) {
        beside.passing = std::make_unique<PassingFile>(options.csv, ".lcmlog");
        beside.recording_path = beside.passing->path();
    }
    if (!beside.recording_path.empty())
        beside.recording = std::make_unique<io::RecordingWriter>(beside.recording_path);
    constexpr std::int64_t an_hour_of_ticks = 3'600'000;  // the collector takes what fits its memory of it
    beside.collector = std::make_unique<rig::Collector>(rig, std::min(loop.slots, an_hour_of_ticks));
    if (!options.trace.empty()) beside.trace = std::make_unique<rt::Trace>(std::size_t{200'000});
    return beside;
}

nlohmann::json result_json(const rig::Rig& rig, const rt::LoopReport& report, const analysis::Run& run,
                           const analysis::Scorecard& scorecard) {
    const double wall = static_cast<double>(report.ended - report.began) * 1e-9;
    nlohmann::json result;
    result["ticks"] = report.executed;
    result["sim_time_s"] = rig.sim_time();
    result["overruns"] = report.overruns;
    result["real_time_factor"] = wall > 0 ? rig.sim_time() / wall : 0;
    result["shifts"] = analysis::to_json(scorecard);
    result["events"] = nlohmann::json::array();
    for (const auto& change : run.changes) result["events"].push_back(analysis::to_json(change));
    result["final"] = nlohmann::json::object();
    for (int i = 0; i < rig.signals().size(); ++i)
        result["final"][io::column_name(rig.signals().signal(i))] = rig.value(i);
    result["loop"] = to_json(report);
    return result;
}

std::string in_one_line(const rt::Refusals& refusals) {
    std::string line;
    for (const auto& refusal : refusals) {
        if (!line.empty()) line += " | ";
        line += rt::to_string(refusal);
    }
    return line;
}

// Runs the loop in a thread of its own; this one shows the live line, watches the controller's process and says once if
// lockstep waits for a controller that does not answer.
void run_loop(rig::Session& session, const RunOptions& options, LiveLine& live, Child* controller,
              const std::atomic<bool>& unanswered) {
    std::atomic<bool> done{false};
    bool complained = false;
    std::thread plant([&] {
        prepare_thread(options);
        session.run();
        done = true;
    });
    while (!done) {
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        live.show();
        if (unanswered && !complained) {
            complained = true;
            std::cerr << (live.shown() ? "\n" : "") << "lockstep: the controller has not answered for "
                      << options.answer_timeout_s
                      << " s (--answer-timeout); so long is waited for each command cycle\n";
        }
        if (controller)
            if (const auto how = controller->ended()) std::cerr << (live.shown() ? "\n" : "") << *how << '\n';
    }
    plant.join();
    live.end();
}

// False, and told, if it did not work out: what else there is of the run is still wanted.
bool export_csv(const std::string& recording, const std::string& csv) {
    try {
        io::RecordingReader reader(recording);
        io::export_csv(reader, csv);
        return true;
    } catch (const io::RecordingError& error) {
        std::cerr << error.what() << '\n';
        return false;
    }
}

// Closes what was recorded; false if something of it is lost.
bool finish(const RunOptions& options, Beside& beside) {
    bool whole = true;
    if (beside.recording) {
        beside.recorded = beside.recording->end();
        whole = beside.recorded.error.empty() && beside.recorded.lost == 0;
        if (!beside.recorded.error.empty()) tell(beside.recorded.error);
        if (beside.recorded.lost > 0)
            tell(beside.recording_path + ": " + std::to_string(beside.recorded.lost) +
                 " ticks were not kept: the disk did not keep up");
    }
    if (!options.csv.empty()) whole = export_csv(beside.recording_path, options.csv) && whole;
    if (beside.trace) {
        std::ofstream file(options.trace);
        beside.trace->write(file);
        if (!file) tell(options.trace + ": could not be written"), whole = false;
    }
    return whole;
}

// False, and told, if it could not be written or the run was stopped before its time.
bool write_snapshot(const rig::SnapshotTaker& taker, const std::string& path, const rig::Rig& rig,
                    const rt::LoopSettings& loop, const analysis::Run& run) {
    try {
        taker.write(path, rig, loop, run);
        return true;
    } catch (const io::RecordingError& error) {
        std::cerr << error.what() << '\n';
        return false;
    }
}

double dissipated(const rig::Rig& rig) {  // since the machine's start [J]
    return rig.value(rig.signals().find("energy.dissipated"));
}

void print_summary(const rig::Rig& rig, const rig::Session& session, double dissipated_before,
                   const analysis::Run& run, const analysis::Scorecard& scorecard) {
    const rt::LoopReport& report = session.report();
    const double wall = static_cast<double>(report.ended - report.began) * 1e-9;
    std::printf("%lld ticks, %.6g s simulated in %.3g s (%.3g times real time)\n",
                static_cast<long long>(report.executed), rig.sim_time(), wall,
                wall > 0 ? rig.sim_time() / wall : 0);
    std::cout << describe(report) << "rig tick  " << session.rig_time().percentiles() << '\n';
    if (session.command_to_signal().count() > 0)
        std::cout << "command → signal  " << session.command_to_signal().percentiles() << '\n';
    const auto told = std::count_if(run.changes.begin(), run.changes.end(),
                                    [](const analysis::Change& change) { return !change.device.empty(); });
    std::cout << describe(session.certificate(), told, dissipated(rig) - dissipated_before);
    if (!scorecard.shifts.empty()) std::cout << '\n' << analysis::to_text(scorecard);
}

int run(const RunOptions& options) {
    if (const auto command = rig::controller_command(options.choices); !command.empty())
        require_program(command);
    const auto owned = make_rig(options);
    rig::Rig& rig = *owned;
    for (const auto& warning : rig.buses().warnings()) std::cerr << warning << '\n';
    warn_of_initial_speeds(options, rig);

    rehearse(options, rig);
    rt::AwakeProcessors awake;
    rt::Refusals refusals = prepare_process(options, awake);
    // What the plant thread will not be granted is asked for in advance, so that the recording can begin with it.
    std::thread([&] {
        for (auto& refusal : prepare_thread(options)) refusals.push_back(std::move(refusal));
    }).join();
    rt::LoopSettings loop = options.loop(rig.setup());
    loop.slots -= rig.ticks();  // a snapshot has done some
    std::optional<rig::SnapshotTaker> taker;
    if (options.snapshot_at.first >= 0) {
        check_snapshot_time(options.snapshot_at.first, rig, loop.slots);
        taker.emplace(rig, options.snapshot_at.first);
    }
    // Only now are files opened for writing: what a run that does not begin would have replaced stays.
    catch_ending_signals();
    std::optional<Child> controller;
    if (!get_ready(options, controller)) return bad_input;
    Beside beside = prepare(options, rig, loop);
    LiveLine live(rig);

    rig::SessionOptions session_options;
    session_options.loop = loop;
    session_options.recording = beside.recording.get();
    session_options.collector = beside.collector.get();
    session_options.trace = beside.trace.get();
    session_options.facts["not granted"] = in_one_line(refusals);
    session_options.facts["machine"] = rt::describe_machine();
    std::atomic<bool> unanswered{false};
    session_options.after = [&](rig::Rig& each, const rt::Tick& tick) {
        if (!tick.answered) unanswered = true;
        live.take(each);
        if (taker) taker->offer(each);
    };
    rig::Session session(rig, std::move(session_options));
    const double dissipated_before = dissipated(rig);

    {
        const SignalsStop signals_stop(session.control());
        run_loop(session, options, live, controller ? &*controller : nullptr, unanswered);
    }
    const bool controlled = !controller || !controller->was_no_program();
    controller.reset();

    const bool frames_logged = rig.buses().end_logs();
    bool whole = finish(options, beside) && frames_logged && controlled;
    for (const auto& refusal : refusals)
        std::cerr << "this machine does not grant " << rt::to_string(refusal) << '\n';
    for (const auto& line : rig.buses().summary()) std::cerr << line << '\n';
    if (beside.collector->ticks_left_out() > 0)
        std::cerr << "shifts are judged without the last " << beside.collector->ticks_left_out()
                  << " ticks, which did not fit the memory\n";
    if (beside.collector->events_left_out() > 0)
        std::cerr << beside.collector->events_left_out() << " events are not told: they did not fit\n";

    const auto& report = session.report();
    const analysis::Run collected = beside.collector->finish(rig);
    if (taker) whole = write_snapshot(*taker, options.snapshot_at.second, rig, loop, collected) && whole;
    const auto scorecard = analysis::score(collected);
    if (options.json) {
        nlohmann::json result = result_json(rig, report, collected, scorecard);
        result["loop"]["rig_tick_ns"] = to_json(session.rig_time());
        result["loop"]["command_to_signal_ns"] = to_json(session.command_to_signal());
        result["certificate"] = to_json(session.certificate(), rig.setup().model.description);
        result["not_granted"] = to_json(refusals);
        std::cout << result.dump() << '\n';
    } else {
        print_summary(rig, session, dissipated_before, collected, scorecard);
    }
    return whole && gave_up(report).empty() && session.certificate().is_finite() ? good : failed;
}

Command::Run declare(CLI::App& app) {
    auto options = std::make_shared<RunOptions>();
    options->add_to(app);
    Files& files = options->files;
    files.written(app.add_option("--record", options->record, "recording (an LCM log; .zst compresses)"));
    files.written(app.add_option("--csv", options->csv, "every signal of every tick"));
    auto* snapshot =
        app.add_option("--snapshot-at", options->snapshot_at, "copy the rig at this time [s] into this file");
    snapshot->check(obeys({0, longest_s}, false).application_index(0));
    files.written(snapshot, StandardOutput::no, 1);
    files.read(app.add_option(
        "--from", options->from,
        "go on from a snapshot: its model, scenario, ticks, kernel, buses and controller; --duration "
        "counts from the start of its run"));
    files.written(app.add_option("--can-log", options->choices.can_log,
                                 "candump log of everything on the first CAN bus"));
    files.read(app.add_option("--can-replay", options->choices.can_replay,
                              "candump log that takes the controller's place, at its own times"));
    files.written(app.add_option("--trace", options->trace, "what the loop did when, for ui.perfetto.dev"));
    options->add_controller_start_to(app);
    app.add_flag("--json", options->json, "end with one JSON object on standard output");
    return [options, &app] {
        options->files.check();
        if (!options->csv.empty() && !options->record.empty() && !keeps_what_is_written(options->record))
            throw std::invalid_argument("--csv: is made of the recording, which " + options->record +
                                        " does not keep");
        if (!options->from.empty()) refuse_what_a_snapshot_settles(app, options->choices);
        // Its frames still to come are no part of the assembly.
        if (options->snapshot_at.first >= 0 && !options->choices.can_replay.empty())
            throw std::invalid_argument("--snapshot-at: a run on --can-replay cannot go on from a snapshot");
        return run(*options);
    };
}

const Command command("run", "run the machine, its buses and its controller", declare);

}  // namespace

}  // namespace shiftrig::cli
