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

  private:
    std::string command_;
    pid_t process_ = -1;
};

}  // namespace shiftrig::cli
