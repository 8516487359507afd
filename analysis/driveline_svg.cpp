#include "analysis/driveline_svg.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <vector>

#include "analysis/driveline_graph.h"
#include "plant/modal.h"

namespace shiftrig::analysis {

namespace {

// [px] of the drawing's own coordinates.
constexpr double column_width = 96, row_height = 92, margin = 24;
constexpr double mass_width = 84, mass_height = 52;
constexpr double device_width = 40;  // ports of a device stand this far apart
constexpr double hang_depth = 40;    // between things that hang below or stand above one mass
constexpr double line_height = 18;

constexpr const char* style = R"(<style>
.driveline{font:12.5px system-ui,sans-serif;--i:var(--ink,#1c2430);--p:var(--paper,#fff);--m:var(--muted,#5b6675)}
.driveline text{fill:var(--i);text-anchor:middle}
.driveline .figure,.driveline .role{fill:var(--m);font-size:9.5px}
.driveline .value{font-size:11px;font-variant-numeric:tabular-nums}
.driveline .mass rect{fill:var(--p);stroke:var(--i);stroke-width:1.5}
.driveline .link{fill:none;stroke:var(--m);stroke-width:1.5}
.driveline .device path,.driveline .device circle{fill:none;stroke:var(--i);stroke-width:1.8}
.driveline .device.open path{stroke:var(--open,#8a94a3)}
.driveline .device.slipping path{stroke:var(--slipping,#b45309);stroke-width:3}
.driveline .device.locked path{stroke:var(--locked,#15803d);stroke-width:3}
.driveline .table text{text-anchor:end;font-variant-numeric:tabular-nums}
.driveline .table .head{fill:var(--m)}
</style>
)";

std::string px(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.1f", value);
    return text;
}

std::string decimals(double value, int count) {
    char text[32];
    std::snprintf(text, sizeof text, "%.*f", count, value);
    return text;
}

std::string escaped(const std::string& text) {
    std::string result;
    for (const char c : text) {
        if (c == '&')
            result += "&amp;";
        else if (c == '<')
            result += "&lt;";
        else if (c == '"')
            result += "&quot;";
        else
            result += c;
    }
    return result;
}

class Drawing {
  public:
    explicit Drawing(const plant::Description& machine)
        : machine_(machine), graph_(driveline_graph(machine)) {
        for (const auto& edge : graph_.edges)
            if (node(edge.device).is_on_one_mass()) stack(edge);
        double above = 0, below = 0;
        for (int i = 0; i < static_cast<int>(graph_.nodes.size()); ++i) {
            above = std::min(above, place(i).y);
            below = std::max(below, place(i).y);
        }
        top_ = margin + mass_height / 2 - above;
        height_ = top_ + below + mass_height / 2 + margin;
        width_ = 2 * margin + (graph_.columns - 1) * column_width + mass_width;
    }

    std::string draw(bool with_gear_table) {
        for (const auto& edge : graph_.edges) link(edge);
        for (int i = 0; i < static_cast<int>(graph_.nodes.size()); ++i) {
            if (node(i).is_mass)
                mass(node(i));
            else
                device(i);
        }
        if (with_gear_table) gear_table();
        return "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"driveline\" viewBox=\"0 0 " + px(width_) +
               " " + px(height_) + "\" role=\"img\" aria-label=\"driveline of " + escaped(machine_.name) +
               "\">\n" + style + body_ + "</svg>\n";
    }

  private:
    struct Point {
        double x, y;
    };
    const DrivelineGraph::Node& node(int index) const {
        return graph_.nodes[static_cast<std::size_t>(index)];
    }

    // Brakes and what acts on a body hang below their mass, engines and sources stand above it.
    static bool stands(const DrivelineGraph::Node& device) { return device.symbol.place == Place::stands; }
    void stack(const DrivelineGraph::Edge& edge) {
        int& level = (stands(node(edge.device)) ? standing_ : hanging_)[edge.mass];
        level_[edge.device] = ++level;
    }
    Point place(int index) const {
        const auto& at = node(index);
        Point point{margin + mass_width / 2 + at.column * column_width, top_ + at.row * row_height};
        if (const auto level = level_.find(index); level != level_.end())
            point.y += (stands(at) ? -1 : 1) * (mass_height / 2 + hang_depth * (level->second - 0.55));
        return point;
    }

    void link(const DrivelineGraph::Edge& edge) {
        const Point mass = place(edge.mass), device = place(edge.device);
        if (level_.contains(edge.device)) return;  // stands on its mass
        const double side = node(edge.device).column > node(edge.mass).column ? 1 : -1;
        const Point from{mass.x + side * mass_width / 2, mass.y};
        // Several links of a device on the same side spread over its height.
        std::vector<int> rivals;
        for (const auto& other : graph_.edges)
            if (other.device == edge.device &&
                (node(other.device).column > node(other.mass).column) == (side > 0))
                rivals.push_back(other.mass);
        std::stable_sort(rivals.begin(), rivals.end(),
                         [this](int a, int b) { return place(a).y < place(b).y; });
        const auto mine =
            static_cast<double>(std::find(rivals.begin(), rivals.end(), edge.mass) - rivals.begin());
        const double offset = 14 * (mine - 0.5 * static_cast<double>(rivals.size() - 1));
        const Point to{device.x - side * device_width / 2, device.y + offset};
        const double bend = side * std::max(10.0, 0.5 * std::fabs(to.x - from.x));
        body_ += "<path class=\"link\" d=\"M" + px(from.x) + " " + px(from.y) + "C" + px(from.x + bend) +
                 " " + px(from.y) + " " + px(to.x - bend) + " " + px(to.y) + " " + px(to.x) + " " + px(to.y) +
                 "\"/>\n";
        if (!edge.role.empty()) text(to.x - side * 14, to.y - 4, "role", edge.role);
    }

    void mass(const DrivelineGraph::Node& mass) {
        const Point at = place(static_cast<int>(&mass - graph_.nodes.data()));
        body_ += "<g id=\"mass-" + escaped(mass.name) + "\" class=\"mass\"><title>mass " +
                 escaped(mass.name) + ", " + escaped(mass.figure) + "</title><rect x=\"" +
                 px(at.x - mass_width / 2) + "\" y=\"" + px(at.y - mass_height / 2) + "\" width=\"" +
                 px(mass_width) + "\" height=\"" + px(mass_height) + "\" rx=\"6\"/>";
        text(at.x, at.y - 11, "name", mass.name);
        text(at.x, at.y + 3, "figure", mass.figure);
        text(at.x, at.y + 18, "value", "");
        body_ += "</g>\n";
    }

    void device(int index) {
        const auto& device = node(index);
        const Point at = place(index);
        body_ += "<g id=\"device-" + escaped(device.name) + "\" class=\"device " + device.symbol.word +
                 "\"><title>" + device.symbol.word + " " + escaped(device.name) +
                 (device.figure.empty() ? "" : ", ") + escaped(device.figure) +
                 "</title><g transform=\"translate(" + px(at.x) + " " + px(at.y) + ")\">" +
                 device.symbol.drawn + "</g>";
        if (level_.contains(index)) {
            text(at.x + 34, at.y - 2, "name", device.name);
            text(at.x + 34, at.y + 10, "value", "");
        } else {
            const double half = device.symbol.half_height;
            text(at.x, at.y - half - 5, "name", device.name);
            text(at.x, at.y + half + 10, "figure", device.figure);
            text(at.x, at.y + half + 21, "value", "");
        }
        body_ += "</g>\n";
    }

    void gear_table() {
        const auto gears = plant::gear_variants(machine_);
        if (gears.empty()) return;
        const bool drives =
            std::any_of(gears.begin(), gears.end(), [](const auto& gear) { return gear.metres_per_radian; });
        double y = height_;
        double right = 0;
        body_ += "<g class=\"table\">\n";
        const auto row = [&](const char* kind, const std::vector<std::string>& cells) {
            for (std::size_t i = 0; i < cells.size() && (drives || i < 2); ++i) {
                right = margin + 60 + 90 * static_cast<double>(i);
                text(right, y, kind, cells[i]);
            }
            y += line_height;
        };
        row("head", {"gear", "ratio", "km/h at 1800", "km/h at 2100"});
        for (const auto& gear : gears)
            row("cell", {gear.name, gear.ratio ? decimals(*gear.ratio, 3) : "–", decimals(gear.kmh(1800), 2),
                         decimals(gear.kmh(2100), 2)});
        body_ += "</g>\n";
        height_ = y + margin;
        width_ = std::max(width_, right + margin);
    }

    void text(double x, double y, const char* kind, const std::string& content) {
        body_ += "<text class=\"" + std::string(kind) + "\" x=\"" + px(x) + "\" y=\"" + px(y) + "\">" +
                 escaped(content) + "</text>";
    }

    const plant::Description& machine_;
    DrivelineGraph graph_;
    std::map<int, int> standing_, hanging_;  // mass → how many so far
    std::map<int, int> level_;               // device → its place in that stack, from 1
    double top_ = 0;                         // y of the middle line
    double width_ = 0, height_ = 0;
    std::string body_;
};

}  // namespace

std::string driveline_svg(const plant::Description& machine, bool with_gear_table) {
    return Drawing(machine).draw(with_gear_table);
}

}  // namespace shiftrig::analysis
