#include "analysis/plot.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>

#include "analysis/filter.h"
#include "analysis/gears.h"

namespace shiftrig::analysis {

namespace {

constexpr double bar = 1e5;                        // [Pa]
constexpr double rpm = 2 * std::numbers::pi / 60;  // [rad/s]
constexpr double rim = 0.2;                        // of the plot before a shift and after its settling [s]

using Names = std::vector<std::string>;

std::vector<double> in_unit(const std::vector<double>& x, double unit) {
    std::vector<double> y(x.size());
    std::transform(x.begin(), x.end(), y.begin(), [unit](double value) { return value / unit; });
    return y;
}

// Collects the lines of one panel from the run's columns; columns that are not there make no line.
class PanelMaker {
  public:
    PanelMaker(const Run& run, std::string title, std::string unit)
        : run_(run), panel_{std::move(title), std::move(unit), {}} {}

    PanelMaker& line(const std::string& signal, const std::string& label, double unit, int colour,
                     bool dashed = false) {
        if (const auto* column = run_.column(signal)) values(in_unit(*column, unit), label, colour, dashed);
        return *this;
    }
    PanelMaker& values(std::vector<double> value, const std::string& label, int colour, bool dashed = false) {
        panel_.lines.push_back({label, std::move(value), dashed, colour});
        return *this;
    }
    void add_to(Plot& plot) {
        if (!panel_.lines.empty()) plot.panels.push_back(std::move(panel_));
    }

