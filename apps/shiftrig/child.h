// A program started beside the rig, as its controller.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>

namespace shiftrig::cli {

class Child {
  public:
    // Runs `command` by /bin/sh in a process group of its own. Throws std::runtime_error.
    explicit Child(const std::string& command);
    ~Child();  // ends it: SIGTERM, a second's patience, SIGKILL
    Child(const Child&) = delete;
    Child& operator=(const Child&) = delete;

    // Once, when it has ended by itself: how, in words.
    std::optional<std::string> ended();
    // It has ended so, because there is no such program or it is none that can be started.
    bool was_no_program() const noexcept { return no_program_; }

  private:
    std::string command_;
    pid_t process_ = -1;
    bool no_program_ = false;
};

}  // namespace shiftrig::cli
