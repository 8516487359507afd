#include "analysis/load_run.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <optional>

#include "io/recording/event_json.h"
#include "io/recording/event_names.h"
#include "io/recording/reader.h"
#include "io/recording/rebuild.h"

namespace shiftrig::analysis {

namespace {

struct Source {
    io::Table table;
    std::size_t index;
};

const std::vector<double>& values_of(const io::RecordedTick& tick, io::Table table) {
    return table == io::Table::inputs ? tick.inputs : table == io::Table::outputs ? tick.outputs : tick.rig;
}

// The rig's own changes, told from its signals, those of `rig.safe_command` and `bus.<message>.status`; kind and words
// as the rig has them (apps/rig/events.h).
std::optional<Change> own_change(const plant::Signal& changed, double before, double now, double time) {
    const std::string& signal = changed.name;
    static constexpr std::array statuses = {"never seen", "alive", "late", "lost", "corrupt"};
    char stamp[32];
    std::snprintf(stamp, sizeof stamp, "t=%.7g ", time);
    Change change;
    change.event.time = time;
    if (signal == "rig.safe_command" && now != before) {
        change.kind = now != 0 ? "safe_command" : "commands_return";
        change.text = stamp + std::string(now != 0 ? "the controller is silent: the safe command acts"
                                                   : "valid commands are heard again");
        return change;
    }
    if (signal.starts_with("bus.fault.") && signal.ends_with(".status") && now != before) {
        change.kind = "message_status";
        change.text = stamp + ("bus fault \"" + changed.description + "\" ") + (now != 0 ? "begins" : "ends");
        return change;
    }
    if (signal.starts_with("bus.") && signal.ends_with(".status") && now != before && now >= 0 &&
        now < statuses.size()) {
        change.kind = "message_status";
        change.text = stamp + signal + ": " + statuses[static_cast<std::size_t>(now)];
        return change;
    }
    return std::nullopt;
}

}  // namespace

Run load_run(const std::string& path, const std::vector<std::string>& signals) {
    io::RecordingReader reader(path);
    const io::Manifest& manifest = reader.manifest();
    const plant::Model model = io::rebuild_model(manifest, true);
    Run run;
    run.machine = io::recorded_model_file(manifest).description;
    run.model_text = manifest.model_text;
    if (!manifest.scenario_path.empty())
        run.identity.emplace_back("scenario", std::filesystem::path(manifest.scenario_path).stem().string());
    run.identity.emplace_back("model", run.machine.name);
    for (const auto& fact : manifest.facts) run.identity.push_back(fact);

    std::vector<Source> sources;
    const auto take = [&](io::Table table, const std::vector<plant::Signal>& all) {
        for (std::size_t i = 0; i < all.size(); ++i) {
            if (!signals.empty() && std::find(signals.begin(), signals.end(), all[i].name) == signals.end())
                continue;
            sources.push_back({table, i});
            run.columns.push_back({all[i], {}});
        }
    };
    take(io::Table::inputs, manifest.inputs);
    take(io::Table::outputs, manifest.outputs);
    take(io::Table::rig, manifest.rig);

    std::vector<double> rig_before;
    for (const auto& signal : manifest.rig) rig_before.push_back(signal.initial);
    for (io::RecordedTick tick; reader.next(tick);) {
        const double time = 1e-9 * static_cast<double>(tick.sim_time_ns);
        run.time.push_back(time);
        for (std::size_t c = 0; c < sources.size(); ++c)
            run.columns[c].value.push_back(values_of(tick, sources[c].table)[sources[c].index]);
        for (const auto& event : tick.events)
            run.changes.push_back(
                {event, event.device < 0 ? "" : manifest.devices[static_cast<std::size_t>(event.device)],
                 plant::explain(model, event), std::string(io::name(event.kind)),
                 io::loop_members(event, manifest.devices)});
        // It acts from the beginning of its tick on: inputs are held over a step.
        const double begins = 1e-9 * static_cast<double>(tick.sim_time_ns - manifest.tick_ns);
        if (tick.tick == manifest.first_tick && tick.tick > 0)
            rig_before = tick.rig;  // goes on from a snapshot
        for (std::size_t i = 0; i < tick.rig.size(); ++i)
            if (auto change = own_change(manifest.rig[i], rig_before[i], tick.rig[i], begins))
                run.changes.push_back(std::move(*change));
        rig_before = tick.rig;
    }
    std::stable_sort(run.changes.begin(), run.changes.end(),
                     [](const Change& a, const Change& b) { return a.event.time < b.event.time; });
    if (reader.ending() != io::Ending::complete)
        run.identity.emplace_back("incomplete", reader.complaint());
    else
        run.identity.emplace_back("outcome", reader.outcome().empty() ? "unknown" : reader.outcome());
    run.unfinished = reader.unfinished();
    return run;
}

}  // namespace shiftrig::analysis
