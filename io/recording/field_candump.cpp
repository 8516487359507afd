#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <map>
#include <set>

#include "io/can/candump.h"
#include "io/can/link.h"
#include "io/recording/candump.h"

namespace shiftrig::io {

namespace {

constexpr double kRow = 0.01;  // [s] between rows

struct Samples {
    plant::Unit unit{};
    std::vector<double> time, value;
};

// Listens to one side of the log: CanLink is who hears what the mapping's `rig_nodes` send.
void listen(const std::string& path, const can::Mapping& mapping, std::map<std::string, Samples>& all) {
    can::CandumpReplay replay(path, can::message_filters(mapping, can::Role::controller));
    SignalTable table;
    can::CanLink link(mapping, replay, table,
                      {.role = can::Role::controller, .address_claim = can::AddressClaim::off});
    std::map<std::string, std::uint64_t> good;
    while (!replay.finished()) {
        const std::int64_t now_ns = replay.next_ns();
        link.receive(now_ns, table);
        for (const auto& report : link.report()) {
            if (report.sent_by_us || good[report.name] == report.good) continue;
            good[report.name] = report.good;
            for (const auto& entry : mapping.find(report.name)->signals) {
                const int index = table.find(entry.signal);
                if (index < 0 || !std::isfinite(table.value[static_cast<std::size_t>(index)])) continue;
                Samples& samples = all[entry.signal];
                samples.unit = table.signal(index).unit;
                samples.time.push_back(1e-9 * static_cast<double>(now_ns));
                samples.value.push_back(table.value[static_cast<std::size_t>(index)]);
            }
        }
    }
}

// The same mapping heard from the other side: what the controller sends.
can::Mapping turned_round(can::Mapping mapping) {
    std::set<std::string> others;
    for (const auto& map : mapping.messages) {
        const auto& layout = *mapping.database.find(map.name);
        if (!mapping.sent_by_rig(layout)) others.insert(layout.transmitter);
    }
    mapping.rig_nodes.assign(others.begin(), others.end());
    return mapping;
}

double between(const Samples& samples, double time) {
    const auto after =
        std::upper_bound(samples.time.begin(), samples.time.end(), time) - samples.time.begin();
    const auto i = static_cast<std::size_t>(std::max<std::ptrdiff_t>(0, after - 1));
    if (after == 0 || samples.unit == plant::Unit::one || i + 1 >= samples.time.size())
        return samples.value[i];
    const double share = (time - samples.time[i]) / (samples.time[i + 1] - samples.time[i]);
    return samples.value[i] + share * (samples.value[i + 1] - samples.value[i]);
}

}  // namespace

bool looks_like_candump(const std::string& path) {
    std::ifstream file(path);
    char first = 0;
    // A compressed recording begins with the same character, but no digit follows.
    return file >> first && first == '(' && std::isdigit(file.peek());
}

FieldRecording read_field_candump(const std::string& path, const can::Mapping& original) {
    can::Mapping mapping = original;
    mapping.question = mapping.answer = "";  // nobody answers a log
    std::map<std::string, Samples> all;
    listen(path, mapping, all);
    listen(path, turned_round(mapping), all);

    FieldRecording recording;
    recording.path = path;
    double end = 0;
    for (const auto& [name, samples] : all) end = std::max(end, samples.time.back());
    if (end < kRow)
        throw InputError(path, 0, 0, "holds no frames that " + mapping.file + " knows, or too few");
    const auto rows = static_cast<std::size_t>(end / kRow);
    for (std::size_t row = 0; row <= rows; ++row) recording.time.push_back(kRow * static_cast<double>(row));
    for (const auto& [name, samples] : all) {
        FieldColumn column;
        column.written = name + std::string(plant::suffix(samples.unit));
        column.signal = name;
        column.unit = samples.unit;
        for (const double time : recording.time) column.value.push_back(between(samples, time));
        recording.columns.push_back(std::move(column));
    }
    return recording;
}

}  // namespace shiftrig::io
