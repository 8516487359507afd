// shiftrig: a real-time transmission controller-in-the-loop simulator. The commands are in
// *_command.cpp beside this file.
#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <iostream>

#include "apps/shiftrig/command.h"
#include "io/input_error.h"

namespace {

using namespace shiftrig;

// Where a standard stream was closed, the next file to be opened would take its number, and our words.
void occupy_standard_streams() {
    for (int number = 0; number <= STDERR_FILENO;) {
        number = open("/dev/null", O_RDONLY | O_CLOEXEC);
        if (number < 0) return;
        if (number > STDERR_FILENO) close(number);
    }
}

// Results that did not arrive are no results, whatever they were. (Bad input has been told already.)
int delivered(int code) {
    errno = 0;
    std::cout.flush();
    const bool whole = std::fflush(stdout) == 0 && std::ferror(stdout) == 0 && std::cout.good();
    if (whole || code == cli::bad_input) return code;
    std::cerr << "shiftrig: standard output cannot be written"
              << (errno != 0 ? std::string(": ") + std::strerror(errno) : "") << '\n';
    return cli::bad_input;
}

int run_program(int argc, char** argv) {
    CLI::App app{"shiftrig: a bench on which shift-control software meets a tractor", "shiftrig"};
    app.set_version_flag("--version", "shiftrig " SHIFTRIG_VERSION);
    app.require_subcommand(0, 1);  // none is answered below, a wrong one by CLI11 with its name
    // A value that breaks a rule takes one line; wrong usage is pointed to the help.
    app.failure_message([](const CLI::App* command, const CLI::Error& error) {
        const bool is_value = error.get_exit_code() == static_cast<int>(CLI::ExitCodes::ValidationError);
        const std::string line = error.what();
        const std::string help = CLI::FailureMessage::simple(command, error).substr(line.size());
        return io::one_line(line) + (is_value ? "\n" : help);
    });
    app.footer("Exit codes: 0 good, 1 the check or test failed, 2 wrong usage or bad input.");

    cli::Command::Run run;
    for (const auto& command : cli::Command::all()) {
        CLI::App* sub = app.add_subcommand(command.name, command.summary);
        sub->parse_complete_callback([&run, body = command.declare(*sub)] { run = body; });
    }

    try {
        app.parse(argc, argv);
        if (run) return run();
        std::cerr << app.help();
        return cli::bad_input;
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? cli::good : cli::bad_input;
    } catch (const io::InputError& error) {  // names its place itself
        cli::tell(error.what());
    } catch (const std::exception& error) {
        cli::tell(std::string("shiftrig: ") + error.what());
    }
    return cli::bad_input;
}

}  // namespace

int main(int argc, char** argv) {
    occupy_standard_streams();
    return delivered(run_program(argc, argv));
}
