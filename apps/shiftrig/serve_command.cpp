// shiftrig serve: the rig with its live dashboard.
#include <atomic>
#include <chrono>
#include <csignal>
#include <iostream>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "apps/serve/dashboard.h"
#include "apps/shiftrig/arguments.h"
#include "apps/shiftrig/child.h"
#include "apps/shiftrig/command.h"
#include "apps/shiftrig/ending_signals.h"
#include "apps/shiftrig/loop_report.h"
#include "apps/shiftrig/rig_options.h"

namespace shiftrig::cli {

namespace {

struct Options : RigOptions {
    serve::HttpOptions http;
    std::string record;
};

sigset_t set_of(const std::vector<int>& signals) {
    sigset_t set;
    sigemptyset(&set);
    for (const int signal : signals) sigaddset(&set, signal);
    return set;
}

// The ending signals, blocked everywhere else, are waited for by a thread of their own, so that ending needs nothing
// signal-safe.
class SignalsStop {
  public:
    explicit SignalsStop(serve::Dashboard& dashboard)
        : thread_([&dashboard] {
              const sigset_t ends = set_of(ending_signals());
              int which = 0;
              sigwait(&ends, &which);
              dashboard.stop();
          }) {}
    ~SignalsStop() {  // the dashboard may go: nobody calls it any more
        pthread_kill(thread_.native_handle(), SIGTERM);
        thread_.join();
    }

  private:
    std::thread thread_;
};

int run(const Options& options) {
    const std::string controller_command = rig::controller_command(options.choices);
    if (!controller_command.empty()) require_program(controller_command);
    const sigset_t ends = set_of(ending_signals());
    pthread_sigmask(SIG_BLOCK, &ends, nullptr);

    rig::Choices choices = options.choices;
    choices.lockstep = options.pacing() == rt::Pace::lockstep;
    rig::Setup setup = rig::make_setup(choices);
    options.check_files(setup);
    rig::Rig rig(std::move(setup));
    for (const auto& warning : rig.buses().warnings()) std::cerr << warning << '\n';
    pthread_sigmask(SIG_UNBLOCK, &ends, nullptr);  // nothing is lost yet: a signal may end it as usual
    rehearse(options, rig);
    pthread_sigmask(SIG_BLOCK, &ends, nullptr);

    serve::DashboardOptions dashboard_options;
    dashboard_options.http = options.http;
    dashboard_options.loop = options.loop(rig.setup());
    dashboard_options.record_path = options.record.empty() ? "shiftrig.lcmlog" : options.record;
    dashboard_options.record_at_once = !options.record.empty();
    serve::Dashboard dashboard(rig, dashboard_options);
    std::cout << "dashboard: " << dashboard.url() << std::endl;

    std::optional<Child> controller;
    if (!controller_command.empty()) controller.emplace(controller_command);

    rt::AwakeProcessors awake;
    rt::Refusals refusals = prepare_process(options, awake);
    rt::LoopReport report;
    std::atomic<bool> done{false};
    {
        const SignalsStop signals_stop(dashboard);
        std::thread plant([&] {
            for (auto& refusal : prepare_thread(options)) refusals.push_back(std::move(refusal));
            report = dashboard.run();
            done = true;
        });
        while (!done) {  // as in `run` the machine goes on without its controller
            std::this_thread::sleep_for(std::chrono::milliseconds(20));
            if (!controller) continue;
            if (const auto how = controller->ended()) dashboard.tell_trouble(*how);
        }
        plant.join();
    }
    const bool controlled = !controller || !controller->was_no_program();
    controller.reset();
    for (const auto& refusal : refusals)
        std::cerr << "this machine does not grant " << rt::to_string(refusal) << '\n';
    for (const auto& line : rig.buses().summary()) std::cerr << line << '\n';
    std::cout << describe(report);
    return gave_up(report).empty() && dashboard.sound() && controlled ? good : failed;
}

Command::Run declare(CLI::App& app) {
    auto options = std::make_shared<Options>();
    options->add_to(app);
    app.add_option("--address", options->http.address, "to listen on; any but loopback needs a --token")
        ->capture_default_str();
    add_number(app, "--port", options->http.port, {0, 65535}, "0: any free one")->capture_default_str();
    app.add_option("--token", options->http.token, "that every request must carry (?token=…)");
    options->files.written(app.add_option(
        "--record", options->record,
        "record from the start, to this file; after a change from the page the next ones go to FILE-2, "
        "FILE-3, …"));
    return [options] {
        options->files.check();
        return run(*options);
    };
}

const Command command("serve", "the rig with its live dashboard on 127.0.0.1", declare);

}  // namespace

}  // namespace shiftrig::cli
