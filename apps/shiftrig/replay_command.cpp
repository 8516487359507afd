// shiftrig replay: a recording proven tick by tick, or asked what another machine would have done.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "apps/shiftrig/arguments.h"
#include "apps/shiftrig/command.h"
#include "io/nearest.h"
#include "io/recording/candump.h"
#include "io/recording/csv.h"
#include "io/recording/field.h"
#include "io/recording/reader.h"
#include "io/recording/rebuild.h"
#include "io/recording/replay.h"
#include "io/signals.h"
#include "io/units.h"

namespace shiftrig::cli {

namespace {

struct Options {
    std::string recording, model;
    double tolerance = 0;
    // Of a field recording only.
    std::vector<std::string> locked, options, held;
    double step_s = 1e-3;
    std::vector<const CLI::Option*> of_fields;  // the options that set these
    bool json = false;
};

double rms(const io::Deviation& d) {
    return d.count > 0 ? std::sqrt(d.sum_of_squares / static_cast<double>(d.count)) : 0;
}

double time_of(const io::Manifest& manifest, std::int64_t tick) {
    return 1e-9 * static_cast<double>((tick + 1) * manifest.tick_ns);
}

// What the solver says of itself (how well a step closed, how it got there) is no difference of two machines.
bool is_of_the_machine(const plant::Signal& signal) {
    return !signal.name.starts_with("certificate.") && signal.name != "energy.defect";
}

nlohmann::json to_json(const io::RecordingReader& reader, const io::ReplayResult& result, bool other_model) {
    nlohmann::json out{{"recording", reader.path()},     {"ticks", result.ticks},
                       {"compared", result.compared},    {"lost", result.lost},
                       {"agrees", result.agrees()},      {"kernel", reader.manifest().kernel},
                       {"complaint", reader.complaint()}};
    out["outcome"] = reader.outcome().empty() ? nlohmann::json() : nlohmann::json(reader.outcome());
    if (result.first)
        out["first_difference"] = {{"tick", result.first->tick},         {"time_s", result.first->time},
                                   {"signal", result.first->signal},     {"recorded", result.first->recorded},
                                   {"replayed", result.first->replayed}, {"damaged", result.first->damaged}};
    if (!other_model) return out;
    out["deviations"] = nlohmann::json::array();
    for (const auto& d : result.deviations)
        if (d.count > 0 && is_of_the_machine(d.signal))
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
    std::erase_if(deviations, [](const io::Deviation& d) {
        return d.worst == 0 || d.count == 0 || !is_of_the_machine(d.signal);
    });
    std::stable_sort(deviations.begin(), deviations.end(),
                     [&](const auto& a, const auto& b) { return weight(a) > weight(b); });
    if (deviations.empty()) {
        std::cout << "every output of the machine is the same to the bit\n";
        return;
    }
    std::printf("%-44s %12s %10s %14s %14s %12s\n", "signal", "largest", "at [s]", "recorded", "replayed",
                "rms");
    for (const auto& d : deviations)
        std::printf("%-44s %12.5g %10.4f %14.7g %14.7g %12.5g\n", io::column_name(d.signal).c_str(), d.worst,
                    time_of(reader.manifest(), d.worst_tick), d.recorded, d.replayed, rms(d));
}

void print(const io::RecordingReader& reader, const io::ReplayResult& result, const Options& options) {
    const std::string path = io::one_line(reader.path());
    if (result.first) {
        const io::Difference& d = *result.first;
        std::printf("%s: tick %lld (t=%.7g s): %s: recorded %s, %s %s\n", path.c_str(),
                    static_cast<long long>(d.tick), d.time, d.signal.c_str(), d.recorded.c_str(),
                    d.damaged ? "written as" : "replayed", d.replayed.c_str());
        return;
    }
    const std::string how = options.tolerance > 0 ? " within the tolerance" : " bit for bit";
    std::printf("%s: %lld ticks agree%s (kernel %s)\n", path.c_str(), static_cast<long long>(result.compared),
                how.c_str(), reader.manifest().kernel.c_str());
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
        tell(reader.complaint());
        return bad_input;
    }
    if (const std::string line = reader.unfinished(); !line.empty()) tell(line);
    return result.agrees() || other_model ? good : failed;
}

// Data of a real machine: a table, or the log of its bus as the model's stanza `can:` understands it.
io::FieldRecording read_field(const Options& options, const io::ModelFile& file) {
    if (!io::looks_like_candump(options.recording)) return io::read_field_csv(options.recording);
    if (!file.can.IsDefined())
        throw io::InputError(options.model, 0, 0, "has no stanza `can:`, which says what the frames mean");
    return io::read_field_candump(options.recording, io::can::parse_mapping(file.can, file.path));
}

// An input that nobody measured: `environment.draft=1`.
void hold_input(const std::string& held, const plant::Model& model, io::FieldRecording& recording) {
    const auto [name, value] = named_number("--hold", held);
    io::FieldColumn column = io::field_column(name);
    const auto refuse = [&, name = name](const std::string& what) {
        throw std::invalid_argument("--hold " + name + what);
    };
    const int input = model.input(column.signal);
    if (input < 0) {
        std::vector<std::string> known;
        for (const auto& signal : model.inputs()) known.push_back(signal.name);
        refuse(" is no input of the model" + io::nearest_hint(column.signal, known));
    }
    const plant::Signal& signal = model.inputs()[static_cast<std::size_t>(input)];
    if (column.unit != signal.unit)
        refuse(" must be written with its unit: " + signal.name + " ends in " + io::suffixes_of(signal.unit));
    if (!io::rule_of(signal).holds(value * column.factor))
        refuse(" = " + io::in_digits(value) + "; " + io::rule_of(signal, column.factor).words());
    for (const auto& measured : recording.columns)
        if (measured.signal == column.signal) refuse(": the recording or another --hold has it already");
    column.value.assign(recording.time.size(), value * column.factor);
    recording.columns.push_back(std::move(column));
}

// A real machine's data against the model: how well do they fit?
int run_field(const Options& options) {
    if (options.model.empty()) throw io::InputError(options.recording + ": a field recording needs --model");
    io::ModelFile file = io::read_model(options.model);
    io::FieldRecording recording = read_field(options, file);
    for (const auto& text : options.options) {
        const auto [gear, option] = named_word("--option", text);
        select_option(file, gear, option);
    }
    plant::BuildOptions build;
    build.step_size = options.step_s;
    const plant::Model model = io::build_model(file, build);
    for (const auto& held : options.held) hold_input(held, model, recording);
    const io::FieldFit fit = io::replay_field(recording, model, options.locked);
    for (const auto& column : fit.limited)
        tell(options.recording + ": " + column.written + " " + column.rule + "; limited in " +
             std::to_string(column.rows) + " of " + std::to_string(recording.time.size()) + " rows");
    if (options.json) {
        nlohmann::json out{{"driven", fit.driven},
                           {"ignored", fit.ignored},
                           {"limited", nlohmann::json::array()},
                           {"fits", nlohmann::json::array()}};
        for (const auto& column : fit.limited)
            out["limited"].push_back({{"column", column.written}, {"rows", column.rows}});
        for (const auto& f : fit.fits)
            out["fits"].push_back({{"column", f.written},
                                   {"unit", plant::symbol(f.unit)},
                                   {"rms", f.rms},
                                   {"worst", f.worst},
                                   {"worst_time_s", f.worst_time},
                                   {"simulated", f.simulated},
                                   {"measured", f.measured}});
        std::cout << out.dump(2) << '\n';
        return good;
    }
    std::printf("%-40s %-6s %12s %12s %10s %14s %14s\n", "measured", "unit", "rms", "worst", "at [s]",
                "simulated", "measured");
    for (const auto& f : fit.fits)
        std::printf("%-40s %-6s %12.5g %12.5g %10.4f %14.7g %14.7g\n", f.written.c_str(),
                    std::string(plant::symbol(f.unit)).c_str(), f.rms, f.worst, f.worst_time, f.simulated,
                    f.measured);
    for (const auto& column : fit.ignored)
        tell(options.recording + ": column " + column + " is no signal of the model");
    return good;
}

int run(const Options& options) {
    if (options.recording.ends_with(".csv") || io::looks_like_candump(options.recording))
        return run_field(options);
    for (const auto* option : options.of_fields)
        if (option->count() > 0)
            throw std::invalid_argument(option->get_name() +
                                        ": only of field recordings (.csv, candump log)");
    io::RecordingReader reader(options.recording);
    try {
        return run_on(reader, options);
    } catch (const io::RecordingError& error) {
        throw io::RecordingError(options.recording + ": " + error.what());
    }
}

Command::Run declare(CLI::App& app) {
    auto options = std::make_shared<Options>();
    app.add_option("RECORDING", options->recording,
                   "what `shiftrig run --record` wrote, or a real machine's data (.csv, candump log)")
        ->required();
    add_number(app, "--tolerance", options->tolerance, {0, 1e6},
               "agree where |replayed - recorded| <= tolerance * max(1, |recorded|); 0: bit for bit");
    app.add_option("--model", options->model,
                   "another model under the same inputs: what would it have done?");
    auto* field = app.add_option_group("field recordings (.csv, candump)");
    field->add_option("--locked", options->locked, "devices locked at the start: Fc,F2")->delimiter(',');
    field->add_option("--option", options->options, "gear option in use: range=M; repeatable");
    field->add_option("--hold", options->held,
                      "an input that was not measured, held: environment.draft=1; repeatable");
    add_number(*field, "--step", options->step_s, {1e-6, 1}, "step size of the plant [s]")
        ->capture_default_str();
    for (const auto* option : field->get_options()) options->of_fields.push_back(option);
    app.add_flag("--json", options->json, "print one JSON object");
    return [options] { return run(*options); };
}

const Command replay("replay", "a recording stepped again and compared tick by tick", declare);

}  // namespace

}  // namespace shiftrig::cli
