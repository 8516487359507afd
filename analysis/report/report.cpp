#include "analysis/report/report.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "analysis/report/report_page.h"

namespace shiftrig::analysis {

using nlohmann::json;
using plant::Unit;

namespace {

// One stack of lines: which signals belong to it.
struct Group {
    const char* title;
    bool (*takes)(const plant::Signal&);
};

bool is_pair(const plant::Signal& s) {
    return s.name.starts_with("clutch.") || s.name.starts_with("freewheel.");
}

const Group groups[] = {
    {"Driver", [](const plant::Signal& s) { return s.name.starts_with("driver.") && s.unit == Unit::one; }},
    {"Clutch pressure commands",
     [](const plant::Signal& s) {
         return s.name.starts_with("clutch.") && s.name.ends_with(".pressure_command");
     }},
    {"Clutch pressures",
     [](const plant::Signal& s) { return s.name.starts_with("clutch.") && s.name.ends_with(".pressure"); }},
    {"Speeds",
     [](const plant::Signal& s) { return s.name.starts_with("mass.") && s.unit == Unit::radian_per_second; }},
    {"Vehicle speed",
     [](const plant::Signal& s) { return s.name.starts_with("mass.") && s.unit == Unit::metre_per_second; }},
    {"Vehicle acceleration", [](const plant::Signal& s) { return s.name.ends_with(".acceleration"); }},
    {"Clutch slip", [](const plant::Signal& s) { return is_pair(s) && s.name.ends_with(".slip"); }},
    {"Shaft torques",
     [](const plant::Signal& s) {
         return (s.name.starts_with("shaft.") || s.name.starts_with("backlash.")) &&
                s.name.ends_with(".torque");
     }},
    {"Clutch torques", [](const plant::Signal& s) { return is_pair(s) && s.name.ends_with(".torque"); }},
    {"Facing temperatures",
     [](const plant::Signal& s) { return s.name.starts_with("clutch.") && s.unit == Unit::celsius; }},
    {"Bus and loop",
     [](const plant::Signal& s) { return s.name.starts_with("bus.") || s.name.starts_with("rig."); }},
};

// What the driveline picture is painted from, besides the plotted lines.
bool paints(const plant::Signal& s) {
    return s.name.ends_with(".state") || s.name.ends_with(".direction") ||
           (s.name.starts_with("gear.") && s.name.ends_with(".torque")) || s.name.starts_with("row.");
}

bool shows(const plant::Signal& signal) {
    return paints(signal) || signal.name.starts_with("energy.") ||
           (signal.name.starts_with("clutch.") && signal.name.ends_with(".heat")) ||
           std::any_of(std::begin(groups), std::end(groups), [&](const Group& g) { return g.takes(signal); });
}

std::string base64(const void* data, std::size_t size) {
    static constexpr char alphabet[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const auto* bytes = static_cast<const unsigned char*>(data);
    std::string text;
    text.reserve((size + 2) / 3 * 4);
    for (std::size_t i = 0; i < size; i += 3) {
        const unsigned b = i + 1 < size ? bytes[i + 1] : 0U, c = i + 2 < size ? bytes[i + 2] : 0U;
        const unsigned three = (static_cast<unsigned>(bytes[i]) << 16) | (b << 8) | c;
        text += alphabet[three >> 18];
        text += alphabet[(three >> 12) & 63];
        text += i + 1 < size ? alphabet[(three >> 6) & 63] : '=';
        text += i + 2 < size ? alphabet[three & 63] : '=';
    }
    return text;
}

json series(const Run& run, const Decimation& kept) {
    json columns = json::array();
    for (const auto& column : run.columns) {
        if (!shows(column.signal)) continue;
        std::vector<float> values;
        for (const double v : kept.values(column.value)) values.push_back(static_cast<float>(v));
        columns.push_back({{"name", column.signal.name},
                           {"unit", plant::symbol(column.signal.unit)},
                           {"values", base64(values.data(), values.size() * sizeof(float))}});
    }
    const auto time = kept.time(run.time);
    return {{"t", base64(time.data(), time.size() * sizeof(double))}, {"columns", columns}};
}

// The change of every account over the recording, which may begin in the middle of a run.
json energy(const Run& run) {
    const auto change_of = [](const std::vector<double>& column) {
        return column.empty() ? 0.0 : column.back() - column.front();
    };
    const auto change = [&](std::string_view name) {
        const auto* column = run.column(name);
        return column ? change_of(*column) : 0.0;
    };
    json by_device = json::object();
    for (const auto& column : run.columns)
        if (column.signal.name.starts_with("clutch.") && column.signal.name.ends_with(".heat") &&
            !column.value.empty())
            by_device[column.signal.name.substr(7, column.signal.name.size() - 12)] = change_of(column.value);
    return {{"input_j", change("energy.input")},
            {"stored_change_j", change("energy.stored")},
            {"dissipated_j", by_device},
            {"dissipated_total_j", change("energy.dissipated")},
            {"defect_j", change("energy.defect")}};
}

// Safe inside <script>: no "</", no "<!--".
std::string script_safe(std::string text) {
    for (std::size_t at = 0; (at = text.find('<', at)) != std::string::npos; at += 6)
        text.replace(at, 1, "\\u003c");
    return text;
}

}  // namespace

Decimation Decimation::of(const std::vector<double>& time, int points,
                          const std::vector<std::pair<double, double>>& windows) {
    Decimation kept;
    const std::size_t rows = time.size();
    const auto in_window = [&](double t) {
        return std::any_of(windows.begin(), windows.end(),
                           [t](auto& w) { return t >= w.first && t <= w.second; });
    };
    std::size_t outside = 0;
    for (const double t : time) outside += in_window(t) ? 0 : 1;
    const auto stride = std::max<std::size_t>(1, 2 * outside / static_cast<std::size_t>(std::max(2, points)));
    for (std::size_t row = 0; row < rows;) {
        std::size_t last = row;
        if (!in_window(time[row]))
            while (last + 1 < rows && last + 1 - row < stride && !in_window(time[last + 1])) ++last;
        kept.buckets.push_back({row, last});
        row = last + 1;
    }
    return kept;
}

std::vector<double> Decimation::time(const std::vector<double>& all) const {
    std::vector<double> times;
    for (const auto& bucket : buckets) {
        times.push_back(all[bucket.first]);
        if (bucket.last > bucket.first) times.push_back(all[bucket.last]);
    }
    return times;
}

std::vector<double> Decimation::values(const std::vector<double>& column) const {
    std::vector<double> kept;
    for (const auto& bucket : buckets) {
        if (bucket.last == bucket.first) {
            kept.push_back(column[bucket.first]);
            continue;
        }
        const auto begin = column.begin() + static_cast<std::ptrdiff_t>(bucket.first);
        const auto end = column.begin() + static_cast<std::ptrdiff_t>(bucket.last) + 1;
        const auto [least, greatest] = std::minmax_element(begin, end);
        kept.push_back(least < greatest ? *least : *greatest);
        kept.push_back(least < greatest ? *greatest : *least);
    }
    return kept;
}

std::vector<std::string> report_signals(const std::vector<plant::Signal>& all) {
    std::vector<std::string> names;
    for (const auto& signal : all)
        if (shows(signal)) names.push_back(signal.name);
    return names;
}

std::string report_html(const Run& run, const json& shifts, const ReportOptions& options) {
    static_assert(std::endian::native == std::endian::little, "the report's columns are little-endian");
    json data;
    data["title"] = options.title;
    data["duration_s"] = run.time.empty() ? 0.0 : run.time.back() - run.time.front();
    data["shifts"] = shifts;
    data["groups"] = json::array();
    for (const auto& group : groups) {
        json names = json::array();
        for (const auto& column : run.columns)
            if (group.takes(column.signal)) names.push_back(column.signal.name);
        if (!names.empty()) data["groups"].push_back({{"title", group.title}, {"columns", names}});
    }
    data["series"] = series(run, Decimation::of(run.time, options.points, options.windows));
    data["events"] = json::array();
    for (const auto& change : run.changes)
        data["events"].push_back({{"t", change.event.time}, {"text", change.text}});
    data["energy"] = energy(run);
    data["driveline_svg"] = options.driveline_svg;
    data["identity"] = json::object();
    data["loop"] = json::object();
    for (const auto& [name, value] : run.identity) {
        if (name.starts_with("loop."))
            data["loop"][name.substr(5)] = value;
        else
            data["identity"][name] = value;
        if (name == "scenario" || name == "kernel") data[name] = value;
    }
    data["bus"] = json::array();
    for (const auto& column : run.columns)
        if (column.signal.name.starts_with("bus.") && column.signal.name.ends_with(".status") &&
            !column.value.empty()) {
            static constexpr const char* words[] = {"never seen", "alive", "late", "lost", "corrupt"};
            double share[5] = {};
            for (const double v : column.value) share[std::clamp(static_cast<int>(v), 0, 4)] += 1;
            std::string text;
            for (int i = 0; i < 5; ++i)
                if (share[i] > 0) {
                    char part[48];
                    std::snprintf(part, sizeof part, "%s%s %.1f %%", text.empty() ? "" : ", ", words[i],
                                  100 * share[i] / static_cast<double>(column.value.size()));
                    text += part;
                }
            data["bus"].push_back(
                {{"message", column.signal.name.substr(4, column.signal.name.size() - 11)}, {"text", text}});
        }
    data["model_text"] = run.model_text;

    const std::string_view marker = R"({"placeholder":"shiftrig-report-data"})";
    const std::size_t at = report_page.find(marker);
    std::string html(report_page.substr(0, at));
    html += script_safe(data.dump(-1, ' ', true, json::error_handler_t::replace));
    html += report_page.substr(at + marker.size());
    return html;
}

}  // namespace shiftrig::analysis
