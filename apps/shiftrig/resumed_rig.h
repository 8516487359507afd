// run --from: a rig that goes on from a snapshot. What it is was settled when the snapshot was taken; what the run
// writes, who is started beside it, its pace and its end are this run's.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "apps/rig/rig.h"
#include "apps/shiftrig/rig_options.h"

namespace shiftrig::cli {

// Options that the snapshot has settled would be ignored: throws std::invalid_argument if one is given.
void refuse_what_a_snapshot_settles(const CLI::App& app, const rig::Choices& choices);

// Throws also where nothing is left to run.
std::unique_ptr<rig::Rig> resumed_rig(const std::string& from, const RigOptions& options);

}  // namespace shiftrig::cli
