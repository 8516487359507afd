#include "apps/rig/safe_command.h"

#include <cmath>

namespace shiftrig::rig {

SafeCommands::SafeCommands(const io::ModelFile& file, const plant::Model& model) {
    for (const auto& safe : file.controller.safe_commands) {
        const int input = model.input(safe.signal);
        if (input < 0)
            throw io::InputError(
                file.path, 0, 0,
                "safe command of clutch \"" + safe.clutch + "\": the model has no input " + safe.signal);
        ramps_.push_back({input, safe.value, std::llround(safe.within * 1e9)});
    }
}

void SafeCommands::apply(bool command_valid, std::int64_t time_ns,
                         std::span<double> inputs) SHIFTRIG_REALTIME {
    const bool begins = !command_valid && !active_;
    active_ = !command_valid;
    if (!active_) return;
    if (begins) since_ = time_ns;
    for (Ramp& ramp : ramps_) {
        double& input = inputs[static_cast<std::size_t>(ramp.input)];
        if (begins) ramp.from = input;
        const std::int64_t passed = time_ns - since_;
        input = passed >= ramp.within ? ramp.safe
                                      : ramp.from + (ramp.safe - ramp.from) * static_cast<double>(passed) /
                                                        static_cast<double>(ramp.within);
    }
}

}  // namespace shiftrig::rig
