// The options of every command that runs a rig, in one place.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/rig/choices.h"
#include "apps/shiftrig/files.h"
#include "rt/loop.h"
#include "rt/thread.h"

namespace shiftrig::cli {

// What a model, and what a rig is made of, reads from disk. Throws InputError where the CAN mapping cannot be read.
std::vector<NamedFile> files_of(const io::ModelFile& model);
std::vector<NamedFile> files_of(const rig::Setup& setup);

struct RigOptions {
    rig::Choices choices;
    Files files;
    std::string pace = "wall";         // wall, lockstep, free
    double factor = 1;                 // simulated per wall time
    std::optional<double> duration_s;  // else the scenario's, else without end
    std::int64_t catch_up = 100;       // [ticks]
    std::string overrun = "skip";      // skip, abort
    std::int64_t late_limit = 0;       // [ticks in a row]; 0: none
    std::string when_late = "record";  // record, skip, abort
    double answer_timeout_s = 1;       // lockstep
    double controller_start_s = 1;     // of a command given as --controller, for those that give it time
    int priority = 80;                 // FIFO; 0: none
    std::vector<int> processors;
    std::int64_t rehearsal = 60'000;  // [ticks] at most; 0: none

    void add_to(CLI::App& app);
    // Everything but MODEL, --scenario and --duration, for commands that bring those themselves.
    void add_common_to(CLI::App& app, const std::string& usual_pace = "wall");
    // Only where a command that is started as the controller is waited for; what was chosen before is the default.
    void add_controller_start_to(CLI::App& app);
    // Of the loop of a rig built from `choices`.
    rt::LoopSettings loop(const rig::Setup& setup) const;
    // Once it is known what the rig's files name themselves: nothing that is written is one of those either.
    void check_files(const rig::Setup& setup) const;
    rt::Pace pacing() const;
};

// Before a wall-paced loop: see apps/rig/rehearsal.h. Nothing in other paces.
void rehearse(const RigOptions& options, rig::Rig& rig);

// What a wall-paced loop asks of the machine, for the process and for the calling thread. Nothing in other paces.
rt::Refusals prepare_process(const RigOptions& options, rt::AwakeProcessors& awake);
rt::Refusals prepare_thread(const RigOptions& options);

}  // namespace shiftrig::cli
