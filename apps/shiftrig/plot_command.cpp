// shiftrig plot: a shift, or any stretch of a recording, as a picture for documents.
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iostream>
#include <memory>
#include <optional>

#include "analysis/load_run.h"
#include "analysis/plot.h"
#include "apps/shiftrig/arguments.h"
#include "apps/shiftrig/command.h"
#include "apps/shiftrig/files.h"

namespace shiftrig::cli {

namespace {

struct Options {
    std::string recording, output;
    Files files;
    int shift = 1;
    double from = -1, until = -1;
    int width = 900;
};

bool ends_with(const std::string& text, const std::string& ending) {
    return text.size() >= ending.size() &&
           text.compare(text.size() - ending.size(), ending.size(), ending) == 0;
}

// rsvg-convert (Debian: librsvg2-bin) turns the SVG into pixels; its words go to our stderr.
void convert(const std::string& svg, const std::string& png) {
    const pid_t child = fork();
    if (child == 0) {
        execlp("rsvg-convert", "rsvg-convert", "--zoom", "1.6", "--format", "png", "--output", png.c_str(),
               svg.c_str(), nullptr);
        std::cerr << "rsvg-convert: " << std::strerror(errno) << " (Debian: sudo apt install librsvg2-bin)\n";
        _exit(127);
    }
    int status = 0;
    if (child < 0 || waitpid(child, &status, 0) != child || !WIFEXITED(status) || WEXITSTATUS(status) != 0) {
        throw std::runtime_error(png + ": could not be made from " + svg);
    }
}

std::string seconds(double value) {
    char text[40];
    std::snprintf(text, sizeof text, "%.3f s", value);
    return text;
}

analysis::Plot plot_of(const analysis::Run& run, const Options& options) {
    if (run.time.size() < 2) throw std::runtime_error(options.recording + ": fewer than two ticks");
    if (options.from >= 0 || options.until >= 0) {
        const double from = std::max(options.from, 0.0);
        const double until = options.until >= 0 ? options.until : run.time.back();
        if (options.until >= 0 && until <= from)
            throw std::runtime_error("--until must be later than --from");
        const auto first = std::lower_bound(run.time.begin(), run.time.end(), from);
        if (std::upper_bound(run.time.begin(), run.time.end(), until) - first < 2)
            throw std::runtime_error(options.recording + ": no two ticks between " + seconds(from) + " and " +
                                     seconds(until) + "; it is from " + seconds(run.time.front()) + " to " +
                                     seconds(run.time.back()));
        return analysis::plot_of_stretch(run, from, until);
    }
    const std::vector<analysis::Shift> shifts = analysis::find_shifts(run);
    if (shifts.empty()) return analysis::plot_of_stretch(run, run.time.front(), run.time.back());
    if (options.shift > static_cast<int>(shifts.size())) {
        throw std::runtime_error(options.recording + ": only " + std::to_string(shifts.size()) +
                                 " shifts in it");
    }
    return analysis::plot_of_shift(run, shifts[static_cast<std::size_t>(options.shift - 1)]);
}

int run(const Options& options) {
    const bool png = ends_with(options.output, ".png");
    if (!png && !ends_with(options.output, ".svg")) throw std::runtime_error("-o: must end in .svg or .png");
    const analysis::Run run = analysis::load_run(options.recording);
    const std::string svg = analysis::to_svg(plot_of(run, options), options.width);
    std::optional<PassingFile> vectors;
    if (png) vectors.emplace(options.output, ".svg");
    const std::string path = png ? vectors->path() : options.output;
    std::ofstream file(path);
    file << svg;
    file.close();
    if (!file) throw std::runtime_error(path + ": cannot be written");
    if (png) convert(path, options.output);
    // What can be read is drawn; what ended the reading early is told.
    const std::string incomplete = run.incomplete();
    if (incomplete.empty()) return good;
    tell(incomplete);
    return bad_input;
}

Command::Run declare(CLI::App& app) {
    auto options = std::make_shared<Options>();
    Files& files = options->files;
    files.read(app.add_option("RECORDING", options->recording, "of shiftrig run --record")->required());
    files.written(app.add_option("-o,--output", options->output, "picture, .svg or .png")->required());
    add_number(app, "--shift", options->shift, {1, 1e6}, "which shift of the recording, from 1")
        ->capture_default_str();
    add_number(app, "--from", options->from, {0, longest_s}, "instead of a shift: from this time on [s]");
    add_number(app, "--until", options->until, {0, longest_s}, "until this time [s]");
    add_number(app, "--width", options->width, {300, 4000}, "[px]")->capture_default_str();
    return [options] {
        options->files.check();
        return run(*options);
    };
}

const Command plot("plot", "a shift, or any stretch of a recording, as a picture", declare);

}  // namespace

}  // namespace shiftrig::cli
