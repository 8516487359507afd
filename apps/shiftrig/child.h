// A program started beside the rig, as its controller.
#pragma once

#include <sys/types.h>

#include <functional>
#include <optional>
#include <string>

namespace shiftrig::cli {

// Throws InputError if `command` begins with what is no program: nothing of that name is there, or it may not be executed. What a
// shell has to make something of first (quotes, variables, settings) is let through; was_no_program() tells later.
void require_program(const std::string& command);

class Child {
  public:
    // Runs `command` by /bin/sh in a process group of its own. Throws std::runtime_error.
    explicit Child(const std::string& command);
    ~Child();  // ends it: SIGTERM, a second's patience, SIGKILL
    Child(const Child&) = delete;
    Child& operator=(const Child&) = delete;

    // Once, when it has ended by itself: how, in words, in one line.
    std::optional<std::string> ended();
    // The same, waited for so many seconds, or until `given_up` holds.
    std::optional<std::string> ends_within(double seconds, const std::function<bool()>& given_up = {});
    // It has ended so, because there is no such program or it is none that can be started.
    bool was_no_program() const noexcept { return no_program_; }

  private:
    std::string command_;
    pid_t process_ = -1;
    bool no_program_ = false;
};

}  // namespace shiftrig::cli
