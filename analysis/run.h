// A run in memory: one column per signal, one row per tick, and what changed its state. Recordings are loaded into
// it, the rig fills it directly where nothing is written to disk; every judgement of a run starts from here.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "plant/plant.h"
#include "plant/signal.h"

namespace shiftrig::analysis {

struct Column {
    plant::Signal signal;       // name and unit
    std::vector<double> value;  // one per tick, in signal.unit
};

struct Change {
    plant::Event event;
    std::string device;                  // "F2"; empty: of the machine as a whole, or the rig's own
    std::string text;                    // plant::explain(), or the rig's words
    std::string kind{};                  // "lock", "safe_command": as scenarios name it
    std::vector<std::string> members{};  // of a tie-up: who shares the load

    // Else it is the rig's own.
    bool of_machine() const { return !device.empty() || kind == "untold"; }
};

struct Run {
    std::vector<double> time;  // [s], rising, one per tick
    std::vector<Column> columns;
    std::vector<Change> changes;
    plant::Description machine;

    // Why it did not come to its end, though its recording is whole (it was stopped, or gave up): one line; empty if it did,
    // or nothing says so.
    std::string unfinished;

    // Identity for reports: "scenario" → "plough_upshift", "kernel" → "avx2", "build" → …
    std::vector<std::pair<std::string, std::string>> identity;
    std::string model_text;

    // Why it is not the whole run (its recording is cut or damaged): one line; empty if it is.
    std::string incomplete() const { return identified("incomplete"); }
    // Of a whole recording: "completed", "stopped", …; "unknown" where it is of a version that did not say.
    std::string outcome() const { return identified("outcome"); }
    // What identity says of it; empty if nothing.
    std::string identified(std::string_view what) const {
        for (const auto& [key, text] : identity)
            if (key == what) return text;
        return "";
    }

    // nullptr if the run has no such signal.
    const std::vector<double>* column(std::string_view name) const noexcept {
        for (const auto& candidate : columns)
            if (candidate.signal.name == name) return &candidate.value;
        return nullptr;
    }
};

}  // namespace shiftrig::analysis
