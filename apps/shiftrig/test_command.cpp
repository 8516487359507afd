// shiftrig test: scenarios with expectations, run side by side and judged.
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <thread>

#include "analysis/expectations.h"
#include "analysis/junit.h"
#include "apps/rig/collector.h"
#include "apps/rig/session.h"
#include "apps/shiftrig/arguments.h"
#include "apps/shiftrig/child.h"
#include "apps/shiftrig/command.h"
#include "apps/shiftrig/loop_report.h"
#include "apps/shiftrig/rig_options.h"

namespace shiftrig::cli {

namespace {

struct Options : RigOptions {
    std::vector<std::string> scenarios;
    std::string junit, limits, record_folder;
    int jobs = 1;
    bool json = false;
};

// What a scenario's run came to: its verdict, and the scorecard of every shift.
struct Outcome : analysis::TestResult {
    nlohmann::json shifts = nlohmann::json::array();
    std::string outcome;  // of the loop; empty: it did not run
};

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

// What the scorecard and the expectations read: all that has to be kept of a run.
std::vector<std::string> read_signals(const rig::Rig& rig) {
    std::vector<std::string> names = analysis::scorecard_signals(rig.model().description());
    for (const auto& bound : rig.setup().scenario->expect.signals) names.push_back(bound.quantity.signal);
    return names;
}

// A scenario's file as read, or what is wrong with it.
struct Case {
    std::string path;
    std::optional<io::ScenarioFile> scenario{};
    std::string error{};
};

Case read_case(const std::string& path) {
    Case each{path};
    try {
        each.scenario = io::read_scenario(path);
    } catch (const std::exception& error) {
        each.error = error.what();
    }
    return each;
}

// Why the run, as far as it came, is none to be judged: a failure, whatever was expected.
std::vector<std::string> broken_run(const std::string& path, const rig::Session& session) {
    std::vector<std::string> why;
    if (auto reason = gave_up(session.report()); !reason.empty()) why.push_back(path + ": " + reason);
    const auto& certificate = session.certificate();
    if (!certificate.is_finite())
        why.push_back(path + ": in " + std::to_string(certificate.flagged[2]) + " of " +
                      std::to_string(certificate.ticks) + " ticks the state is not finite");
    return why;
}

// Why a recording, asked for, is not all of its run: a failure, too.
std::vector<std::string> broken_recording(const std::string& path, const io::RecordingSummary& recorded) {
    std::vector<std::string> why;
    if (!recorded.error.empty()) why.push_back(recorded.error);
    if (recorded.lost > 0)
        why.push_back(path + ": " + std::to_string(recorded.lost) +
                      " ticks were not recorded: the disk did not keep up");
    return why;
}

// What the judgement would have to do without; empty if nothing.
std::string left_out(const rig::Collector& collector) {
    if (const auto ticks = collector.ticks_left_out(); ticks > 0)
        return "the run does not fit the memory: " + std::to_string(ticks) + " ticks too many";
    if (const auto events = collector.events_left_out(); events > 0)
        return "the run's events do not fit the memory: " + std::to_string(events) + " too many";
    return "";
}

std::string recording_of(const Options& options, const std::string& scenario) {
    return options.record_folder + "/" + scenario + ".lcmlog";
}

// Longest first: the last to end should be a short one.
std::vector<std::size_t> by_duration(const std::vector<Case>& cases) {
    const auto duration = [&](std::size_t i) { return cases[i].scenario ? cases[i].scenario->duration : 0; };
    std::vector<std::size_t> order(cases.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return duration(a) > duration(b); });
    return order;
}

// The run, with a program as its controller. If that ends first there is nothing left to be tested, and the run is over: how
// it ended.
std::optional<std::string> run_with(Child& controller, rig::Session& session) {
    std::optional<std::string> ended;
    std::atomic<bool> done{false};
    std::thread watch([&] {
        for (bool last = false; !ended && !last;) {
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
            last = done;
            ended = controller.ended();
        }
        session.control().stop();
    });
    session.run();
    done = true;
    watch.join();
    const bool came_first = session.report().outcome == rt::Outcome::stopped || controller.was_no_program();
    return came_first ? ended : std::nullopt;
}

Outcome run_one(const Options& options, const analysis::Limits& limits, const Case& each) {
    Outcome result;
    result.file = result.name = each.path;
    result.error = each.error;
    if (!each.scenario) return result;
    const io::ScenarioFile& scenario = *each.scenario;
    const std::string& path = each.path;
    const auto start = Clock::now();
    try {
        result.name = scenario.name;
        result.expectations = analysis::count_expectations(scenario.expect);
        rig::Choices choices = options.choices;
        choices.lockstep = options.pacing() == rt::Pace::lockstep;
        rig::Rig rig(rig::make_setup(choices, scenario));
        const rt::LoopSettings loop = options.loop(rig.setup());
        std::optional<Child> controller;
        const auto tell_end = [&](const std::string& how) {
            if (controller->was_no_program())
                result.error = path + ": " + how;
            else
                result.failures.push_back(path + ": after " + io::in_digits(rig.sim_time()) + " s of " +
                                          io::in_digits(scenario.duration) + " s its " + how);
        };
        if (const auto command = rig::controller_command(options.choices); !command.empty()) {
            controller.emplace(command);
            if (const auto how = controller->ends_within(options.controller_start_s)) {
                result.outcome = rt::name(rt::Outcome::stopped);
                tell_end(*how);
                return result;
            }
        }

        rig::CollectorOptions keep;
        keep.only = read_signals(rig);
        keep.most_bytes = std::size_t{2} << 30;
        keep.by_the_clock = options.pacing() == rt::Pace::wall;
        rig::Collector collector(rig, loop.slots, keep);
        rig::SessionOptions session_options;
        session_options.loop = loop;
        session_options.collector = &collector;
        std::optional<io::RecordingWriter> recording;
        if (!options.record_folder.empty()) {
            recording.emplace(recording_of(options, scenario.name));
            session_options.recording = &*recording;
        }
        rig::Session session(rig, std::move(session_options));
        std::optional<std::string> ended;
        if (controller)
            ended = run_with(*controller, session);
        else
            session.run();
        result.sim_time_s = rig.sim_time();
        result.outcome = rt::name(session.report().outcome);
        result.failures = broken_run(path, session);
        if (ended) tell_end(*ended);
        if (const auto missing = left_out(collector); !missing.empty()) result.error = path + ": " + missing;
        if (result.error.empty() && result.failures.empty()) {
            const analysis::Run run = collector.finish(rig);
            const analysis::Scorecard card = analysis::score(run, limits);
            result.failures = analysis::broken_expectations(scenario, run, card);
            result.shifts = analysis::to_json(card);
            if (result.expectations == 0)
                result.failures.push_back(path + ": expects nothing, so it tests nothing");
        }
        if (recording) {
            for (auto& line : broken_recording(path, recording->end()))
                result.failures.push_back(std::move(line));
        }
    } catch (const std::exception& error) {
        result.error = error.what();
    }
    result.wall_time_s = seconds_since(start);
    return result;
}

void tell(const analysis::TestResult& result) {
    std::printf("%s %-28s %8.2f s simulated, %7.0f times real time, %d expectations\n",
                result.passed() ? "ok  " : "FAIL", result.name.c_str(), result.sim_time_s,
                result.wall_time_s > 0 ? result.sim_time_s / result.wall_time_s : 0, result.expectations);
    if (!result.error.empty()) std::printf("     %s\n", io::one_line(result.error).c_str());
    for (const auto& line : result.failures) std::printf("     %s\n", io::one_line(line).c_str());
    std::fflush(stdout);
}

nlohmann::json to_json(const std::vector<Outcome>& results, std::size_t failures) {
    nlohmann::json runs = nlohmann::json::array();
    for (const Outcome& result : results) {
        nlohmann::json run = {{"scenario", result.file},
                              {"passed", result.passed()},
                              {"expectations", result.expectations},
                              {"failures", result.failures},
                              {"sim_time_s", result.sim_time_s},
                              {"wall_time_s", result.wall_time_s},
                              {"shifts", result.shifts}};
        if (!result.outcome.empty()) run["loop"] = {{"outcome", result.outcome}};
        if (!result.error.empty()) run["error"] = result.error;
        runs.push_back(std::move(run));
    }
    return {{"failed", failures}, {"runs", std::move(runs)}};
}

// The same file under two spellings is one scenario; recordings are called by the scenario's name alone.
void check_files(const Options& options) {
    std::map<std::string, std::string> by_place, by_name;
    std::vector<NamedFile> recordings;
    for (const auto& path : options.scenarios) {
        const auto place = std::filesystem::weakly_canonical(path);
        if (!by_place.emplace(place.string(), path).second)
            throw std::invalid_argument("scenario " + path + " is given twice");
        const auto [first, is_new] = by_name.emplace(place.stem().string(), path);
        if (!is_new && !options.record_folder.empty())
            throw std::invalid_argument("--record: scenarios " + first->second + " and " + path +
                                        " would both be recorded as " + first->first + ".lcmlog");
        if (!options.record_folder.empty())
            recordings.push_back({"--record", recording_of(options, place.stem().string())});
    }
    std::vector<NamedFile> read;
    const bool writes = !options.junit.empty() || !recordings.empty();
    for (const auto& path : writes ? options.scenarios : std::vector<std::string>{}) {
        rig::Choices choices = options.choices;
        choices.scenario = path;
        try {
            for (auto& file : files_of(rig::make_setup(choices))) read.push_back(std::move(file));
        } catch (const std::exception&) {
            continue;  // told where the scenario is judged
        }
    }
    options.files.check(read, recordings);
}

int run(const Options& options) {
    if (const auto command = rig::controller_command(options.choices); !command.empty())
        require_program(command);
    check_files(options);
    const analysis::Limits limits =
        options.limits.empty() ? analysis::default_limits() : analysis::read_limits(options.limits);
    // A bus outside the process can carry one rig at a time.
    const bool alone = std::any_of(options.choices.buses.begin(), options.choices.buses.end(),
                                   [](const std::string& bus) { return bus != "inprocess"; });
    const int jobs = alone ? 1 : options.jobs;

    const bool terminal = isatty(STDERR_FILENO) != 0;
    std::vector<Case> cases;
    for (const auto& path : options.scenarios) cases.push_back(read_case(path));
    const std::vector<std::size_t> order = by_duration(cases);
    std::vector<Outcome> results(cases.size());
    std::atomic<std::size_t> next{0};
    std::size_t done = 0;
    std::mutex telling;
    const auto start = Clock::now();
    const auto work = [&] {
        for (std::size_t n; (n = next++) < order.size();) {
            const std::size_t i = order[n];
            results[i] = run_one(options, limits, cases[i]);
            const std::lock_guard lock(telling);
            ++done;
            if (terminal) std::fprintf(stderr, "\r\033[K");
            if (!options.json) tell(results[i]);
            if (terminal) std::fprintf(stderr, "%zu of %zu scenarios", done, results.size());
        }
    };
    std::vector<std::thread> workers;
    for (int i = 1; i < jobs; ++i) workers.emplace_back(work);
    work();
    for (auto& worker : workers) worker.join();
    if (terminal) std::fprintf(stderr, "\r\033[K");

    const double wall = seconds_since(start);
    double simulated = 0;
    std::size_t failures = 0;
    for (const auto& result : results) {
        simulated += result.sim_time_s;
        failures += result.passed() ? 0 : 1;
    }
    if (options.json)
        std::cout << to_json(results, failures).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)
                  << std::endl;
    else
        std::printf("%zu scenarios, %zu failed; %.1f s simulated in %.2f s, %.0f times real time\n",
                    results.size(), failures, simulated, wall, wall > 0 ? simulated / wall : 0);
    if (!options.junit.empty()) {
        std::ofstream file(options.junit);
        file << analysis::junit_xml({results.begin(), results.end()});
        file.close();
        if (!file) throw std::runtime_error(options.junit + ": cannot be written");
    }
    const bool bad =
        std::any_of(results.begin(), results.end(), [](const auto& r) { return !r.error.empty(); });
    return bad ? bad_input : failures > 0 ? failed : good;
}

Command::Run declare(CLI::App& app) {
    auto options = std::make_shared<Options>();
    options->add_common_to(app, "free");
    options->controller_start_s = 0.2;  // lockstep waits for its first answer anyway
    options->add_controller_start_to(app);
    Files& files = options->files;
    files.read(app.add_option("SCENARIO", options->scenarios, "scenario files with expectations (YAML)")
                   ->required());
    files.written(app.add_option("--junit", options->junit, "results as JUnit XML"));
    app.add_flag(
        "--json", options->json,
        "one JSON object on standard output, with the scorecard of every shift: for shiftrig compare");
    add_number(app, "--jobs", options->jobs, {1, 1024},
               "scenarios side by side; one at a time on a bus outside the process")
        ->capture_default_str();
    files.read(app.add_option("--limits", options->limits,
                              "of the scorecard (YAML); else config/limits.yaml as built in"));
    app.add_option("--record", options->record_folder,
                   "keep a recording of every scenario in this folder, called by its name")
        ->check(CLI::ExistingDirectory);
    return [options] { return run(*options); };
}

const Command command("test", "run scenarios and hold them against their expectations", declare);

}  // namespace

}  // namespace shiftrig::cli
