// What the rig itself has to report, beside the plant's events.
#pragma once

#include <cstdint>
#include <string>

#include "io/signals.h"

namespace shiftrig::rig {

enum class RigEventKind : std::uint8_t {
    safe_command,     // the controller has been silent for too long: the safe command acts
    commands_return,  // valid commands are heard again
    message_status,   // a received message changed its status (value: the new one)
    input_set,        // the scenario set a signal
    input_requested,  // somebody outside did
    input_limited,    // a command out of its range or not a number, limited
};

struct RigEvent {
    double time = 0;  // [s]
    RigEventKind kind{};
    int signal = -1;  // in the rig's table, −1: none
    double value = 0;
};

const char* name(RigEventKind kind) noexcept;  // "safe_command"
// In words: `t=2.101 safe command: the controller is silent`.
std::string explain(const io::SignalTable& signals, const RigEvent& event);

}  // namespace shiftrig::rig
