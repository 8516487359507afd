#include "apps/rig/events.h"

#include <array>
#include <cstdio>

namespace shiftrig::rig {

const char* name(RigEventKind kind) noexcept {
    switch (kind) {
        case RigEventKind::safe_command:
            return "safe_command";
        case RigEventKind::commands_return:
            return "commands_return";
        case RigEventKind::message_status:
            return "message_status";
        case RigEventKind::input_set:
            return "input_set";
        case RigEventKind::input_requested:
            return "input_requested";
        case RigEventKind::input_limited:
            return "input_limited";
    }
    return "unknown";
}

std::string explain(const io::SignalTable& signals, const RigEvent& event) {
    static constexpr std::array statuses = {"never seen", "alive", "late", "lost", "corrupt"};
    const std::string signal = event.signal >= 0 ? signals.signal(event.signal).name : "";
    char number[32], time[32];
    std::snprintf(number, sizeof number, "%.6g", event.value);
    std::snprintf(time, sizeof time, "t=%.7g ", event.time);
    switch (event.kind) {
        case RigEventKind::safe_command:
            return time + std::string("the controller is silent: the safe command acts");
        case RigEventKind::commands_return:
            return time + std::string("valid commands are heard again");
        case RigEventKind::message_status: {
            if (signal.starts_with("bus.fault."))
                return std::string(time) + "bus fault \"" + signals.signal(event.signal).description + "\" " +
                       (event.value != 0 ? "begins" : "ends");
            const auto status = static_cast<std::size_t>(event.value);
            return time + signal + ": " + (status < statuses.size() ? statuses[status] : "unknown");
        }
        case RigEventKind::input_set:
            return time + signal + " is set to " + number;
        case RigEventKind::input_requested:
            return time + signal + " is requested to be " + number;
        case RigEventKind::input_limited:
            return time + signal + " = " + number + " is limited to its range";
    }
    return time;
}

}  // namespace shiftrig::rig