  private:
    const Run& run_;
    PlotPanel panel_;
};

// The input's speed and what it would be in each of the given gears.
void add_speeds(Plot& plot, const Run& run, const Names& gear_names) {
    PanelMaker panel(run, "speed", "rpm");
    int colour = 0;
    bool input_drawn = false;
    for (const Gear& gear : gears_of(run.machine)) {
        if (std::find(gear_names.begin(), gear_names.end(), gear.name) == gear_names.end()) continue;
        if (!input_drawn) panel.line("mass." + gear.in + ".speed", gear.in, rpm, colour++);
        input_drawn = true;
        if (const auto* out = run.column("mass." + gear.out + ".speed"); out != nullptr && gear.ratio) {
            panel.values(in_unit(*out, rpm / *gear.ratio), gear.out + " × ratio of " + gear.name, ++colour,
                         true);
        }
    }
    for (const plant::Engine& engine : run.machine.engines)
        panel.line("mass." + engine.mass + ".speed", engine.mass, rpm, 6);
    panel.add_to(plot);
}

Plot draw(const Run& run, double from, double until, const Names& clutches, const Names& gears) {
    Plot plot;
    plot.time = run.time;
    plot.from = std::max(from, run.time.front());
    plot.until = std::min(until, run.time.back());

    PanelMaker commands(run, "command", ""), pressures(run, "clutch pressure", "bar"),
        torques(run, "clutch torque", "Nm");
    for (std::size_t k = 0; k < clutches.size(); ++k) {
        const int colour = static_cast<int>(k);
        const std::string clutch = "clutch." + clutches[k];
        pressures.line(clutch + ".pressure", clutches[k], bar, colour);
        pressures.line(clutch + ".pressure_command", clutches[k] + " command", bar, colour, true);
        commands.line(clutch + ".engagement", clutches[k] + " command", 1, colour, true);
        torques.line(clutch + ".torque", clutches[k], 1, colour);
        torques.line(clutch + ".capacity", clutches[k] + " capacity", 1, colour, true);
    }
    pressures.add_to(plot);
    commands.add_to(plot);
    add_speeds(plot, run, gears);
    torques.add_to(plot);
    // The shaft at the output carries the torque of the whole ratio: a panel of its own.
    PanelMaker drive(run, "drive torque", "kNm"), shafts(run, "shaft torque", "Nm");
    for (std::size_t k = 0; k < run.machine.shafts.size(); ++k) {
        const plant::Shaft& shaft = run.machine.shafts[k];
        const int colour = static_cast<int>(k) + 3;
        const bool at_output = shaft.a == run.machine.output_mass || shaft.b == run.machine.output_mass;
        if (at_output) drive.line("shaft." + shaft.name + ".torque", shaft.name, 1000, colour);
        if (!at_output) shafts.line("shaft." + shaft.name + ".torque", shaft.name, 1, colour);
    }
    shafts.add_to(plot);
    drive.add_to(plot);
    for (const plant::Mass& mass : run.machine.masses) {
        const auto* a = run.column("body." + mass.name + ".acceleration");
        if (mass.motion != plant::Motion::translating || a == nullptr || run.time.size() < 2) continue;
        const double interval =
            (run.time.back() - run.time.front()) / static_cast<double>(run.time.size() - 1);
        PanelMaker(run, "acceleration", "m/s²")
            .values(*a, mass.name, 7)
            .values(low_pass(*a, interval, 10), "low-passed at 10 Hz", 0)
            .add_to(plot);
    }
    for (const Change& change : run.changes) {
        const bool ours = std::find(clutches.begin(), clutches.end(), change.device) != clutches.end();
        const char* word = change.event.kind == plant::EventKind::lock         ? " locks"
                           : change.event.kind == plant::EventKind::break_away ? " slips"
                           : change.event.kind == plant::EventKind::reverse    ? " turns"
                                                                               : nullptr;
        const bool inside = change.event.time >= plot.from && change.event.time <= plot.until;
        if (ours && inside && word != nullptr)
            plot.marks.push_back({change.event.time, change.device + word});
    }
    return plot;
}

// ---- SVG ----------------------------------------------------------------------------------------------

// Distinguishable also without colour vision (after Okabe and Ito), dark enough on white; the last is faint.
constexpr const char* palette[] = {"#0072b2", "#d55e00", "#009e73", "#aa4499",
                                   "#8a6d00", "#56b4e9", "#555555", "#b8c4d0"};
constexpr int colours = 8;

constexpr double left = 64, right = 12, top = 62, panel_height = 120, gap = 28, bottom = 44;  // [px]

std::string text_of(double x, int decimals = 2) {
    char text[40];
    std::snprintf(text, sizeof text, "%.*f", decimals, x);
    return text;
}
std::string escaped(const std::string& text) {
    std::string result;
    for (const char c : text) {
        if (c == '<')
            result += "&lt;";
        else if (c == '&')
            result += "&amp;";
        else if (c == '"')
            result += "&quot;";
        else
            result += c;
    }
    return result;
}

// A round distance between axis ticks (1, 2 or 5 times a power of ten) that makes about `count` of them.
double round_step(double range, int count) {
    const double rough = range / count, power = std::pow(10, std::floor(std::log10(rough)));
    const double mantissa = rough / power;
    return power * (mantissa < 1.5 ? 1 : mantissa < 3.5 ? 2 : mantissa < 7.5 ? 5 : 10);
}

class SvgPlot {
  public:
    SvgPlot(const Plot& plot, int width) : plot_(plot), width_(width) {
        const auto begin = plot.time.begin();
        first_ = static_cast<std::size_t>(std::lower_bound(begin, plot.time.end(), plot.from) - begin);
        last_ = static_cast<std::size_t>(std::upper_bound(begin, plot.time.end(), plot.until) - begin);
    }

    std::string draw() {
        const double height =
            top + static_cast<double>(plot_.panels.size()) * (panel_height + gap) - gap + bottom;
        svg_ =
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 " + std::to_string(width_) + " " +
            text_of(height, 0) + "\" width=\"" + std::to_string(width_) + "\" height=\"" +
            text_of(height, 0) +
            "\" font-family=\"DejaVu Sans, Helvetica, Arial, sans-serif\" font-size=\"11\" fill=\"#222\">\n"
            "<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n";
        text(left, 16, plot_.title, "start", " font-size=\"13\" font-weight=\"600\"");
        const double foot = height - bottom;
        if (plot_.shaded_until > plot_.shaded_from) {
            const double from = x(std::max(plot_.shaded_from, plot_.from)),
                         until = x(std::min(plot_.shaded_until, plot_.until));
            svg_ += "<rect x=\"" + text_of(from) + "\" y=\"" + text_of(top) + "\" width=\"" +
                    text_of(until - from) + "\" height=\"" + text_of(foot - top) + "\" fill=\"#eef3f8\"/>\n";
        }
        for (std::size_t k = 0; k < plot_.panels.size(); ++k) {
            panel(plot_.panels[k], top + static_cast<double>(k) * (panel_height + gap),
                  k + 1 == plot_.panels.size());
        }
        marks(foot);
        return svg_ + "</svg>\n";
    }

