#include "io/scenario_file.h"

#include <algorithm>
#include <filesystem>

#include "io/field_reader.h"
#include "io/field_schema.h"
#include "io/nearest.h"
#include "io/recording/event_names.h"
#include "io/scenario_fields.h"
#include "io/units.h"

namespace shiftrig::io {

namespace {

std::vector<TimedSetting> by_time(const std::string& path, const std::vector<TimelineText>& timeline,
                                  double duration) {
    std::vector<TimedSetting> result;
    for (const auto& moment : timeline) {
        if (moment.settings.empty())
            throw InputError(path, moment.line, moment.column, "timeline: sets no signal");
        if (moment.at >= duration)
            throw InputError(path, moment.line, moment.column,
                             "timeline: at_s = " + in_digits(moment.at) +
                                 "; must be before the end, duration_s = " + in_digits(duration));
        for (const auto& setting : moment.settings) result.push_back({moment.at, moment.over, setting});
    }
    std::stable_sort(result.begin(), result.end(), [](const auto& a, const auto& b) { return a.at < b.at; });
    return result;
}

// Where a key stands; line 0 if it is not there.
KeyPlace place_of(const ReadContext& context, const std::string& key) {
    for (const auto& place : context.places)
        if (place.key == key) return {place.line, place.column};
    return {};
}

// An event is looked for in its window: one without time in it would forbid nothing.
void check_window(const std::string& path, const ExpectedEvent& event, double duration) {
    const auto refuse = [&](double from, const std::string& rule) {
        throw InputError(
            path, event.line, event.column,
            "expect: " + event.kind + " from_s = " + in_digits(from) + "; must be below " + rule);
    };
    const auto [from, until] = event.window;
    if (!(from < until)) refuse(from, "until_s = " + in_digits(until));
    if (!(from < duration)) refuse(from, "duration_s = " + in_digits(duration));
}

Expectations expectations(const std::string& path, const ExpectText& text, double duration) {
    Expectations expect;
    expect.shifts_given = text.no_shifts || !text.shifts.empty();
    for (const auto& shift : text.shifts) {
        if (text.no_shifts)
            throw InputError(path, shift.line, shift.column,
                             "expect.shifts and no_shifts exclude each other");
        expect.shifts.push_back({shift.from + "->" + shift.to, shift.completed, shift.line, shift.column});
    }
    expect.metrics = text.scorecard;
    for (auto event : text.must) expect.events.push_back(std::move(event));
    for (auto event : text.must_not) {
        event.must = false;
        expect.events.push_back(std::move(event));
    }
    expect.signals = text.signals;
    for (const auto& last : text.final_state)
        expect.signals.push_back(
            {last.quantity, {rules::unbounded, rules::unbounded}, last.minimum, last.maximum});

    for (const auto& event : expect.events) {
        if (event.kind.empty())
            throw InputError(path, event.line, event.column, "expect: the event's kind is missing");
        check_window(path, event, duration);
    }
    const auto check_order = [&](const auto& bound, int line, int column, const std::string& what) {
        if (bound.maximum < bound.minimum)
            throw InputError(path, line, column,
                             "expect: " + what + " max = " + in_digits(bound.maximum) +
                                 "; must be at least min = " + in_digits(bound.minimum));
    };
    for (auto& bound : expect.signals) {
        if (bound.minimum == -rules::unbounded && bound.maximum == rules::unbounded)
            throw InputError(path, bound.quantity.line, bound.quantity.column,
                             "expect: " + bound.quantity.written + " needs min or max");
        check_order(bound, bound.quantity.line, bound.quantity.column, bound.quantity.written);
        bound.minimum *= bound.quantity.factor;
        bound.maximum *= bound.quantity.factor;
    }
    for (const auto& limit : expect.metrics) {
        if (limit.minimum == -rules::unbounded && limit.maximum == rules::unbounded)
            throw InputError(path, limit.line, limit.column, "expect: " + limit.metric + " needs min or max");
        check_order(limit, limit.line, limit.column, limit.metric);
    }
    return expect;
}

// The signal of that name.
const plant::Signal& check(const ScenarioFile& scenario, const NamedQuantity& quantity,
                           const std::string& name, const SignalTable& signals) {
    const int index = signals.find(name);
    if (index < 0) {
        const auto near = signals.nearest(name, 1);
        throw InputError(scenario.path, quantity.line, quantity.column,
                         quantity.written + " is no signal of this model" +
                             (near.empty() ? "" : "; nearest: " + near.front()));
    }
    const plant::Signal& signal = signals.signal(index);
    if (signal.unit != quantity.unit)
        throw InputError(scenario.path, quantity.line, quantity.column,
                         quantity.written + " must be written with its unit: " + quantity.signal +
                             " ends in " + suffixes_of(signal.unit));
    return signal;
}

// A value that the rig would have to limit is none that anybody meant: percent for a share, bar for Pa.
void check_setting(const ScenarioFile& scenario, const Setting& setting, const SignalTable& signals) {
    const NamedQuantity& quantity = setting.quantity;
    const plant::Signal& signal = check(scenario, quantity, quantity.signal, signals);
    if (rule_of(signal).holds(setting.value)) return;
    throw InputError(scenario.path, quantity.line, quantity.column,
                     quantity.written + " = " + in_digits(setting.value / quantity.factor) + "; " +
                         rule_of(signal, quantity.factor).words());
}

}  // namespace

ScenarioFile parse_scenario(const std::string& text, const std::string& path) {
    const YAML::Node root = parse_yaml(text, path);
    ReadContext context{path, {}};
    ScenarioText written;
    FieldReader reader(context, root, root.Mark(), "", "");
    fields(reader, written);
    reader.finish();

    const std::filesystem::path place(path);
    ScenarioFile scenario = std::move(written.file);
    scenario.path = path;
    scenario.text = text;
    scenario.name = place.stem().string();
    scenario.model_path = (place.parent_path() / written.model).lexically_normal().string();
    scenario.model_place = place_of(context, "model");
    scenario.start.options_place = place_of(context, "start.options");
    scenario.start.locked_place = place_of(context, "start.locked");
    scenario.timeline = by_time(path, written.timeline, scenario.duration);
    scenario.expect = expectations(path, written.expect, scenario.duration);
    scenario.expect.no_shifts_line = place_of(context, "expect.no_shifts").line;
    return scenario;
}

ScenarioFile read_scenario(const std::string& path) {
    return parse_scenario(read_text(path), path);
}

void check_signals(const ScenarioFile& scenario, const SignalTable& signals) {
    for (const auto& speed : scenario.start.speeds)
        check(scenario, speed.quantity, "mass." + speed.quantity.signal + ".speed", signals);
    for (const auto& input : scenario.start.inputs) check_setting(scenario, input, signals);
    for (const auto& moment : scenario.timeline) check_setting(scenario, moment.setting, signals);
    for (const auto& bound : scenario.expect.signals)
        check(scenario, bound.quantity, bound.quantity.signal, signals);
}

void check_events(const ScenarioFile& scenario, const plant::Model& model) {
    const std::vector<std::string>& devices = model.device_names();
    for (const auto& event : scenario.expect.events) {
        const auto refuse = [&](const std::string& what) {
            throw InputError(scenario.path, event.line, event.column, "expect: " + event.kind + what);
        };
        if (event.device.empty()) continue;
        if (event.kind == "safe_command") refuse(" is of no device: it is the bench's own");
        const auto place = std::find(devices.begin(), devices.end(), event.device);
        if (place == devices.end())
            refuse(" of " + event.device + ": no device of this model has events by that name" +
                   nearest_hint(event.device, devices));
        std::string told;
        bool tells_it = false;
        for (int k = 0; k <= static_cast<int>(plant::last_event_kind); ++k) {
            const auto kind = static_cast<plant::EventKind>(k);
            if (!plant::tells(model, static_cast<std::size_t>(place - devices.begin()), kind)) continue;
            told += (told.empty() ? "" : ", ") + std::string(name(kind));
            tells_it = tells_it || name(kind) == event.kind;
        }
        if (!tells_it) refuse(" of " + event.device + " never happens; its events are " + told);
    }
}

nlohmann::ordered_json scenario_schema() {
    nlohmann::ordered_json schema = {{"$schema", "http://json-schema.org/draft-07/schema#"},
                                     {"title", "shiftrig scenario"}};
    schema.update(FieldSchema::of<ScenarioText>());
    return schema;
}

}  // namespace shiftrig::io
