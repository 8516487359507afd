// What happens when the controller falls silent: every clutch goes to its configured safe command within its
// configured time, and stays there until valid commands are heard again.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "io/archive.h"
#include "io/model_file.h"
#include "plant/plant.h"

namespace shiftrig::rig {

class SafeCommands {
  public:
    SafeCommands() = default;
    // Throws InputError if a configured signal is not an input of the model.
    SafeCommands(const io::ModelFile& file, const plant::Model& model);

    // Once a tick, on the inputs about to be applied.
    void apply(bool command_valid, std::int64_t time_ns, std::span<double> inputs) SHIFTRIG_REALTIME;
    bool active() const noexcept { return active_; }
    void archive(io::Archive& a) { a(ramps_, active_, since_); }

  private:
    struct Ramp {
        int input;
        double safe;          // [the input's unit]
        std::int64_t within;  // [ns]
        double from = 0;      // when the command was lost
    };
    std::vector<Ramp> ramps_;
    bool active_ = false;
    std::int64_t since_ = 0;  // [ns]
};

}  // namespace shiftrig::rig