  private:
    double x(double time) const {
        return left + (time - plot_.from) / (plot_.until - plot_.from) * (width_ - left - right);
    }
    void text(double at_x, double at_y, const std::string& words, const char* anchor,
              const std::string& more = "") {
        svg_ += "<text x=\"" + text_of(at_x) + "\" y=\"" + text_of(at_y) + "\" text-anchor=\"" + anchor +
                "\"" + more + ">" + escaped(words) + "</text>\n";
    }
    void rule(double x1, double y1, double x2, double y2, const char* style) {
        svg_ += "<path d=\"M" + text_of(x1) + " " + text_of(y1) + "L" + text_of(x2) + " " + text_of(y2) +
                "\" " + style + "/>\n";
    }

    void panel(const PlotPanel& panel, double y_top, bool last) {
        double low = std::numeric_limits<double>::infinity(), high = -low;
        for (const PlotLine& line : panel.lines) {
            for (std::size_t i = first_; i < last_; ++i) {
                if (!std::isfinite(line.value[i])) continue;
                low = std::min(low, line.value[i]);
                high = std::max(high, line.value[i]);
            }
        }
        if (low > high) low = 0, high = 1;
        const double step = round_step(std::max(high - low, 1e-3 * std::max(1.0, std::abs(high))), 4);
        low = step * std::floor(low / step + 1e-9);
        high = step * std::max(std::ceil(high / step - 1e-9), low / step + 1);
        const double y_bottom = y_top + panel_height;
        const auto y = [&](double value) { return y_bottom - (value - low) / (high - low) * panel_height; };

        const int decimals = std::max(0, static_cast<int>(-std::floor(std::log10(step) + 1e-9)));
        for (double value = low; value <= high + step / 2; value += step) {
            rule(left, y(value), width_ - right, y(value), "stroke=\"#dde3e8\"");
            text(left - 6, y(value) + 4, text_of(std::abs(value) < step / 2 ? 0 : value, decimals), "end");
        }
        const double second = round_step(plot_.until - plot_.from, 9);
        const int places = std::max(0, static_cast<int>(-std::floor(std::log10(second) + 1e-9)));
        for (double time = second * std::ceil(plot_.from / second - 1e-9); time <= plot_.until + 1e-9;
             time += second) {
            rule(x(time), y_top, x(time), y_bottom, "stroke=\"#eef1f4\"");
            if (last) text(x(time), y_bottom + 15, text_of(time, places), "middle");
        }
        if (last) text((left + width_ - right) / 2, y_bottom + 40, "time, s", "middle");
        for (const PlotLine& line : panel.lines) polyline(line, y);
        rule(left, y_top, left, y_bottom, "stroke=\"#8894a0\"");
        legend(panel, y_top - 6);
    }

    // At most two points to a pixel, the least and the greatest of its rows, in their order.
    template <class Y>
    void polyline(const PlotLine& line, const Y& y) {
        const double rows_per_pixel = static_cast<double>(last_ - first_) / (width_ - left - right);
        const auto bucket = static_cast<std::size_t>(std::max(1.0, std::floor(rows_per_pixel)));
        std::string path;
        bool gap_before = true;
        const auto point = [&](std::size_t i) {
            path += (gap_before ? "M" : "L") + text_of(x(plot_.time[i])) + " " + text_of(y(line.value[i]));
            gap_before = false;
        };
        for (std::size_t i = first_; i < last_; i += bucket) {
            std::size_t least = i, most = i;
            bool finite = true;
            for (std::size_t k = i; k < std::min(i + bucket, last_); ++k) {
                finite &= std::isfinite(line.value[k]);
                if (line.value[k] < line.value[least]) least = k;
                if (line.value[k] > line.value[most]) most = k;
            }
            if (!finite) {
                gap_before = true;
                continue;
            }
            point(std::min(least, most));
            if (least != most) point(std::max(least, most));
        }
        svg_ += "<path fill=\"none\" stroke=\"" + std::string(palette[line.colour % colours]) +
                "\" stroke-width=\"1.4\"" + (line.dashed ? " stroke-dasharray=\"5 3\"" : "") + " d=\"" +
                path + "\"/>\n";
    }

