// What ends a run as if its time were over, with everything kept: SIGINT, SIGTERM and the end of the terminal, unless
// nohup has the program outlive that.
#pragma once

#include <csignal>
#include <vector>

namespace shiftrig::cli {

inline std::vector<int> ending_signals() {
    struct sigaction at_hang_up = {};
    const bool outlives_terminal =
        sigaction(SIGHUP, nullptr, &at_hang_up) == 0 && at_hang_up.sa_handler == SIG_IGN;
    return outlives_terminal ? std::vector{SIGINT, SIGTERM} : std::vector{SIGINT, SIGTERM, SIGHUP};
}

}  // namespace shiftrig::cli
