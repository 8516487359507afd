#include "apps/shiftrig/command.h"

#include <algorithm>
#include <iostream>

#include "io/input_error.h"

namespace shiftrig::cli {

namespace {

// A function-local static: commands register themselves before main, in no known order.
std::vector<Command>& registry() {
    static std::vector<Command> commands;
    return commands;
}

}  // namespace

void tell(const std::string& line) {
    std::cerr << io::one_line(line) << '\n';
}

Command::Command(std::string name_, std::string summary_, Declare declare_)
    : name(std::move(name_)), summary(std::move(summary_)), declare(declare_) {
    auto& commands = registry();
    const auto place = std::find_if(commands.begin(), commands.end(),
                                    [this](const Command& other) { return other.name > name; });
    commands.insert(place, *this);
}

const std::vector<Command>& Command::all() {
    return registry();
}

}  // namespace shiftrig::cli
