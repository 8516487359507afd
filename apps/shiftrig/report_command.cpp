// shiftrig report: a recording as one page that explains itself.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "analysis/driveline_svg.h"
#include "analysis/load_run.h"
#include "analysis/report/report.h"
#include "analysis/report/shift_page.h"
#include "apps/shiftrig/command.h"
#include "apps/shiftrig/files.h"
#include "io/recording/reader.h"
#include "io/recording/rebuild.h"

namespace shiftrig::cli {

namespace {

struct Options {
    std::string recording, output, limits;
    Files files;
    bool json = false;
};

// Only what is shown and judged: an hour of everything would not fit the memory.
std::vector<std::string> wanted_signals(const std::string& recording) {
    const io::RecordingReader reader(recording);
    const auto& manifest = reader.manifest();
    std::vector<plant::Signal> all = manifest.inputs;
    all.insert(all.end(), manifest.outputs.begin(), manifest.outputs.end());
    all.insert(all.end(), manifest.rig.begin(), manifest.rig.end());
    std::vector<std::string> wanted = analysis::report_signals(all);
    for (auto& name : analysis::scorecard_signals(io::recorded_model_file(manifest).description))
        wanted.push_back(std::move(name));
    return wanted;
}

void print_json(const analysis::Scorecard& card) {
    const nlohmann::json result = {{"verdict", analysis::name(card.verdict)},
                                   {"shifts", analysis::to_json(card)}};
    std::cout << result.dump(2) << '\n';
}

int run(const Options& options) {
    if (options.output.empty() && !options.json)
        throw std::invalid_argument("report: -o FILE or --json is needed");
    const analysis::Limits limits =
        options.limits.empty() ? analysis::default_limits() : analysis::read_limits(options.limits);
    const analysis::Run run = analysis::load_run(options.recording, wanted_signals(options.recording));
    const analysis::Scorecard card = analysis::score(run, limits);
    // What can be read is judged; what ended the reading early is told.
    const std::string incomplete = run.incomplete();
    for (const std::string& line : {incomplete, run.unfinished})
        if (!line.empty()) tell(line);
    const int code = incomplete.empty() ? good : bad_input;
    if (options.json) print_json(card);
    if (options.output.empty()) return code;

    analysis::ReportOptions report;
    report.title = run.machine.name;
    report.driveline_svg = analysis::driveline_svg(run.machine);
    for (const auto& score : card.shifts) {
        report.title +=
            (&score == &card.shifts.front() ? ": " : ", ") + score.shift.from + " → " + score.shift.to;
        report.windows.emplace_back(score.shift.asked_at - 0.5, score.shift.ended_at + 1);
    }
    std::ofstream file(options.output);
    file << analysis::report_html(run, analysis::shift_pages(run, card, limits), report);
    file.close();
    if (!file) throw std::runtime_error(options.output + ": cannot be written");
    if (!options.json)
        std::cout << io::one_line(options.output) << ": " << card.shifts.size() << " shifts, verdict "
                  << analysis::name(card.verdict) << '\n';
    return code;
}

Command::Run declare(CLI::App& app) {
    auto options = std::make_shared<Options>();
    Files& files = options->files;
    files.read(app.add_option("RECORDING", options->recording, "of shiftrig run --record")->required());
    files.written(app.add_option("-o,--output", options->output, "the page (.html)"));
    app.add_flag("--json", options->json, "print the scorecard as one JSON object");
    files.read(
        app.add_option("--limits", options->limits,
                       "what is good and what is rejected (YAML); else config/limits.yaml as built in"));
    return [options] {
        options->files.check();
        return run(*options);
    };
}

const Command command("report", "a recording as one self-contained HTML page, or its scorecard as JSON",
                      declare);

}  // namespace

}  // namespace shiftrig::cli
