// How a command joins the program: one file `<name>_command.cpp` with one registration at its end,
//
//     const Command check("check", "what the machine is, and what is wrong with it", declare_check);
//
// where `declare_check(CLI::App&)` adds the command's options and returns what is to be run once the
// command line is parsed. That function returns the exit code; what it throws becomes one line on
// stderr and exit code bad_input.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace shiftrig::cli {

enum ExitCode : int {
    good = 0,
    failed = 1,     // the check or test failed
    bad_input = 2,  // wrong usage or bad input
};

// To standard error, in one line whatever names are in it.
void tell(const std::string& line);

struct Command {
    using Run = std::function<int()>;
    using Declare = Run (*)(CLI::App& app);

    Command(std::string name, std::string summary, Declare declare);
    static const std::vector<Command>& all();  // sorted by name

    std::string name, summary;
    Declare declare;
};

}  // namespace shiftrig::cli
