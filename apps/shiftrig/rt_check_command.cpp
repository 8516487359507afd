// shiftrig rt-check: what this machine offers a real-time loop, what to change, and a short measurement.
#include <iostream>
#include <memory>
#include <thread>

#include "apps/shiftrig/arguments.h"
#include "apps/shiftrig/command.h"
#include "apps/shiftrig/loop_report.h"
#include "rt/loop.h"
#include "rt/machine.h"
#include "rt/thread.h"

namespace shiftrig::cli {

namespace {

struct Options {
    double rate_hz = 1000;
    double duration_s = 2;
    int priority = 80;
    std::vector<int> processors;
    bool measure = true;
    bool json = false;
};

struct Measurement {
    rt::Refusals refusals;
    rt::LoopReport report;
};

// The empty loop in a thread of its own, set up as the rig's plant thread is.
Measurement measure(const Options& options) {
    Measurement result;
    result.refusals = rt::set_up_memory({});
    rt::AwakeProcessors awake;
    for (rt::Refusal& refusal : awake.hold()) result.refusals.push_back(std::move(refusal));
    rt::LoopSettings settings;
    settings.period = std::llround(1e9 / options.rate_hz);
    settings.slots = std::llround(options.duration_s * options.rate_hz);
    auto loop = std::make_unique<rt::Loop<>>(settings);
    std::thread thread([&] {
        rt::ThreadSettings request;
        request.fifo_priority = options.priority;
        request.processors = options.processors;
        for (rt::Refusal& refusal : rt::set_up_thread(request)) result.refusals.push_back(std::move(refusal));
        loop->run([](const rt::Tick&) SHIFTRIG_REALTIME {});
    });
    thread.join();
    result.report = loop->report();
    return result;
}

const char* mark(rt::Verdict verdict) {
    switch (verdict) {
        case rt::Verdict::good:
            return "good";
        case rt::Verdict::warning:
            return "WARN";
        case rt::Verdict::unknown:
            return "?   ";
    }
    return "";
}

void print(const std::vector<rt::Finding>& findings) {
    std::cout << rt::describe_machine() << "\n\n";
    for (const rt::Finding& finding : findings) {
        std::cout << mark(finding.verdict) << "  " << finding.subject
                  << std::string(24 - std::min<std::size_t>(23, finding.subject.size()), ' ') << finding.found
                  << '\n';
        if (!finding.advice.empty()) std::cout << "        → " << finding.advice << '\n';
    }
}

void print(const Measurement& measurement, const Options& options) {
    std::cout << "\nAn empty loop at " << options.rate_hz << " Hz for " << options.duration_s << " s\n";
    for (const rt::Refusal& refusal : measurement.refusals)
        std::cout << "refused   " << rt::to_string(refusal) << '\n';
    std::cout << describe(measurement.report)
              << "\nHow late each slot began (time, count, logarithmic bar):\n"
              << measurement.report.lateness.picture();
}

int run(const Options& options) {
    const std::vector<rt::Finding> findings = rt::examine_machine();
    if (options.json) {
        nlohmann::json out{{"machine", rt::describe_machine()}, {"findings", nlohmann::json::array()}};
        for (const rt::Finding& finding : findings) {
            const char* verdict = finding.verdict == rt::Verdict::good      ? "good"
                                  : finding.verdict == rt::Verdict::warning ? "warning"
                                                                            : "unknown";
            out["findings"].push_back({{"subject", finding.subject},
                                       {"verdict", verdict},
                                       {"found", finding.found},
                                       {"advice", finding.advice}});
        }
        if (options.measure) {
            const Measurement measurement = measure(options);
            out["refusals"] = to_json(measurement.refusals);
            out["loop"] = to_json(measurement.report);
        }
        std::cout << out.dump(2) << '\n';
        return good;
    }
    print(findings);
    if (options.measure) print(measure(options), options);
    return good;
}

Command::Run declare(CLI::App& app) {
    auto options = std::make_shared<Options>();
    add_number(app, "--rate-hz", options->rate_hz, {1, 1e5}, "rate of the measured loop")
        ->capture_default_str();
    add_number(app, "--duration", options->duration_s, {0.01, 86'400}, "how long to measure [s]")
        ->capture_default_str();
    add_number(app, "--priority", options->priority, {0, 99}, "FIFO priority, 0: none")
        ->capture_default_str();
    add_number(app, "--cpu,--processor", options->processors, {0, rt::most_processors - 1},
               "processors the loop may run on");
    app.add_flag("!--no-measurement", options->measure, "only examine");
    app.add_flag("--json", options->json, "for programs");
    return [options] { return run(*options); };
}

const Command rt_check("rt-check", "what this machine offers a real-time loop, and what to change", declare);

}  // namespace

}  // namespace shiftrig::cli
