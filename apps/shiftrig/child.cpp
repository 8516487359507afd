#include "apps/shiftrig/child.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "io/input_error.h"

extern char** environ;

namespace shiftrig::cli {

namespace {

std::string named(const std::string& command) {
    return "controller \"" + io::one_line(command) + "\"";
}

// The program that a command begins with; empty where a shell reads something else there (quotes, variables, settings).
std::string program_of(const std::string& command) {
    const auto is_plain = [](unsigned char c) { return std::isalnum(c) || std::strchr("_./+-,@%:", c); };
    std::string word;
    std::istringstream(command) >> word;
    return std::all_of(word.begin(), word.end(), is_plain) ? word : "";
}

// Does a shell know the word, as a program in its path or as a word of its own?
bool shell_knows(std::string word) {
    std::string shell = "/bin/sh", option = "-c", text = "command -v -- \"$1\" > /dev/null";
    char* arguments[] = {shell.data(), option.data(), text.data(), shell.data(), word.data(), nullptr};
    pid_t process = -1;
    int status = 0;
    if (posix_spawn(&process, shell.c_str(), nullptr, nullptr, arguments, environ) != 0) return true;
    return waitpid(process, &status, 0) != process || !WIFEXITED(status) || WEXITSTATUS(status) == 0;
}

}  // namespace

void require_program(const std::string& command) {
    const std::string program = program_of(command);
    if (program.empty()) return;
    const auto refuse = [&](const std::string& why) {
        throw io::InputError(named(command) + " could not be started: " + why);
    };
    if (program.find('/') == std::string::npos) {
        if (!shell_knows(program)) refuse("there is no program " + program);
        return;
    }
    struct stat info = {};
    if (faccessat(AT_FDCWD, program.c_str(), X_OK, AT_EACCESS) != 0 || stat(program.c_str(), &info) != 0)
        refuse(program + ": " + std::strerror(errno));
    if (S_ISDIR(info.st_mode)) refuse(program + ": " + std::strerror(EISDIR));
}

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
    if (error != 0) throw std::runtime_error(named(command) + ": " + std::strerror(error));
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
        return named(command_) + " could not be started (status " + std::to_string(WEXITSTATUS(status)) + ")";
    const std::string how = WIFSIGNALED(status) ? "was ended by signal " + std::to_string(WTERMSIG(status))
                                                : "ended with status " + std::to_string(WEXITSTATUS(status));
    return named(command_) + " " + how;
}

std::optional<std::string> Child::ends_within(double seconds, const std::function<bool()>& given_up) {
    using Clock = std::chrono::steady_clock;
    const auto until = Clock::now() + std::chrono::duration<double>(seconds);
    constexpr std::chrono::duration<double> glance = std::chrono::milliseconds(10);
    while (Clock::now() < until && !(given_up && given_up())) {
        std::this_thread::sleep_for(std::min<std::chrono::duration<double>>(until - Clock::now(), glance));
        if (auto how = ended()) return how;
    }
    return std::nullopt;
}

}  // namespace shiftrig::cli
