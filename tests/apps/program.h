// Runs one of our programs and keeps what it said.
#pragma once

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace shiftrig::test {

struct Said {
    int exit_code = -1;  // −1: killed by a signal
    std::string out, err;
};

inline std::string whole(const std::filesystem::path& path) {
    std::ostringstream text;
    text << std::ifstream(path).rdbuf();
    return text.str();
}

// Runs in the folder it is called from; the arguments go in as they are, without a shell.
inline Said run_program(const std::string& program, const std::vector<std::string>& arguments) {
    char folder[] = "/tmp/shiftrig_program_XXXXXX";
    if (!::mkdtemp(folder)) throw std::runtime_error("mkdtemp");
    const std::filesystem::path out = std::filesystem::path(folder) / "out",
                                err = std::filesystem::path(folder) / "err";
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    constexpr mode_t owner = 0600;
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, out.c_str(), O_WRONLY | O_CREAT, owner);
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, err.c_str(), O_WRONLY | O_CREAT, owner);
    std::vector<char*> argv{const_cast<char*>(program.c_str())};
    for (const auto& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
    argv.push_back(nullptr);
    pid_t child = 0;
    const int failed = ::posix_spawn(&child, program.c_str(), &actions, nullptr, argv.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    if (failed != 0) throw std::runtime_error("cannot start " + program);
    int status = 0;
    ::waitpid(child, &status, 0);
    Said said{WIFEXITED(status) ? WEXITSTATUS(status) : -1, whole(out), whole(err)};
    std::filesystem::remove_all(folder);
    return said;
}

}  // namespace shiftrig::test
