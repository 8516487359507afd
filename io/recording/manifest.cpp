#include "io/recording/manifest.h"

#include <nlohmann/json.hpp>

#include "io/recording/checksum.h"

namespace shiftrig::io {

using nlohmann::json;

namespace {

constexpr int format_version = 1;

// Units go by their symbol, so that a reader in another language needs no table of ours.
plant::Unit unit_of(const std::string& symbol) {
    for (int i = 0; i <= static_cast<int>(plant::Unit::kilogram); ++i)
        if (plant::symbol(static_cast<plant::Unit>(i)) == symbol) return static_cast<plant::Unit>(i);
    throw RecordingError("its manifest has the unknown unit \"" + symbol + "\"");
}

json table(const std::vector<plant::Signal>& signals) {
    json list = json::array();
    for (const auto& s : signals)
        list.push_back({{"name", s.name},
                        {"unit", plant::symbol(s.unit)},
                        {"initial", s.initial},
                        {"description", s.description}});
    return list;
}

std::vector<plant::Signal> signals_of(const json& list) {
    std::vector<plant::Signal> signals;
    for (const auto& entry : list) {
        plant::Signal s;
        s.name = entry.at("name").get<std::string>();
        s.unit = unit_of(entry.at("unit").get<std::string>());
        s.initial = entry.at("initial").is_null() ? 0 : entry.at("initial").get<double>();
        s.description = entry.at("description").get<std::string>();
        signals.push_back(std::move(s));
    }
    return signals;
}

}  // namespace

std::string Manifest::model_hash() const {
    return sha256(model_text);
}

std::string Manifest::scenario_hash() const {
    return scenario_text.empty() ? "" : sha256(scenario_text);
}

std::string Manifest::to_json() const {
    const json document = {
        {"shiftrig_recording", format_version},
        {"model", {{"path", model_path}, {"sha256", model_hash()}, {"bytes", model_text.size()}}},
        {"scenario", {{"path", scenario_path}, {"sha256", scenario_hash()}, {"bytes", scenario_text.size()}}},
        {"overrides", overrides},
        {"facts", facts},
        {"step_size_s", step_size},
        {"substeps", substeps},
        {"tick_ns", tick_ns},
        {"kernel", kernel},
        {"seed", seed},
        {"first_tick", first_tick},
        {"wall_clock", wall_clock},
        {"start_utime_us", start_utime},
        {"inputs", table(inputs)},
        {"outputs", table(outputs)},
        {"rig", table(rig)},
        {"devices", devices},
        {"initial_state_bytes", initial_state.size()},
    };
    return document.dump(1, ' ', false, json::error_handler_t::replace);
}

Manifest Manifest::from_json(const std::string& text) {
    try {
        const json document = json::parse(text);
        const int version = document.at("shiftrig_recording").get<int>();
        if (version != format_version)
            throw RecordingError("is a recording of format " + std::to_string(version) +
                                 ", this program reads format " + std::to_string(format_version));
        Manifest m;
        m.model_path = document.at("model").at("path").get<std::string>();
        m.scenario_path = document.at("scenario").at("path").get<std::string>();
        document.at("overrides").get_to(m.overrides);
        document.at("facts").get_to(m.facts);
        document.at("step_size_s").get_to(m.step_size);
        document.at("substeps").get_to(m.substeps);
        document.at("tick_ns").get_to(m.tick_ns);
        document.at("kernel").get_to(m.kernel);
        document.at("seed").get_to(m.seed);
        document.at("first_tick").get_to(m.first_tick);
        document.at("wall_clock").get_to(m.wall_clock);
        document.at("start_utime_us").get_to(m.start_utime);
        m.inputs = signals_of(document.at("inputs"));
        m.outputs = signals_of(document.at("outputs"));
        m.rig = signals_of(document.at("rig"));
        document.at("devices").get_to(m.devices);
        if (!(m.step_size > 0) || m.substeps < 1 || m.substeps > 1'000'000 || m.tick_ns < 1)
            throw RecordingError("its manifest has an impossible step size");
        return m;
    } catch (const json::exception& error) {
        throw RecordingError(std::string("its manifest cannot be read: ") + error.what());
    }
}

}  // namespace shiftrig::io
