#include "apps/shiftrig/child.h"

#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstring>
#include <stdexcept>

extern char** environ;

namespace shiftrig::cli {

Child::Child(const std::string& command) : command_(command) {
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    // It hears signals, whatever its parent waits for elsewhere.
    posix_spawnattr_setflags(&attributes,
                             POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
    posix_spawnattr_setpgroup(&attributes, 0);
    sigset_t none, ends;
    sigemptyset(&none);
    sigemptyset(&ends);
    for (const int signal : {SIGINT, SIGTERM, SIGPIPE}) sigaddset(&ends, signal);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setsigdefault(&attributes, &ends);
    std::string shell = "/bin/sh", option = "-c", text = command;
    char* arguments[] = {shell.data(), option.data(), text.data(), nullptr};
    const int error = posix_spawn(&process_, shell.c_str(), nullptr, &attributes, arguments, environ);
    posix_spawnattr_destroy(&attributes);
    if (error != 0) throw std::runtime_error("controller \"" + command + "\": " + std::strerror(error));
}

Child::~Child() {
    if (process_ < 0) return;
    kill(-process_, SIGTERM);
    for (int i = 0; i < 100; ++i) {
        if (waitpid(process_, nullptr, WNOHANG) != 0) {
            kill(-process_, SIGKILL);  // what it may have started itself
            return;
        }
        usleep(10'000);
    }
    kill(-process_, SIGKILL);
    waitpid(process_, nullptr, 0);
}

std::optional<std::string> Child::ended() {
    if (process_ < 0) return std::nullopt;
    int status = 0;
    if (waitpid(process_, &status, WNOHANG) <= 0) return std::nullopt;
    process_ = -1;
    constexpr int not_executable = 126,
                  not_found = 127;  // what a shell ends with [POSIX, Exit Status for Commands]
    no_program_ =
        WIFEXITED(status) && (WEXITSTATUS(status) == not_executable || WEXITSTATUS(status) == not_found);
    if (no_program_)
        return "controller \"" + command_ + "\" could not be started (status " +
               std::to_string(WEXITSTATUS(status)) + ")";
    const std::string how = WIFSIGNALED(status) ? "was ended by signal " + std::to_string(WTERMSIG(status))
                                                : "ended with status " + std::to_string(WEXITSTATUS(status));
    return "controller \"" + command_ + "\" " + how;
}

}  // namespace shiftrig::cli
