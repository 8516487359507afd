#include "io/recording/mcap.h"

#include <charconv>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "io/recording/csv.h"
#include "io/recording/event_json.h"
#include "io/recording/mcap_file.h"

namespace shiftrig::io {

using nlohmann::json;

namespace {

// One device: where its quantities stand in the row of all signals, and how each begins in JSON.
struct Topic {
    std::uint16_t channel = 0;
    std::vector<std::pair<std::string, std::size_t>> fields;
};

// "clutch.F1.pressure" → "/clutch/F1", "pressure"
std::pair<std::string, std::string> split(const std::string& name) {
    const auto dot = name.rfind('.');
    if (dot == std::string::npos) return {"/signals", name};
    std::string topic = "/" + name.substr(0, dot);
    for (auto& c : topic)
        if (c == '.') c = '/';
    return {topic, name.substr(dot + 1)};
}

void append_number(std::string& to, double value) {
    char digits[32];
    to.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
}

json number_schema(const plant::Signal& signal) {
    json schema = {{"type", "number"}};
    if (signal.unit != plant::Unit::one) schema["unit"] = plant::symbol(signal.unit);
    std::string words = signal.description;
    if (signal.unit != plant::Unit::one)
        words += (words.empty() ? "[" : " [") + std::string(plant::symbol(signal.unit)) + "]";
    if (!words.empty()) schema["description"] = words;
    return schema;
}

const json event_schema = {{"type", "object"},
                           {"properties",
                            {{"time_s", {{"type", "number"}, {"unit", "s"}}},
                             {"kind", {{"type", "string"}}},
                             {"device", {{"type", "string"}}},
                             {"torque_nm", {{"type", "number"}, {"unit", "Nm"}}},
                             {"capacity_nm", {{"type", "number"}, {"unit", "Nm"}}},
                             {"margin_nm", {{"type", "number"}, {"unit", "Nm"}}},
                             {"slip_rad_s", {{"type", "number"}, {"unit", "rad/s"}}},
                             {"x", {{"type", "number"}}},
                             {"flank", {{"type", "number"}}},
                             {"speed_rad_s", {{"type", "number"}, {"unit", "rad/s"}}},
                             {"temperature_degc", {{"type", "number"}, {"unit", "degC"}}},
                             {"members", {{"type", "array"}, {"items", {{"type", "string"}}}}},
                             {"passes_through", {{"type", "boolean"}}},
                             {"count", {{"type", "number"}}}}}};

}  // namespace

std::int64_t export_mcap(RecordingReader& reader, const std::string& path) {
    const Manifest& m = reader.manifest();
    std::vector<const plant::Signal*> signals;
    for (const auto* table : {&m.inputs, &m.outputs, &m.rig})
        for (const auto& signal : *table) signals.push_back(&signal);

    McapFile file(path, "shiftrig");
    std::map<std::string, Topic> topics;
    std::map<std::string, json> properties;
    for (std::size_t i = 0; i < signals.size(); ++i) {
        auto [topic, field] = split(signals[i]->name);
        field += plant::suffix(signals[i]->unit);
        topics[topic].fields.emplace_back("\"" + field + "\":", i);
        properties[topic][field] = number_schema(*signals[i]);
    }
    for (auto& [name, topic] : topics)
        topic.channel = file.add_channel(name, "shiftrig" + name,
                                         json{{"type", "object"}, {"properties", properties[name]}}.dump());
    const std::uint16_t events = file.add_channel("/events", "shiftrig/events", event_schema.dump());
    file.add_metadata("model", {{"path", m.model_path}, {"sha256", m.model_hash()}, {"text", m.model_text}});
    file.add_metadata("scenario",
                      {{"path", m.scenario_path}, {"sha256", m.scenario_hash()}, {"text", m.scenario_text}});
    file.add_metadata("run", m.facts);

    std::int64_t ticks = 0;
    std::vector<double> row;
    std::string body;
    for (RecordedTick tick; reader.next(tick); ++ticks) {
        const auto time = static_cast<std::uint64_t>(m.start_utime * 1000 + tick.sim_time_ns);
        const auto sequence = static_cast<std::uint32_t>(tick.tick);
        row.assign(tick.inputs.begin(), tick.inputs.end());
        row.insert(row.end(), tick.outputs.begin(), tick.outputs.end());
        row.insert(row.end(), tick.rig.begin(), tick.rig.end());
        for (const auto& [name, topic] : topics) {
            body = "{";
            for (const auto& [begin, index] : topic.fields) {
                if (!std::isfinite(row[index])) continue;  // JSON has no word for it
                if (body.size() > 1) body += ',';
                body += begin;
                append_number(body, row[index]);
            }
            body += '}';
            file.add_message(topic.channel, sequence, time, body);
        }
        for (const auto& event : tick.events) {
            const std::string device =
                event.device < 0 ? "" : m.devices[static_cast<std::size_t>(event.device)];
            file.add_message(events, sequence, time,
                             event_json(event, device, loop_members(event, m.devices)).dump());
        }
    }
    file.close();
    return ticks;
}

}  // namespace shiftrig::io
