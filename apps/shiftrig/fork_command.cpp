// shiftrig fork: what if? Many branches from one snapshot, ranked.
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>

#include "apps/rig/fork.h"
#include "apps/shiftrig/arguments.h"
#include "apps/shiftrig/command.h"
#include "io/recording/snapshot.h"

namespace shiftrig::cli {

namespace {

struct Options {
    std::string snapshot;
    std::vector<std::string> vary;
    std::int64_t branches = 100;
    std::uint64_t seed = 1;
    rig::ForkOptions fork;
    int top = 10;
    bool json = false;
};

nlohmann::json to_json(const rig::Branch& branch, const rig::Plan& plan) {
    nlohmann::json out{{"branch", branch.number},
                       {"shifted", branch.shifted},
                       {"completed", branch.completed},
                       {"verdict", analysis::name(branch.verdict)},
                       {"burden", branch.burden}};
    for (std::size_t i = 0; i < branch.values.size(); ++i)
        out["values"][full_name(plan.variations()[i])] = branch.values[i];
    for (const auto& metric : branch.metrics)
        out["metrics"][metric.full_name()] = metric.value ? nlohmann::json(*metric.value) : nlohmann::json();
    if (!branch.error.empty()) out["error"] = branch.error;
    return out;
}

double metric_of(const rig::Branch& branch, const std::string& name) {
    for (const auto& metric : branch.metrics)
        if (metric.full_name() == name && metric.value) return *metric.value;
    return std::numeric_limits<double>::quiet_NaN();
}

void print_row(std::size_t rank, const rig::Branch& branch) {
    std::printf("%6zu %8lld  %-9s %-11s %8.4f %10.4g %10.4g ", rank, static_cast<long long>(branch.number),
                branch.completed ? "completed"
                : branch.shifted ? "failed"
                                 : "none",
                std::string(analysis::name(branch.verdict)).c_str(), branch.burden,
                metric_of(branch, "duration_s"), metric_of(branch, "peak_acceleration_change_m_s2"));
    for (const double value : branch.values) std::printf(" %.6g", value);
    std::printf("%s\n", branch.error.empty() ? "" : ("  " + branch.error).c_str());
}

void print(const std::vector<rig::Branch>& branches, const rig::Plan& plan, int top) {
    std::printf("%6s %8s  %-9s %-11s %8s %10s %10s ", "rank", "branch", "shift", "verdict", "burden",
                "duration", "accel");
    for (const auto& v : plan.variations())
        std::printf(" %s%s", full_name(v).c_str(), v.relative ? " (factor)" : "");
    std::printf("\n");
    const auto count = static_cast<std::size_t>(top);
    for (std::size_t i = 0; i < branches.size(); ++i) {
        if (i >= count && i + 3 < branches.size()) continue;
        if (i + 3 == branches.size() && i > count) std::printf("   …\n");
        print_row(i + 1, branches[i]);
    }
    const auto completed =
        std::count_if(branches.begin(), branches.end(), [](const auto& b) { return b.completed; });
    std::printf("%zu branches, %lld shifts completed\n", branches.size(), static_cast<long long>(completed));
}

// Branches that could not run are part of the answer, unless nothing else is.
int exit_code(const std::vector<rig::Branch>& branches) {
    const auto refused =
        std::count_if(branches.begin(), branches.end(), [](const auto& b) { return b.refused; });
    const auto ran =
        std::count_if(branches.begin(), branches.end(), [](const auto& b) { return b.error.empty(); });
    const auto all = static_cast<std::ptrdiff_t>(branches.size());
    if (refused > 0) std::cerr << "refused: " << refused << " of " << all << " branches\n";
    if (ran + refused < all)
        std::cerr << "not finite: " << all - ran - refused << " of " << all << " branches\n";
    if (ran > 0) return good;
    return refused == all ? bad_input : failed;
}

int run(const Options& options) {
    const io::Manifest snapshot = io::read_snapshot(options.snapshot);
    std::vector<rig::Variation> variations;
    for (const auto& text : options.vary) variations.push_back(rig::parse_variation(text));
    const rig::Plan plan(std::move(variations), options.branches, options.seed);

    std::atomic<std::int64_t> done{0};
    std::atomic<bool> ended{false};
    std::thread progress([&] {
        if (!isatty(STDERR_FILENO)) return;
        while (!ended) {
            std::fprintf(stderr, "\r%lld of %lld branches", static_cast<long long>(done),
                         static_cast<long long>(plan.branches()));
            std::this_thread::sleep_for(std::chrono::milliseconds(200));
        }
        std::fprintf(stderr, "\r\033[K");
    });
    const auto began = std::chrono::steady_clock::now();
    std::vector<rig::Branch> branches;
    std::exception_ptr failure;
    try {
        branches = rig::fork(snapshot, plan, options.fork, done);
    } catch (...) {
        failure = std::current_exception();
    }
    ended = true;
    progress.join();
    if (failure) std::rethrow_exception(failure);
    const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();

    if (options.json) {
        nlohmann::json out = nlohmann::json::array();
        for (const auto& branch : branches) out.push_back(to_json(branch, plan));
        std::cout << out.dump(1) << '\n';
    } else {
        print(branches, plan, options.top);
    }
    std::cerr << wall << " s, " << static_cast<double>(plan.branches()) / wall << " branches/s\n";
    return exit_code(branches);
}

Command::Run declare(CLI::App& app) {
    auto options = std::make_shared<Options>();
    app.add_option("SNAPSHOT", options->snapshot, "what `shiftrig run --snapshot-at T FILE` wrote")
        ->required();
    app.add_option("--vary", options->vary,
                   "SIGNAL, calibration.KEY or model.KEY, and what it shall be: NAME=A,B,C | "
                   "NAME=LOW:HIGH[:COUNT] | NAME=+-P%; repeatable")
        ->required()
        ->take_all();
    constexpr double most_branches = 10'000'000, most_threads = 1024;
    add_number(app, "--branches", options->branches, {1, most_branches},
               "how many, where something is drawn at random")
        ->capture_default_str();
    add_number(app, "--seed", options->seed, {0, 1e18}, "of what is drawn at random")->capture_default_str();
    add_number(app, "--duration", options->fork.duration, {0, 3600, true}, "simulated seconds of each")
        ->capture_default_str();
    add_number(app, "--threads", options->fork.threads, {0, most_threads},
               "0: as many as there are processors")
        ->capture_default_str();
    add_number(app, "--top", options->top, {1, most_branches}, "how many of the best to print")
        ->capture_default_str();
    app.add_flag("--json", options->json, "all of them, best first, as one JSON array");
    return [options] { return run(*options); };
}

const Command fork_command("fork", "branches from a snapshot, ranked by the scorecard", declare);

}  // namespace

}  // namespace shiftrig::cli
