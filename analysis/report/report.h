// The report of a run: one HTML file that holds everything it shows (docs/shift-quality.md explains the figures).
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "analysis/run.h"

namespace shiftrig::analysis {

struct ReportOptions {
    std::string title;
    std::string driveline_svg;                         // drawing of run.machine, ids as in driveline_svg.h
    int points = 6000;                                 // of each plotted line, at most about this many
    std::vector<std::pair<double, double>> windows{};  // [s] shown in full resolution (the shifts)
};

// Which signals of the machine a report plots and paints: the columns to load from a recording.
std::vector<std::string> report_signals(const std::vector<plant::Signal>& all);

// `shifts` is the scorecard as JSON (an array); throws nothing but std::bad_alloc.
std::string report_html(const Run& run, const nlohmann::json& shifts, const ReportOptions& options);

// Time rows kept of a long run so that every line keeps its extremes: the whole of each window, and elsewhere the
// rows at which some column of a bucket has its least or greatest value are represented by a pair of rows per bucket.
struct Decimation {
    struct Bucket {
        std::size_t first, last;  // rows [first, last]
    };
    std::vector<Bucket> buckets;  // a bucket of one row is kept as it is

    static Decimation of(const std::vector<double>& time, int points,
                         const std::vector<std::pair<double, double>>& windows);
    std::vector<double> time(const std::vector<double>& time) const;
    // Per bucket of more than one row: the least and the greatest value in the order in which they occur.
    std::vector<double> values(const std::vector<double>& column) const;
};

}  // namespace shiftrig::analysis