    void legend(const PlotPanel& panel, double at_y) {
        const std::string head = panel.title + (panel.unit.empty() ? "" : ", " + panel.unit);
        text(left, at_y, head, "start", " font-weight=\"600\"");
        double at_x = left + 8.0 * static_cast<double>(head.size()) + 14;
        for (const PlotLine& line : panel.lines) {
            svg_ += "<path d=\"M" + text_of(at_x) + " " + text_of(at_y - 4) +
                    "h18\" stroke-width=\"1.8\" stroke=\"" + palette[line.colour % colours] + "\"" +
                    (line.dashed ? " stroke-dasharray=\"5 3\"" : "") + "/>\n";
            text(at_x + 22, at_y, line.label, "start");
            at_x += 22 + 6.6 * static_cast<double>(line.label.size()) + 14;
        }
    }

    // A line through all panels with a number at its head; the words stand in a list below the title.
    void marks(double foot) {
        std::vector<PlotMark> sorted = plot_.marks;
        std::stable_sort(sorted.begin(), sorted.end(),
                         [](const PlotMark& a, const PlotMark& b) { return a.time < b.time; });
        double list = left, free_from = 0;
        for (std::size_t k = 0; k < sorted.size(); ++k) {
            const double at = x(sorted[k].time);
            const std::string number = std::to_string(k + 1);
            rule(at, top - 2, at, foot, "stroke=\"#8894a0\" stroke-dasharray=\"2 2\"");
            // Numbers of marks close to each other are pushed to the right.
            const double place = std::max(at, free_from);
            text(place, foot + 26, number, "middle", " font-size=\"9\"");
            free_from = place + 7.0 * static_cast<double>(number.size());
            const std::string words = number + " " + sorted[k].text;
            text(list, 30, words, "start", " font-size=\"9.5\" fill=\"#555\"");
            list += 5.6 * static_cast<double>(words.size()) + 12;
        }
    }

    const Plot& plot_;
    const int width_;
    std::size_t first_ = 0, last_ = 0;
    std::string svg_;
};

}  // namespace

Plot plot_of_shift(const Run& run, const Shift& shift) {
    Names clutches = shift.offgoing;
    clutches.insert(clutches.end(), shift.oncoming.begin(), shift.oncoming.end());
    Names gears{shift.from, shift.to};
    for (const Gear& gear : gears_of(run.machine)) {
        if (gear.name == shift.to) clutches.insert(clutches.end(), gear.common.begin(), gear.common.end());
    }
    Plot plot = draw(run, shift.asked_at - rim, run.time[shift.settled] + rim, clutches, gears);
    plot.title = shift.from + " → " + shift.to + ", " + std::string(name(shift.kind)) + ", " +
                 std::string(name(shift.end));
    plot.shaded_from = shift.asked_at;
    plot.shaded_until = shift.ended_at;
    plot.marks.push_back({shift.asked_at, "asked for"});
    plot.marks.push_back({shift.ended_at, std::string(name(shift.end))});
    return plot;
}

Plot plot_of_stretch(const Run& run, double from, double until) {
    Names clutches, gears;
    for (const Gear& gear : gears_of(run.machine)) {
        gears.push_back(gear.name);
        for (const std::string& name : gear.selecting) {
            if (std::find(clutches.begin(), clutches.end(), name) == clutches.end()) clutches.push_back(name);
        }
    }
    Plot plot = draw(run, from, until, clutches, gears);
    plot.title = run.machine.name;
    return plot;
}

std::string to_svg(const Plot& plot, int width) {
    return SvgPlot(plot, width).draw();
}

}  // namespace shiftrig::analysis
