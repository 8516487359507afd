#include "io/recording/manifest.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "io/recording/checksum.h"

namespace shiftrig::io {

using nlohmann::json;

namespace {

constexpr int format_version = 3;  // since 3 a recording says what its run came to
constexpr int oldest_version = 2;  // that is read

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

// A whole number that fits: the library would make one of anything.
template <class Integer>
void whole(const json& document, const char* key, Integer& value) {
    const json& entry = document.at(key);
    const bool fits = entry.is_number_unsigned()
                          ? std::in_range<Integer>(entry.get<std::uint64_t>())
                          : entry.is_number_integer() && std::in_range<Integer>(entry.get<std::int64_t>());
    if (!fits) throw RecordingError("its manifest has no fitting whole number as " + std::string(key));
    value = entry.get<Integer>();
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
        int version = 0;
        whole(document, "shiftrig_recording", version);
        if (version < oldest_version || version > format_version)
            throw RecordingError("is a recording of format " + std::to_string(version) +
                                 ", this program reads formats " + std::to_string(oldest_version) + " and " +
                                 std::to_string(format_version));
        Manifest m;
        m.model_path = document.at("model").at("path").get<std::string>();
        m.scenario_path = document.at("scenario").at("path").get<std::string>();
        document.at("overrides").get_to(m.overrides);
        document.at("facts").get_to(m.facts);
        document.at("step_size_s").get_to(m.step_size);
        whole(document, "substeps", m.substeps);
        whole(document, "tick_ns", m.tick_ns);
        document.at("kernel").get_to(m.kernel);
        whole(document, "seed", m.seed);
        whole(document, "first_tick", m.first_tick);
        document.at("wall_clock").get_to(m.wall_clock);
        whole(document, "start_utime_us", m.start_utime);
        m.inputs = signals_of(document.at("inputs"));
        m.outputs = signals_of(document.at("outputs"));
        m.rig = signals_of(document.at("rig"));
        document.at("devices").get_to(m.devices);
        if (!(m.step_size > 0) || m.substeps < 1 || m.substeps > 1'000'000 || m.tick_ns < 1)
            throw RecordingError("its manifest has an impossible step size");
        if (m.first_tick < 0 || m.start_utime < 0 || m.start_utime > std::int64_t{1} << 60)
            throw RecordingError("its manifest has an impossible beginning");
        return m;
    } catch (const json::exception& error) {
        throw RecordingError(std::string("its manifest cannot be read: ") + error.what());
    }
}

}  // namespace shiftrig::io
