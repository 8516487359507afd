#include "apps/rig/snapshot.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <sstream>

#include "analysis/scorecard.h"
#include "apps/rig/choices.h"
#include "apps/rig/session.h"
#include "io/recording/rebuild.h"
#include "io/recording/snapshot.h"

namespace shiftrig::rig {

namespace {

constexpr double history_s = 1.5;  // longer than a shift takes from its beginning to its end

// Names, one a line, then an empty line, then the rows: time and one value per name.
std::vector<std::byte> pack(const analysis::Run& run, const std::vector<std::string>& names, double until) {
    std::string head;
    std::vector<const std::vector<double>*> columns;
    for (const auto& name : names)
        if (const auto* column = run.column(name)) {
            head += name + "\n";
            columns.push_back(column);
        }
    head += "\n";
    std::vector<double> rows;
    for (std::size_t i = 0; i < run.time.size(); ++i) {
        if (run.time[i] > until || run.time[i] <= until - history_s) continue;
        rows.push_back(run.time[i]);
        for (const auto* column : columns) rows.push_back((*column)[i]);
    }
    std::vector<std::byte> bytes(head.size() + rows.size() * sizeof(double));
    std::memcpy(bytes.data(), head.data(), head.size());
    if (!rows.empty()) std::memcpy(bytes.data() + head.size(), rows.data(), rows.size() * sizeof(double));
    return bytes;
}

}  // namespace

SnapshotTaker::SnapshotTaker(Rig& rig, double at_s) : at_ns_(std::llround(at_s * 1e9)) {
    io::Archive::save(rig, assembly_);
    assembly_.reserve(assembly_.size() + (std::size_t{1} << 16));  // frames under way come and go
    state_.resize(rig.state().bytes().size());
}

void SnapshotTaker::offer(Rig& rig) {
    if (taken() || rig.sim_time_ns() < at_ns_) return;
    io::Archive::save(rig, assembly_);
    const auto bytes = rig.state().bytes();
    std::copy(bytes.begin(), bytes.end(), state_.begin());
    tick_ = rig.ticks();
}

void SnapshotTaker::write(const std::string& path, const Rig& rig, const rt::LoopSettings& loop,
                          const analysis::Run& run) const {
    if (!taken()) throw io::RecordingError(path + ": not written: the run ended before the snapshot's time");
    io::Manifest manifest = manifest_of(rig, loop);
    manifest.first_tick = tick_;
    manifest.initial_state = state_;
    manifest.assembly = assembly_;
    const double at = 1e-9 * static_cast<double>(tick_ * manifest.tick_ns);
    if (rig.setup().buses.built_in) manifest.facts["calibration_text"] = rig.setup().buses.calibration_text;
    manifest.facts["folder"] = std::filesystem::current_path().string();
    manifest.history = pack(run, analysis::scorecard_signals(run.machine), at);
    io::write_snapshot(path, manifest);
}

Setup setup_of(const io::Manifest& snapshot) {
    Setup setup;
    setup.model = io::recorded_model_file(snapshot);
    if (!snapshot.scenario_text.empty())
        setup.scenario = io::parse_scenario(snapshot.scenario_text, snapshot.scenario_path);
    setup.tick_ns = snapshot.tick_ns;
    setup.substeps = snapshot.substeps;
    setup.kernel = snapshot.kernel == "portable" ? plant::KernelKind::portable
                   : snapshot.kernel == "avx2"   ? plant::KernelKind::avx2
                   : snapshot.kernel == "avx512" ? plant::KernelKind::avx512
                                                 : plant::KernelKind::automatic;
    const auto fact = [&](const char* name) {
        const auto found = snapshot.facts.find(name);
        return found == snapshot.facts.end() ? std::string() : found->second;
    };
    // What the model names beside it (CAN mapping, DBC) is looked for from where the snapshot was taken, if need be.
    if (setup.model.can.IsDefined()) {
        try {
            io::can::parse_mapping(setup.model.can, setup.model.path);
        } catch (const io::InputError&) {
            setup.model.path = (std::filesystem::path(fact("folder")) / setup.model.path).string();
        }
    }
    if (setup.scenario) follow_scenario(*setup.scenario, setup.buses);
    std::istringstream buses(fact("buses"));
    for (std::string name; buses >> name;) setup.buses.names.push_back(name);
    setup.buses.lockstep = fact("pace") == "lockstep";
    if (const std::string path = fact("calibration"); !path.empty()) {
        const std::string text = fact("calibration_text");
        if (text.empty())
            throw io::InputError(
                "the snapshot does not hold its controller's calibration: it is of an earlier version");
        build_in(setup.buses, text, path);
    }
    setup.resumes = true;
    return setup;
}

void resume(Rig& rig, const io::Manifest& snapshot) {
    io::Archive::restore(snapshot.assembly, rig);
    if (!rig.state().is_of(rig.model())) throw io::RecordingError("its state is not one of its own model's");
}

analysis::Run history_of(const io::Manifest& snapshot) {
    analysis::Run run;
    const std::string_view text(reinterpret_cast<const char*>(snapshot.history.data()),
                                snapshot.history.size());
    std::size_t at = 0;
    while (at < text.size() && text[at] != '\n') {
        const std::size_t end = text.find('\n', at);
        plant::Signal signal;
        signal.name = text.substr(at, end - at);
        run.columns.push_back({signal, {}});
        at = end == std::string_view::npos ? text.size() : end + 1;
    }
    const std::size_t row = (run.columns.size() + 1) * sizeof(double);
    for (++at; at + row <= text.size(); at += row) {
        std::vector<double> values(run.columns.size() + 1);
        std::memcpy(values.data(), text.data() + at, row);
        run.time.push_back(values[0]);
        for (std::size_t c = 0; c < run.columns.size(); ++c) run.columns[c].value.push_back(values[c + 1]);
    }
    return run;
}

}  // namespace shiftrig::rig
