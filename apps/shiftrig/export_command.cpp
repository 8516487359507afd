// shiftrig export: a recording for others' tools.
#include <iostream>
#include <memory>

#include "apps/shiftrig/command.h"
#include "apps/shiftrig/files.h"
#include "apps/shiftrig/rig_options.h"
#include "io/recording/candump.h"
#include "io/recording/csv.h"
#include "io/recording/mcap.h"
#include "io/recording/reader.h"
#include "io/recording/rebuild.h"

namespace shiftrig::cli {

namespace {

struct Options {
    std::string recording, csv, mcap, candump;
    Files files;
};

using Export = std::int64_t (*)(io::RecordingReader&, const std::string&);

// What can be read is exported; what ended the reading early is told.
int export_to(const Options& options, const std::string& path, Export write) {
    io::RecordingReader reader(options.recording);
    if (write == io::export_candump)
        options.files.check(files_of(io::recorded_model_file(reader.manifest())));
    const std::int64_t ticks = write(reader, path);
    if (path != "-") tell(path + ": " + std::to_string(ticks) + " ticks");
    if (reader.ending() == io::Ending::complete) return good;
    tell(reader.complaint());
    return bad_input;
}

int run(const Options& options) {
    int worst = good;
    if (!options.csv.empty()) worst = std::max(worst, export_to(options, options.csv, io::export_csv));
    if (!options.mcap.empty()) worst = std::max(worst, export_to(options, options.mcap, io::export_mcap));
    if (!options.candump.empty())
        worst = std::max(worst, export_to(options, options.candump, io::export_candump));
    return worst;
}

Command::Run declare(CLI::App& app) {
    auto options = std::make_shared<Options>();
    Files& files = options->files;
    files.read(
        app.add_option("RECORDING", options->recording, "what `shiftrig run --record` wrote")->required());
    auto* formats = app.add_option_group("formats (- is standard output)");
    const auto add = [&](const char* name, std::string& path, const char* help) {
        files.written(formats->add_option(name, path, help), StandardOutput::yes);
    };
    add("--csv", options->csv, "a column per signal, a row per tick");
    add("--mcap", options->mcap, "for Foxglove and PlotJuggler");
    add("--candump", options->candump,
        "the signals as frames of the machine's CAN mapping; python-can makes BLF or ASC of it");
    formats->require_option(1, 0);
    return [options] {
        options->files.check();
        return run(*options);
    };
}

const Command export_command("export", "a recording as CSV, MCAP or candump log", declare);

}  // namespace

}  // namespace shiftrig::cli
