// A run as stacked plots over one time axis, drawn as SVG.
#pragma once

#include <string>
#include <vector>

#include "analysis/run.h"
#include "analysis/shifts.h"

namespace shiftrig::analysis {

struct PlotLine {
    std::string label;
    std::vector<double> value;  // one per row of the run, in the panel's unit; NaN leaves a gap
    bool dashed = false;
    int colour = 0;  // index into the palette; the same device keeps its colour through all panels
};

struct PlotPanel {
    std::string title, unit;
    std::vector<PlotLine> lines;
};

struct PlotMark {
    double time = 0;   // [s]
    std::string text;  // in the list below the title; a numbered line goes through all panels
};

struct Plot {
    std::string title;
    std::vector<double> time;  // [s]
    double from = 0, until = 0;
    double shaded_from = 0, shaded_until = 0;  // equal: nothing is shaded
    std::vector<PlotPanel> panels;
    std::vector<PlotMark> marks;
};

// Pressures, speeds, torques, driveline torque and acceleration around one shift, its command, phases and
// changes of contact marked.
Plot plot_of_shift(const Run& run, const Shift& shift);
// The same of everything between two times.
Plot plot_of_stretch(const Run& run, double from, double until);

// `width` in pixels; the height follows from the number of panels.
std::string to_svg(const Plot& plot, int width = 900);

}  // namespace shiftrig::analysis
