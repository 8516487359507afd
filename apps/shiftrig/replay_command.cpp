// shiftrig replay: a recording proven tick by tick, or asked what another machine would have done.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/shiftrig/command.h"
#include "io/recording/csv.h"
#include "io/recording/reader.h"
#include "io/recording/rebuild.h"
#include "io/recording/replay.h"

namespace shiftrig::cli {

namespace {

struct Options {
    std::string recording, model;
    double tolerance = 0;
    bool json = false;
};

double rms(const io::Deviation& d) {
    return d.count > 0 ? std::sqrt(d.sum_of_squares / static_cast<double>(d.count)) : 0;
}

double time_of(const io::Manifest& manifest, std::int64_t tick) {
    return 1e-9 * static_cast<double>((tick + 1) * manifest.tick_ns);
}

nlohmann::json to_json(const io::RecordingReader& reader, const io::ReplayResult& result, bool other_model) {
    nlohmann::json out{{"recording", reader.path()},     {"ticks", result.ticks},
                       {"compared", result.compared},    {"lost", result.lost},
                       {"agrees", result.agrees()},      {"kernel", reader.manifest().kernel},
                       {"complaint", reader.complaint()}};
    if (result.first)
        out["first_difference"] = {{"tick", result.first->tick},         {"time_s", result.first->time},
                                   {"signal", result.first->signal},     {"recorded", result.first->recorded},
                                   {"replayed", result.first->replayed}, {"damaged", result.first->damaged}};
    if (!other_model) return out;
    out["deviations"] = nlohmann::json::array();
    for (const auto& d : result.deviations)
        if (d.count > 0)
            out["deviations"].push_back({{"signal", io::column_name(d.signal)},
                                         {"worst", d.worst},
                                         {"time_s", time_of(reader.manifest(), d.worst_tick)},
                                         {"recorded", d.recorded},
                                         {"replayed", d.replayed},
                                         {"rms", rms(d)}});
    return out;
}

// Largest first, measured against what the signal ranges over: N and rad/s cannot be ranked otherwise.
void print_deviations(const io::RecordingReader& reader, std::vector<io::Deviation> deviations) {
    const auto weight = [](const io::Deviation& d) { return d.worst / std::max(1.0, std::abs(d.recorded)); };
    std::erase_if(deviations, [](const io::Deviation& d) { return d.worst == 0 || d.count == 0; });
    std::stable_sort(deviations.begin(), deviations.end(),
                     [&](const auto& a, const auto& b) { return weight(a) > weight(b); });
    if (deviations.empty()) {
        std::cout << "every output is the same to the bit\n";
        return;
    }
    std::printf("%-44s %12s %10s %14s %14s %12s\n", "signal", "largest", "at [s]", "recorded", "replayed",
                "rms");
    for (const auto& d : deviations)
        std::printf("%-44s %12.5g %10.4f %14.7g %14.7g %12.5g\n", io::column_name(d.signal).c_str(), d.worst,
                    time_of(reader.manifest(), d.worst_tick), d.recorded, d.replayed, rms(d));
}

void print(const io::RecordingReader& reader, const io::ReplayResult& result, const Options& options) {
    if (result.first) {
        const io::Difference& d = *result.first;
        std::printf("%s: tick %lld (t=%.7g s): %s: recorded %s, %s %s\n", reader.path().c_str(),
                    static_cast<long long>(d.tick), d.time, d.signal.c_str(), d.recorded.c_str(),
                    d.damaged ? "written as" : "replayed", d.replayed.c_str());
        return;
    }
    const std::string how = options.tolerance > 0 ? " within the tolerance" : " bit for bit";
    std::printf("%s: %lld ticks agree%s (kernel %s)\n", reader.path().c_str(),
                static_cast<long long>(result.compared), how.c_str(), reader.manifest().kernel.c_str());
    if (result.compared < result.ticks || result.lost > 0)
        std::printf("%lld ticks are missing in the recording; %lld could not be compared for that\n",
                    static_cast<long long>(result.lost),
                    static_cast<long long>(result.ticks - result.compared));
}

int run_on(io::RecordingReader& reader, const Options& options) {
    const bool other_model = !options.model.empty();
    io::ReplayOptions how;
    how.tolerance = options.tolerance;
    how.stop_at_first = !other_model;
    const auto model = [&] {
        if (!other_model) return io::rebuild_model(reader.manifest(), options.tolerance > 0);
        io::ModelFile file = io::read_model(options.model);
        return io::build_as_recorded(file, reader.manifest());
    }();
    const io::ReplayResult result = io::replay(reader, model, how);
    if (options.json)
        std::cout << to_json(reader, result, other_model).dump(2) << '\n';
    else if (other_model)
        print_deviations(reader, result.deviations);
    else
        print(reader, result, options);
    std::fflush(stdout);
    // A difference found is the answer; a log that cannot be read to its end is bad input.
    if (result.first && !other_model) return failed;
    if (reader.ending() != io::Ending::complete) {
        std::cerr << reader.complaint() << '\n';
        return bad_input;
    }
    return good;
}

int run(const Options& options) {
    io::RecordingReader reader(options.recording);
    try {
        return run_on(reader, options);
    } catch (const io::RecordingError& error) {
        throw io::RecordingError(options.recording + ": " + error.what());
    }
}

Command::Run declare(CLI::App& app) {
    auto options = std::make_shared<Options>();
    app.add_option("RECORDING", options->recording, "what `shiftrig run --record` wrote")->required();
    app.add_option("--tolerance", options->tolerance,
                   "agree where |replayed - recorded| <= tolerance * max(1, |recorded|); 0: bit for bit")
        ->check(CLI::NonNegativeNumber);
    app.add_option("--model", options->model,
                   "another model under the same inputs: what would it have done?");
    app.add_flag("--json", options->json, "print one JSON object");
    return [options] { return run(*options); };
}

const Command replay("replay", "a recording stepped again and compared tick by tick", declare);

}  // namespace

}  // namespace shiftrig::cli
